"""Gear joints of PhysX: two hinges that turn each other.

With the angles q of hinge 0 and hinge 1 since the pose in which the bodies stand, s_0 ratio q_0 + s_1 q_1 = 0. The sign
s of a hinge is -1 where the gear is on its body 0, +1 where it is on its body 1. usd-core does not know the type.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from calmotion.errors import ShotError
from calmotion.support.naming import nearest
from calmotion.usd.dialects import number_of
from calmotion.usd.reading.context import Reading, body_on, prims_of
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.reading.motors.gearing import Gear
from calmotion.usd.reading.motors.posed_motors import joint_motions

if TYPE_CHECKING:
    from pxr import Usd

TYPE, RACK = "PhysxPhysicsGearJoint", "PhysxPhysicsRackAndPinionJoint"
HINGES, RATIO = ("physics:hinge0", "physics:hinge1"), "physics:gearRatio"


@dataclass(frozen=True)
class _Coupling:
    """q_1 = ratio q_0, of two joints by their paths."""

    prim: Any
    hinges: tuple[str, str]
    ratio: float


def gears_of_joints(reading: Reading, joints: Sequence[JointPrim], driven: Collection[str]) -> dict[str, Gear]:
    """The gears of the hinges that gear joints couple to driven ones, by path; those of a train follow one another.

    Args:
        reading: The stage.
        joints: Of the character.
        driven: Paths of those that are motors or follow one.

    Raises:
        ShotError: A gear joint without two hinges, with a ratio of zero, or on other bodies than its hinges; one none
            of whose hinges is driven.
    """
    hinges = {joint.path: joint for joint in joints if joint.kind == "revolute"}
    couplings = []
    for prim in _enabled(reading):
        with reading.collecting_problems():
            couplings.append(_coupling(reading, prim, hinges))
    gears: dict[str, Gear] = {}
    known, left = set(driven), couplings
    while left:
        coupling = next((c for c in left if known.intersection(c.hinges)), None)
        if coupling is None:
            raise ShotError(
                "the gear couples two hinges that no motor drives", path=str(left[0].prim.GetPath()),
                attribute=HINGES[0], found=" and ".join(left[0].hinges), remedy="Drive one of them with a motor",
            )  # fmt: skip
        left = [other for other in left if other is not coupling]
        (leader, follower), ratio = coupling.hinges, coupling.ratio
        if leader not in known:
            leader, follower, ratio = follower, leader, 1.0 / ratio
        # of two that are driven the first leads
        code = np.array([reading.start])
        there = [float(m.values[0]) for m in joint_motions(reading, [hinges[leader], hinges[follower]], code)]
        gears[follower] = Gear(leader, ratio, there[1] - ratio * there[0])
        known.add(follower)
    return gears


def _enabled(reading: Reading) -> Iterator[Usd.Prim]:
    for prim in prims_of(reading.stage):
        kind = prim.GetTypeName()
        if kind not in (TYPE, RACK) or prim.GetAttribute("physics:jointEnabled").Get() is False:
            continue
        if kind == TYPE:
            yield prim
        else:
            reading.note(f"{prim.GetPath()}: a rack and pinion is not simulated; a mimic joint can take its place")


def _coupling(reading: Reading, prim: Usd.Prim, hinges: Mapping[str, JointPrim]) -> _Coupling:
    path, found, signs = str(prim.GetPath()), [], []
    on = {body for side in (0, 1) if (body := body_on(reading.stage, prim, side))}
    for name in HINGES:
        relationship = prim.GetRelationship(name)
        targets = [str(target) for target in relationship.GetForwardedTargets()] if relationship else []
        if len(targets) != 1 or targets[0] not in hinges or targets[0] in found:
            near = nearest(targets[0], hinges) if targets else ""
            raise ShotError(
                "a gear couples two hinges", path=path, attribute=name, found=", ".join(targets) or None,
                remedy=f"{near}Name a PhysicsRevoluteJoint of the robot, another one in each of {' and '.join(HINGES)}",
            )  # fmt: skip
        ends = [body_on(reading.stage, hinges[targets[0]].prim, side) for side in (0, 1)]
        if not on.intersection(end for end in ends if end):
            raise ShotError(
                "a gear is on the bodies that its hinges turn", path=path, attribute="physics:body0",
                found=", ".join(sorted(on)) or None,
                remedy=f"Name bodies of {targets[0]}: {', '.join(filter(None, ends))}",
            )  # fmt: skip
        found.append(targets[0])
        signs.append(-1.0 if ends[0] in on else 1.0)
    ratio = number_of(prim, RATIO)
    ratio = 1.0 if ratio is None else ratio
    if not math.isfinite(ratio) or ratio == 0.0:
        raise ShotError(
            "the ratio of a gear is a number that is not zero", path=path, attribute=RATIO, found=ratio,
            remedy="Author the teeth of hinge 0 over those of hinge 1, with a sign",
        )  # fmt: skip
    return _Coupling(prim, (found[0], found[1]), -ratio * signs[0] / signs[1])
