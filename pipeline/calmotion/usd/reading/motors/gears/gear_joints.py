"""Joints of PhysX that couple two others, as gears of the joint that follows.

With the angles q of a gear's hinge 0 and hinge 1 since the pose in which the bodies stand, s_0 ratio q_0 + s_1 q_1 = 0.
The sign s of a hinge is -1 where the gear is on its body 0, +1 where it is on its body 1.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from calmotion.errors import ShotError
from calmotion.usd.reading.context import Reading, body_on
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.reading.motors.gears.coupling_joints import (
    COUPLED,
    GEAR,
    Coupling,
    coupled_joint,
    coupling_prims,
    ratio_of,
)  # fmt: skip
from calmotion.usd.reading.motors.gears.gearing import Gear
from calmotion.usd.reading.motors.gears.rack_joints import rack_coupling
from calmotion.usd.reading.motors.posed_motors import joint_motions

if TYPE_CHECKING:
    from pxr import Usd


def gears_of_joints(reading: Reading, joints: Sequence[JointPrim], driven: Collection[str]) -> dict[str, Gear]:
    """The gears of joints that gears or racks couple to driven ones, by path; those of a train follow one another.

    Args:
        reading: The stage.
        joints: Of the character.
        driven: Paths of those that are motors or follow one.

    Raises:
        ShotError: A coupling without two joints, with a ratio of zero, or on other bodies than its joints; one none of
            whose joints is driven.
    """
    by_path = {joint.path: joint for joint in joints}
    hinges = {joint.path: joint for joint in joints if joint.kind == "revolute"}
    slides = {joint.path: joint for joint in joints if joint.kind == "prismatic"}
    couplings = []
    for prim in coupling_prims(reading.stage):
        with reading.collecting_problems():
            gear = prim.GetTypeName() == GEAR
            couplings.append(_coupling(reading, prim, hinges) if gear else rack_coupling(reading, prim, hinges, slides))
    gears: dict[str, Gear] = {}
    known, left = set(driven), couplings
    while left:
        coupling = next((c for c in left if known.intersection(c.joints)), None)
        if coupling is None:
            raise ShotError(
                "it couples two joints that no motor drives", path=str(left[0].prim.GetPath()),
                attribute=COUPLED[str(left[0].prim.GetTypeName())][0], found=" and ".join(left[0].joints),
                remedy="Drive one of them with a motor",
            )  # fmt: skip
        left = [other for other in left if other is not coupling]
        (leader, follower), ratio = coupling.joints, coupling.ratio
        if leader not in known:
            leader, follower, ratio = follower, leader, 1.0 / ratio
        # of two that are driven the first leads
        code = np.array([reading.start])
        there = [float(m.values[0]) for m in joint_motions(reading, [by_path[leader], by_path[follower]], code)]
        gears[follower] = Gear(leader, ratio, there[1] - ratio * there[0])
        known.add(follower)
    return gears


def _coupling(reading: Reading, prim: Usd.Prim, hinges: Mapping[str, JointPrim]) -> Coupling:
    found: list[str] = []
    path, signs = str(prim.GetPath()), []
    on = {body for side in (0, 1) if (body := body_on(reading.stage, prim, side))}
    for name in COUPLED[GEAR]:
        other = found[0] if found else ""
        hinge = coupled_joint(prim, name, hinges, other, "a gear couples two hinges", "PhysicsRevoluteJoint")
        ends = [body_on(reading.stage, hinge.prim, side) for side in (0, 1)]
        if not on.intersection(end for end in ends if end):
            raise ShotError(
                "a gear is on the bodies that its hinges turn", path=path, attribute="physics:body0",
                found=", ".join(sorted(on)) or None,
                remedy=f"Name bodies of {hinge.path}: {', '.join(filter(None, ends))}",
            )  # fmt: skip
        found.append(hinge.path)
        signs.append(-1.0 if ends[0] in on else 1.0)
    ratio = ratio_of(
        prim, "physics:gearRatio", "the ratio of a gear is a number that is not zero",
        "Author the teeth of hinge 0 over those of hinge 1, with a sign",
    )  # fmt: skip
    return Coupling(prim, (found[0], found[1]), -ratio * signs[0] / signs[1])
