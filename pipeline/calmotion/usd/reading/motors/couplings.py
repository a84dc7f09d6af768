"""What joints of PhysX that couple two others have in common: a gear, and a rack with its pinion.

usd-core does not know their types, so that their attributes have no fallbacks.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.support.naming import nearest
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd import gf
from calmotion.usd.dialects import number_or
from calmotion.usd.reading.context import Reading, body_on, prims_of
from calmotion.usd.reading.joints.joint_prims import JointPrim
from calmotion.usd.reading.motors.gearing import Gear
from calmotion.usd.reading.motors.posed_motors import joint_motions

GEAR, RACK = "PhysxPhysicsGearJoint", "PhysxPhysicsRackAndPinionJoint"
# the joints that a prim of each type couples; the first leads where both are driven
COUPLED = {GEAR: ("physics:hinge0", "physics:hinge1"), RACK: ("physics:hinge", "physics:prismatic")}


@dataclass(frozen=True)
class Coupling:
    """q_1 = ratio q_0 of two joints, by their paths; q counts from the pose in which their bodies stand, SI."""

    prim: Any
    joints: tuple[str, str]
    ratio: float


def coupling_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    """Those of a stage that are enabled."""
    return [
        prim
        for prim in prims_of(stage)
        if prim.GetTypeName() in COUPLED and prim.GetAttribute("physics:jointEnabled").Get() is not False
    ]


def coupled(prim: Usd.Prim, attribute: str) -> str:
    """Path of the joint that a coupling names; empty where it does not name one."""
    relationship = prim.GetRelationship(attribute)
    targets = relationship.GetForwardedTargets() if relationship else []
    return str(targets[0]) if len(targets) == 1 else ""


def coupled_joint(
    prim: Usd.Prim, attribute: str, among: Mapping[str, JointPrim], other: str, what: str, kind: str
) -> JointPrim:
    """The joint that a coupling names.

    Args:
        attribute: The relationship that names the joint.
        among: Joints of the right kind, by path.
        other: Path of the other coupled joint, empty where it is not known yet.
        what: What couples what, for the message.
        kind: Type of the joint, for the message.

    Raises:
        ShotError: None of them, several, or the other one.
    """
    path = coupled(prim, attribute)
    if path in among and path != other:
        return among[path]
    relationship = prim.GetRelationship(attribute)
    targets = [str(target) for target in relationship.GetForwardedTargets()] if relationship else []
    near = nearest(targets[0], among) if targets else ""
    both = " and ".join(COUPLED[str(prim.GetTypeName())])
    raise ShotError(
        what,
        path=str(prim.GetPath()),
        attribute=attribute,
        found=", ".join(targets) or None,
        remedy=f"{near}Name a {kind} of the robot, another joint in each of {both}",
    )


ALONG = 0.99  # cosine: an axis that is farther off does not lie along the joint's
CLOSE = 1e-3  # as in PhysX, units of the stage: a rack whose distance from the axis is below it has no side


def rack_coupling(
    reading: Reading, prim: Usd.Prim, hinges: Mapping[str, JointPrim], slides: Mapping[str, JointPrim]
) -> Coupling:
    """What a rack and pinion couples: length = ratio angle [m/rad].

    Args:
        prim: The rack and pinion joint.
        hinges, slides: Revolute and prismatic joints of the character, by path.

    Raises:
        ShotError: No hinge or no slide; a ratio of zero; bodies or frames that are not those of hinge and slide.
    """
    first, second = COUPLED[RACK]
    what = "a rack and pinion couples a hinge and a slide"
    hinge = coupled_joint(prim, first, hinges, "", what, "PhysicsRevoluteJoint")
    slide = coupled_joint(prim, second, slides, "", what, "PhysicsPrismaticJoint")
    ratio = number_or(prim, "physics:ratio", 1.0)
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
            "body 0 of a rack and pinion is the pinion, and body 1 the rack",
            path=path,
            attribute=f"physics:body{side}",
            found=body or None,
            remedy=f"Name a body of {joint.path}: {', '.join(filter(None, (joint.body0, joint.body1)))}",
        )
    (on,) = prim.GetRelationship(f"physics:body{side}").GetForwardedTargets()[:1]
    pose = reading.pose(reading.stage.GetPrimAtPath(on))
    offset, turn = (prim.GetAttribute(f"physics:local{what}{side}").Get() for what in ("Pos", "Rot"))
    x = (pose.rotation @ (np.eye(3) if turn is None else rotation_from_quaternion(gf.quaternion(turn))))[:, 0]
    moved = reading.pose(reading.stage.GetPrimAtPath(joint.body1)).rotation
    cosine = float(x @ moved @ rotation_from_quaternion(joint.frame1.rotation)[:, 2])
    if not abs(cosine) > ALONG:
        off = np.degrees(np.arccos(min(abs(cosine), 1.0)))
        raise ShotError(
            f"the x axis of a frame of a rack and pinion lies along its joint, {joint.path}",
            path=path,
            attribute=f"physics:localRot{side}",
            found=f"{off:.3g} degrees off it",
            remedy="Turn the frame, or correct the joint that is named",
        )
    position = pose.position + pose.rotation @ (pose.scale * (np.zeros(3) if offset is None else gf.vector(offset)))
    return x, position, float(np.sign(cosine)) * (1.0 if body == joint.body1 else -1.0)


def gears_of_joints(reading: Reading, joints: Sequence[JointPrim], driven: Collection[str]) -> dict[str, Gear]:
    """The gears of joints that gears or racks couple to driven ones, by path; those of a train follow one another.

    Args:
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
                "it couples two joints that no motor drives",
                path=str(left[0].prim.GetPath()),
                attribute=COUPLED[str(left[0].prim.GetTypeName())][0],
                found=" and ".join(left[0].joints),
                remedy="Drive one of them with a motor",
            )
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
                "a gear is on the bodies that its hinges turn",
                path=path,
                attribute="physics:body0",
                found=", ".join(sorted(on)) or None,
                remedy=f"Name bodies of {hinge.path}: {', '.join(filter(None, ends))}",
            )
        found.append(hinge.path)
        signs.append(-1.0 if ends[0] in on else 1.0)
    ratio = number_or(prim, "physics:gearRatio", 1.0)
    return Coupling(prim, (found[0], found[1]), -ratio * signs[0] / signs[1])
