"""Links of an MJCF robot without mass: frames of cameras and sites, mounts and empty bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calmotion.errors import ShotError, raise_all
from calmotion.usd import body_on, joint_prims

if TYPE_CHECKING:
    from pxr import Usd

_FIXED = "PhysicsFixedJoint"


def refuse_moving_frames(stage: Usd.Stage, frames: Sequence[Usd.Prim]) -> None:
    """Refuse links without mass that move by themselves, as MuJoCo does: fixed joints tie no mass to them.

    Args:
        stage: The robot.
        frames: Its links without mass.

    Raises:
        ShotError: There is one.
    """
    ends = [(prim, body_on(stage, prim, 0), body_on(stage, prim, 1)) for prim in joint_prims(stage)]
    welds = [{first, second} for prim, first, second in ends if prim.GetTypeName() == _FIXED]
    moved = {second: prim for prim, _, second in ends if prim.GetTypeName() != _FIXED}
    massless = {str(prim.GetPath()) for prim in frames}
    raise_all(
        [
            ShotError(
                "a body without mass moves, and carries none", path=frame, attribute="inertial",
                found=f"the joint {moved[frame].GetName()}",
                remedy="Write its <inertial>, or a geom with a mass, as MuJoCo demands",
            )
            for frame in sorted(massless & moved.keys())
            if _welded_to(frame, welds) <= massless
        ]
    )  # fmt: skip


def _welded_to(body: str, welds: Sequence[set[str]]) -> set[str]:
    """A body and those that fixed joints tie to it, directly or not; the world is the empty name."""
    found = {body}
    while more := set().union(*(ends for ends in welds if ends & found)) - found:
        found |= more
    return found
