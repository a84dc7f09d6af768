"""Motors: which joints are driven, by which attribute, within which limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import ShotError
from ...shot import FreeTrack, Motor
from .. import schemas
from ..clock import Clock
from ..units import StageUnits
from .context import prims_of
from .joints import JointPrim
from .tracks import sample_codes

ATTRIBUTE = "drive:angular:physics:targetPosition"
LENGTH_ATTRIBUTE = "drive:linear:physics:targetPosition"
_SCHEMA = "CalmMotorAPI"
_FREE = "calm:motor:optimize"
_DRIVES = {"revolute": "angular", "prismatic": "linear"}
_UNITS = {"angular": "degrees", "linear": "units of length"}


def target_attribute(kind: str) -> str:
    """Name of the attribute with the track of a joint of a kind."""
    return LENGTH_ATTRIBUTE if kind == "prismatic" else ATTRIBUTE


def _remedy(kind: str) -> str:
    drive = _DRIVES[kind]
    return (
        f"Apply PhysicsDriveAPI:{drive} and author time samples of {target_attribute(kind)}, in {_UNITS[drive]}, or "
        "remove what makes the joint a motor"
    )


@dataclass(frozen=True, eq=False)
class Drive:
    """A joint that is driven: the joint, the attribute with its track, whether that is animated."""

    joint: JointPrim
    attribute: Any
    animated: bool


def actuated_joints(stage) -> dict[str, str]:
    """Joints that an actuator of a MuJoCo conversion names, with its path (usd-core does not know its type)."""
    found = {}
    for prim in prims_of(stage):
        if prim.GetTypeName() == "MjcActuator":
            relationship = prim.GetRelationship("mjc:target")
            for target in relationship.GetTargets() if relationship else []:
                found[str(target)] = str(prim.GetPath())
    return found


def read_drives(joints: list[JointPrim], actuated: dict[str, str], root: str, notes: list[str]) -> list[Drive]:
    """The driven joints.

    A revolute joint with an angular drive, or a prismatic one with a linear drive, is a motor: with samples or a spline
    it is animated, with a constant target position it holds that. A drive without any target position and without
    stiffness pulls nowhere, and its joint moves freely.

    Args:
        joints: The joints of the character.
        actuated: See `actuated_joints`.
        root: Path of the character, for the message.
        notes: Sentences for the user are added here.

    Raises:
        ShotError: No motors; a motor without animation; a motor inside an instance, where nothing can be written.
    """
    drives: list[Drive] = []
    for joint in joints:
        if joint.prim is None or joint.kind not in _DRIVES:
            _refuse_wrong_motor(joint)
            continue
        drive = _drive(joint, actuated, notes)
        if drive is not None:
            drives.append(drive)
    if not drives:
        raise ShotError(
            "no motors: none of its joints is driven",
            path=root,
            remedy="Apply PhysicsDriveAPI:angular to the revolute joints that motors drive, and author time samples "
            f"of {ATTRIBUTE}, in degrees",
        )
    if not any(drive.animated for drive in drives):
        raise ShotError(
            "a motor without animation, and no other motor is animated either",
            path=drives[0].joint.path,
            attribute=target_attribute(drives[0].joint.kind),
            remedy=_remedy(drives[0].joint.kind),
        )
    for drive in drives:
        if drive.joint.prim.IsInstanceProxy():
            raise ShotError(
                "the motor is inside an instance, where its curve cannot be written",
                path=drive.joint.path,
                attribute=target_attribute(drive.joint.kind),
                remedy="Set instanceable = false on the instance above it",
            )
    return drives


def read_motor(drive: Drive, index: int, units: StageUnits) -> Motor:
    """The motor of a drive, `index` its joint's, limits in SI.

    Raises:
        ShotError: A limit that is not positive.
    """
    prim, linear = drive.joint.prim, drive.joint.kind == "prismatic"
    effort = units.force if linear else units.torque
    to_si = units.length if linear else np.deg2rad
    torque = effort(_limit(prim, "calm:motor:maxTorque"))
    force = prim.GetAttribute(f"drive:{_DRIVES[drive.joint.kind]}:physics:maxForce")
    if force and force.HasAuthoredValue():
        torque = min(torque, effort(_positive(prim, force.GetName(), force.Get())))
    return Motor(
        joint=index,
        path=drive.joint.path,
        attribute=target_attribute(drive.joint.kind),
        optimize=_may_change(prim),
        max_velocity=float(to_si(_limit(prim, "calm:motor:maxVelocity"))),
        max_acceleration=float(to_si(_limit(prim, "calm:motor:maxAcceleration"))),
        max_torque=torque,
        linear=linear,
    )


def _may_change(prim) -> bool:
    """Whether a motor may be changed at all."""
    samples = _free_samples(prim)
    return any(value for _, value in samples) if samples else bool(schemas.value(prim, _SCHEMA, _FREE))


def _free_samples(prim) -> list[tuple[float, bool]]:
    attribute = prim.GetAttribute(_FREE)
    if not attribute or not schemas.is_applied(prim, _SCHEMA):
        return []
    return [(code, bool(attribute.Get(code))) for code in attribute.GetTimeSamples()]


def free_tracks(stage, motors: Sequence[Motor], clock: Clock) -> tuple[FreeTrack, ...]:
    """When motors may be changed, of those for which the shot animates calm:motor:optimize: each sample holds until
    the next."""
    found = []
    for index, motor in enumerate(motors):
        samples = _free_samples(stage.GetPrimAtPath(motor.path))
        if len({value for _, value in samples}) > 1:
            codes, values = zip(*samples, strict=True)
            found.append(FreeTrack(index, clock.seconds(np.array(codes, dtype=np.float64)), np.array(values, bool)))
    return tuple(found)


def _drive(joint: JointPrim, actuated: dict[str, str], notes: list[str]) -> Drive | None:
    prim, name = joint.prim, target_attribute(joint.kind)
    drive, unit = _DRIVES[joint.kind], _UNITS[_DRIVES[joint.kind]]
    has_drive = schemas.is_applied(prim, f"PhysicsDriveAPI:{drive}")
    attribute = prim.GetAttribute(name)
    if has_drive and attribute and len(sample_codes(attribute)):
        return Drive(joint, attribute, True)
    if attribute and len(sample_codes(attribute)):
        raise ShotError(
            "the target position is animated, but the joint has no drive",
            path=joint.path,
            attribute=name,
            remedy=f"Apply PhysicsDriveAPI:{drive} to the joint",
        )
    if schemas.is_applied(prim, _SCHEMA):
        raise ShotError("a motor without animation", path=joint.path, attribute=name, remedy=_remedy(joint.kind))
    if joint.path in actuated:
        raise ShotError(
            f"a motor without animation: the actuator {actuated[joint.path]} drives this joint",
            path=joint.path,
            attribute=name,
            remedy=_remedy(joint.kind),
        )
    if not has_drive:
        return None
    if attribute and attribute.HasAuthoredValue():
        notes.append(f"{joint.path}: its drive is not animated and holds {attribute.Get():g} {unit}")
        return Drive(joint, attribute, False)
    stiffness = prim.GetAttribute(f"drive:{drive}:physics:stiffness").Get()
    if stiffness:
        notes.append(f"{joint.path}: its drive has a stiffness but no target position and holds 0 {unit}")
        return Drive(joint, attribute, False)
    notes.append(f"{joint.path}: its drive has neither a target position nor a stiffness, so the joint moves freely")
    return None


def _refuse_wrong_motor(joint: JointPrim) -> None:
    if joint.prim is not None and schemas.is_applied(joint.prim, _SCHEMA):
        raise ShotError(
            f"a {joint.kind} joint cannot be a motor",
            path=joint.path,
            found=joint.prim.GetTypeName(),
            remedy="Remove CalmMotorAPI, or make it a PhysicsRevoluteJoint or PhysicsPrismaticJoint",
        )


def _limit(prim, name: str) -> float:
    return _positive(prim, name, schemas.value(prim, _SCHEMA, name))


def _positive(prim, name: str, value) -> float:
    if value is None or not value > 0.0:
        raise ShotError(
            "a limit must be positive",
            path=prim.GetPath(),
            attribute=name,
            found=value,
            remedy="Correct the limit, or remove the attribute (then there is none)",
        )
    return float(value)
