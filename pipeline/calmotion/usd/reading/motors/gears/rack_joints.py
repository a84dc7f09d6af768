"""Rack and pinion joints of PhysX: a hinge that pushes a slide.

With e and r, the x axes of the joint's frames in pinion (body 0) and rack (body 1), and d from the first frame to the
second, e . omega = ratio c r . v in the world, where c is the sign of (e x d) . r: the sense in which the side of the
pinion that faces the rack moves along r, so that teeth that mesh have a positive ratio on either side. Source:
ExtRackAndPinionJoint.cpp of PhysX 5; `physics:ratio` is in degrees for a unit of length.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.usd import gf
from calmotion.usd.reading.context import Reading, body_on
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.reading.motors.gears.coupling_joints import COUPLED, RACK, Coupling, coupled_joint, ratio_of
from calmotion.usd.transforms import rotation_from_quaternion

if TYPE_CHECKING:
    from pxr import Usd

ALONG = 0.99  # cosine: an axis that is farther off does not lie along the joint's
CLOSE = 1e-3  # as in PhysX, units of the stage: a rack whose distance from the axis is below it has no side


def rack_coupling(
    reading: Reading, prim: Usd.Prim, hinges: Mapping[str, JointPrim], slides: Mapping[str, JointPrim]
) -> Coupling:  # fmt: skip
    """What a rack and pinion couples: length = ratio angle [m/rad].

    Args:
        reading: The stage.
        prim: The rack and pinion joint.
        hinges, slides: Revolute and prismatic joints of the character, by path.

    Raises:
        ShotError: No hinge or no slide; a ratio of zero; bodies or frames that are not those of hinge and slide.
    """
    first, second = COUPLED[RACK]
    what = "a rack and pinion couples a hinge and a slide"
    hinge = coupled_joint(prim, first, hinges, "", what, "PhysicsRevoluteJoint")
    slide = coupled_joint(prim, second, slides, "", what, "PhysicsPrismaticJoint")
    ratio = ratio_of(
        prim, "physics:ratio", "the ratio of a rack is a number that is not zero",
        "Author the degrees that the pinion turns while the rack moves by one unit of length",
    )  # fmt: skip
    e, p0, turn = _frame(reading, prim, 0, hinge)
    r, p1, push = _frame(reading, prim, 1, slide)
    way = float(np.cross(e, p1 - p0) @ r)
    sense = np.sign(way) if abs(way) > CLOSE else 1.0
    radians = np.deg2rad(ratio) / reading.units.length(1.0)
    return Coupling(prim, (hinge.path, slide.path), float(turn / (radians * sense * push)))


def _frame(reading: Reading, prim: Usd.Prim, side: int, joint: JointPrim) -> tuple[Array, Array, float]:
    """One frame of the rack and pinion in the world at the first frame of the shot: its x axis, its origin in units of
    the stage, and the velocity along that axis for a unit of the joint's."""
    body, path = body_on(reading.stage, prim, side), str(prim.GetPath())
    if not body or body not in (joint.body0, joint.body1):
        raise ShotError(
            "body 0 of a rack and pinion is the pinion, and body 1 the rack", path=path,
            attribute=f"physics:body{side}", found=body or None,
            remedy=f"Name a body of {joint.path}: {', '.join(filter(None, (joint.body0, joint.body1)))}",
        )  # fmt: skip
    (on,) = prim.GetRelationship(f"physics:body{side}").GetForwardedTargets()[:1]
    pose = reading.pose(reading.stage.GetPrimAtPath(on))
    offset, turn = (prim.GetAttribute(f"physics:local{what}{side}").Get() for what in ("Pos", "Rot"))
    x = (pose.rotation @ (np.eye(3) if turn is None else rotation_from_quaternion(gf.quaternion(turn))))[:, 0]
    moved = reading.pose(reading.stage.GetPrimAtPath(joint.body1)).rotation
    cosine = float(x @ moved @ rotation_from_quaternion(joint.frame1.rotation)[:, 2])
    if not abs(cosine) > ALONG:
        off = np.degrees(np.arccos(min(abs(cosine), 1.0)))
        raise ShotError(
            f"the x axis of a frame of a rack and pinion lies along its joint, {joint.path}", path=path,
            attribute=f"physics:localRot{side}", found=f"{off:.3g} degrees off it",
            remedy="Turn the frame, or correct the joint that is named",
        )  # fmt: skip
    position = pose.position + pose.rotation @ (pose.scale * (np.zeros(3) if offset is None else gf.vector(offset)))
    return x, position, float(np.sign(cosine)) * (1.0 if body == joint.body1 else -1.0)
