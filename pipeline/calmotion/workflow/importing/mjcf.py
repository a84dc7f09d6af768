"""What of an MJCF robot no shot can hold: refused where the robot would be another one, else told."""

from __future__ import annotations

import xml.etree.ElementTree as xml

from calmotion.errors import ShotError

_JOINTS = ("joint", "freejoint")


def refuse_several_joints(root: xml.Element, path: str) -> None:
    """Refuse bodies with several joints: MuJoCo moves them one after the other, and a converter ties each of them to
    the same two bodies, so that together they hold what they should move.

    Raises:
        ShotError: There is one.
    """
    for body in root.iter("body"):
        joints = [node.get("name", node.tag) for node in body if node.tag in _JOINTS]
        if len(joints) > 1:
            raise ShotError(
                "a body with several joints is not supported", path=path, attribute=f"body {body.get('name', '')}",
                found=", ".join(joints),
                remedy="Give each joint a body of its own, one inside the other, with a small mass in between",
            )  # fmt: skip


def unread(root: xml.Element) -> tuple[str, ...]:
    """What is not read of a robot, as sentences for the user."""
    found = []
    tendons = [node.get("name", node.tag) for tendon in root.findall("tendon") for node in tendon]
    if tendons:
        found.append(f"tendons are not read, so that nothing couples their joints: {', '.join(tendons)}")
    shifted = [node.get("name", "") for node in root.iter("joint") if _number(node.get("ref")) != 0.0]
    if shifted:
        found.append(
            "joints whose ref is not 0 count from the pose of the file, where their value is 0 and not ref: "
            f"{', '.join(shifted)}; subtract ref from their motion"
        )
    return tuple(found)


def _number(text: str | None) -> float:
    try:
        return float(text or 0.0)
    except ValueError:
        return 0.0
