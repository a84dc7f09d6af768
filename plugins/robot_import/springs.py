"""Springs of MuJoCo joints (`stiffness`, `springref`): drives that no curve moves, which pull to one value."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from calmotion.usd import DAMPING_ON, StageUnits, body_on, joint_prims, prims_of

from .robot_motors import axes_of, is_driven, named

if TYPE_CHECKING:
    from pxr import Usd

_KINDS = ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint")


def author_springs(stage: Usd.Stage, units: StageUnits) -> list[str]:
    """Make drives of the springs of joints that no motor drives and that are in no closed chain.

    The torque of such a drive, k (springref - theta) - d theta', is that of MuJoCo's joint. In a closed chain a rigid
    robot could not hold all springs where they pull to.

    Args:
        stage: Where they are authored; motors are there already.
        units: Of the stage.

    Returns:
        Notes for the user.
    """
    radians = any(prim.GetAttribute("mjc:compiler:angle").Get() == "radian" for prim in prims_of(stage))
    joints = list(joint_prims(stage))
    made, driven, others = [], [], []
    for prim in joints:
        stiffness = prim.GetAttribute("mjc:stiffness")
        if not (stiffness and stiffness.Get()):
            continue
        if prim.GetTypeName() not in _KINDS or _in_closed_chain(stage, prim, joints):
            others.append(named(prim))
        elif is_driven(axes_of(prim)[0]):
            driven.append(named(prim))
        else:
            _author(prim, radians, units)
            made.append(named(prim))
    notes = []
    if made:
        notes.append(f"springs of joints are drives that hold one value and are not optimised: {', '.join(made)}")
    if driven:
        notes.append(
            "springs of joints with motors are not read: efforts, and commands of motors that give, are without them: "
            f"{', '.join(driven)}"
        )
    if others:
        notes.append(f"springs of ball joints and of joints in closed chains are not read: {', '.join(others)}")
    return notes


def _author(prim: Usd.Prim, radians: bool, units: StageUnits) -> None:
    from pxr import Sdf, UsdPhysics

    axis = axes_of(prim)[0]
    stiffness = float(prim.GetAttribute("mjc:stiffness").Get())
    at = float(prim.GetAttribute("mjc:springref").Get() or 0.0)
    drive = UsdPhysics.DriveAPI.Apply(prim, axis.drive)
    if axis.linear:
        drive.CreateStiffnessAttr(stiffness / units.force(1.0) * units.length(1.0))
        drive.CreateTargetPositionAttr(at / units.length(1.0))
    else:
        drive.CreateStiffnessAttr(stiffness / units.torque(1.0) * np.radians(1.0))
        drive.CreateTargetPositionAttr(float(np.degrees(at)) if radians else at)
    damping = prim.GetAttribute("newton:damping")
    drive.CreateDampingAttr(float(damping.Get() or 0.0) if damping else 0.0)
    if damping:
        damping.Block()  # a servo would add it
    prim.AddAppliedSchema("CalmMotorAPI")
    for name, kind, value in (
        ("calm:motor:model", Sdf.ValueTypeNames.Token, "drive"),
        (DAMPING_ON, Sdf.ValueTypeNames.Token, "joint"),
        ("calm:motor:optimize", Sdf.ValueTypeNames.Bool, False),
    ):
        prim.CreateAttribute(name, kind).Set(value)


def _in_closed_chain(stage: Usd.Stage, prim: Usd.Prim, joints: Sequence[Usd.Prim]) -> bool:
    """Whether the other joints connect the two bodies of a joint."""
    pairs = [{body_on(stage, other, side) for side in (0, 1)} for other in joints if other != prim]
    start, end = (body_on(stage, prim, side) for side in (0, 1))
    reached = {start}
    while True:
        more = {body for pair in pairs if pair & reached for body in pair} - reached
        if not more:
            return end in reached
        reached |= more
