"""What of an MJCF robot no shot can hold: refused where the robot would be another one, else told."""

from __future__ import annotations

import xml.etree.ElementTree as xml

from calmotion.errors import ShotError

_JOINTS = ("joint", "freejoint")
_MASSES = {  # what gives the same masses
    "settotalmass": "Scale the masses and densities of the file to this sum",
    "inertiafromgeom": "Remove the <inertial> elements, which MuJoCo does not use",
    "inertiagrouprange": 'Write mass="0" on the geoms of other groups',
}


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


def refuse_other_masses(root: xml.Element, path: str) -> None:
    """Refuse settings of the compiler by which MuJoCo's masses are other ones than those that a converter reads.

    Raises:
        ShotError: There is one, and it changes a mass.
    """
    told = root.find(".//inertial") is not None
    weighed = any(body.find("geom") is not None and body.find("inertial") is None for body in root.iter("body"))
    for node in root.iter("compiler"):
        from_geoms = node.get("inertiafromgeom") == "true"
        changing = {
            "settotalmass": _number(node.get("settotalmass")) > 0.0,
            "inertiafromgeom": from_geoms and told,
            "inertiagrouprange": (from_geoms or weighed) and _leaves_geoms_out(root, node.get("inertiagrouprange")),
        }
        for name in (name for name, changes in changing.items() if changes):
            raise ShotError(
                "this setting changes masses, and is not supported", path=path, attribute=f"compiler {name}",
                found=node.get(name), remedy=f"{_MASSES[name]}, and remove {name}",
            )  # fmt: skip


def _leaves_geoms_out(root: xml.Element, text: str | None) -> bool:
    low, high = [*map(_number, (text or "0 5").split()), 5.0, 5.0][:2]
    return not all(low <= _number(node.get("group")) <= high for node in root.iter("geom"))


def refuse_curved_followers(root: xml.Element, path: str) -> None:
    """Refuse joints that follow another one by more than a line, of which a converter keeps the line.

    Raises:
        ShotError: There is one.
    """
    for node in root.findall("equality/joint"):
        text = node.get("polycoef", "")
        if any(_number(word) != 0.0 for word in text.split()[2:]):
            raise ShotError(
                "a joint that follows another one by a curve is not supported", path=path,
                attribute=f"equality joint {node.get('joint1', '')} polycoef", found=text,
                remedy="Keep its first two numbers, an offset and a ratio; or remove the equality, and give the joint "
                "an actuator and a motion of its own",
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
            f"{', '.join(shifted)}; so do their limits; subtract ref from their motion"
        )
    return tuple(found)


def _number(text: str | None) -> float:
    try:
        return float(text or 0.0)
    except ValueError:
        return 0.0
