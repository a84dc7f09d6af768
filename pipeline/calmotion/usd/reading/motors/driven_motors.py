"""Motors: which joints are driven, and where the track of each is."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pxr import Usd

from calmotion.errors import ShotError
from calmotion.model import Follows, Motor
from calmotion.usd import schemas
from calmotion.usd.dialects import number_of
from calmotion.usd.reading.actuators.described_motors import described_motor
from calmotion.usd.reading.actuators.foreign_actuators import ACTUATOR, TARGETS, affine_actuators
from calmotion.usd.reading.actuators.gains import read_gains
from calmotion.usd.reading.actuators.rotors import read_delay, read_rotor
from calmotion.usd.reading.context import Reading, prims_of
from calmotion.usd.reading.joints.joint_prims import JointPrim, refuse_unsupported
from calmotion.usd.reading.motors.couplings import gears_of_joints
from calmotion.usd.reading.motors.gearing import Gear, led_by_driven, read_gear, read_turns_with, resolve
from calmotion.usd.reading.motors.motor_limits import effort_limit, may_change, velocity_limit
from calmotion.usd.reading.motors.tracks import sample_codes
from calmotion.usd.reading.motors.undriven_joints import (
    note_or_refuse_no_motors,
    refuse_connection,
    refuse_unused_animation,
)
from calmotion.usd.units import StageUnits

_TARGET_POSITION = "drive:{drive}:physics:targetPosition"
SKEL_JOINT = "calm:motor:skelJoint"
DRIVE, BODIES, SKELETON, CONSTANT, GEARED, GIVEN = "drive", "bodies", "skeleton", "constant", "geared", "given"
_SCHEMA = "CalmMotorAPI"
_UNITS = {"revolute": "degrees", "prismatic": "units of length"}
_ACTUATORS = {"MjcActuator": "mjc:target", ACTUATOR: TARGETS}
_WRITTEN_AS = {BODIES: "xformOpOrder", SKELETON: SKEL_JOINT}


def target_attribute(joint: JointPrim) -> str:
    """Name of the attribute with the track of a joint that a motor can drive."""
    return _TARGET_POSITION.format(drive=joint.drive)


def to_si(kind: str, units: StageUnits) -> float:
    """Radians or metres in the unit of that attribute."""
    return float(units.length(1.0) if kind == "prismatic" else np.deg2rad(1.0))


def _remedy(joint: JointPrim) -> str:
    return (
        f"Apply PhysicsDriveAPI:{joint.drive} and author time samples of {target_attribute(joint)}, in "
        f"{_UNITS[joint.kind]}, or "
        "animate the transforms of the bodies that it joins, or remove what makes the joint a motor"
    )


@dataclass(frozen=True, eq=False)
class Drive:
    """A joint that is driven.

    Attributes:
        joint: The joint.
        source: Where its track is: `DRIVE` (samples or a spline of the target position), `BODIES` (transforms of the
            bodies), `SKELETON` (a joint of a UsdSkel animation), `CONSTANT` (nowhere: it holds a value), `GEARED`
            (another motor's), `GIVEN` (beside the shot).
        constant: The value that it holds [rad or m]; None: that of the pose in which the bodies stand.
        skel_joint: The joint of the skeleton.
        gear: How it follows another motor.
        actuator: Path of the actuator that drives it, of a MuJoCo conversion or of Newton, or empty.
        note: What holds it where nothing animates it, for the user.
    """

    joint: JointPrim
    source: str
    constant: float | None = None
    skel_joint: str = ""
    gear: Gear | None = None
    actuator: str = ""
    note: str = ""

    def attribute(self, stage: Usd.Stage) -> Any:
        """The target position of its drive, on a stage; invalid where the joint has no drive."""
        return stage.GetPrimAtPath(self.joint.prim_path).GetAttribute(target_attribute(self.joint))


def actuated_joints(stage: Usd.Stage) -> dict[str, str]:
    """Joints that an actuator of Newton drives, or one of a MuJoCo conversion, itself or by a tendon, with the
    actuator's path (usd-core does not know these types)."""
    found = {}
    for prim in prims_of(stage):
        name = _ACTUATORS.get(str(prim.GetTypeName()))
        if name is None:
            continue
        relationship = prim.GetRelationship(name)
        for target in relationship.GetTargets() if relationship else []:
            named = stage.GetPrimAtPath(target)
            path = named.GetRelationship("mjc:path") if named else None
            for joint in path.GetTargets() if path else [target]:
                found[str(joint)] = str(prim.GetPath())
    return found


def read_drives(
    reading: Reading, joints: list[JointPrim], root: str, posed: Sequence[str], given: Sequence[str], still: bool,
    rooted: bool = False,
) -> list[Drive]:  # fmt: skip
    """The driven joints.

    A revolute joint with an angular drive, or a prismatic one with a linear drive, is a motor, and one that an actuator
    of a MuJoCo conversion names. A drive without any target position and without stiffness pulls nowhere, and its joint
    moves freely.

    Args:
        root: Path of the character, for the message.
        posed: Joints whose bodies the shot moves relative to each other, by their transforms; where there are any, the
            motors that hold still are read from the bodies as well.
        given: Joints whose tracks are given beside the shot.
        still: Whether a character that is not animated at all may be read.
        rooted: Whether the shot moves a root of the character, which then needs no animated motor, and no motor.

    Raises:
        ShotError: No motors; none that is animated; a motor inside an instance, where nothing can be written.
    """
    kinds = {joint.path: joint.kind for joint in joints}
    actuated, drives, gears = actuated_joints(reading.stage), {}, {}
    for joint in joints:
        with reading.collecting_problems():
            if joint.prim is None or joint.kind not in _UNITS:
                _refuse_wrong_motor(joint)
                continue
            gear = read_gear(joint, kinds, reading.units)
            if gear is not None:
                gears[joint.path] = gear
            drive = _drive(joint, actuated, reading, posed, given)
            if drive is not None:
                drives[joint.path] = replace(drive, actuator=actuated.get(joint.path, ""))
    with reading.collecting_problems():
        gears |= gears_of_joints(reading, joints, {*drives, *gears})
        gears = led_by_driven(resolve(gears), drives)
        _add_geared_motors(drives, resolve(gears), {joint.path: joint for joint in joints}, reading)
    with reading.collecting_problems():
        refuse_unused_animation(reading, joints, drives, given)
    found = [drives[joint.path] for joint in joints if joint.path in drives]
    for drive in found:
        if drive.note:
            reading.note(f"{drive.joint.path}: {drive.note}")
    if reading.problems:
        return found
    if not found:
        for joint in joints:
            refuse_unsupported(joint)
        note_or_refuse_no_motors(reading, joints, root, still or rooted)
        return found
    if not (still or rooted) and all(drive.source in (CONSTANT, GEARED) for drive in found):
        raise ShotError(
            "a motor without animation, and no other motor is animated",
            path=found[0].joint.path,
            attribute=target_attribute(found[0].joint),
            remedy=_remedy(found[0].joint),
        )
    _refuse_duplicate_motors(found, reading)
    for drive in found:
        if drive.joint.prim.IsInstanceProxy():
            reading.problems.append(
                ShotError(
                    "the motor is inside an instance, where its curve cannot be written",
                    path=drive.joint.path,
                    attribute=target_attribute(drive.joint),
                    remedy="Set instanceable = false on the instance above it",
                )
            )
    return found


def _refuse_duplicate_motors(drives: Sequence[Drive], reading: Reading) -> None:
    """Refuse two motors between the same two bodies: they would prescribe one angle twice."""
    first: dict[frozenset[str], Drive] = {}
    for drive in drives:
        pair = frozenset((drive.joint.body0, drive.joint.body1))
        rival = first.setdefault(pair, drive)
        if rival is not drive:
            reading.problems.append(
                ShotError(
                    "two motors drive the same pair of bodies",
                    path=drive.joint.path,
                    attribute=target_attribute(drive.joint),
                    found=rival.joint.path,
                    # a converter of MJCF ties the joints of one body, which act one after the other, to the same two
                    remedy="Import the robot's .xml file, which gives each joint a body of its own"
                    if drive.joint.prim is not None and schemas.is_applied(drive.joint.prim, "MjcJointAPI")
                    else "Remove one of the joints, or the drive of one of them",
                )
            )


def _add_geared_motors(
    drives: dict[str, Drive], gears: dict[str, Gear], joints: dict[str, JointPrim], reading: Reading
) -> None:
    """Add a motor for each joint that is geared to a motor."""
    for path, gear in gears.items():
        if gear.leader not in drives:
            raise ShotError(
                "the joint is geared to one that no motor drives",
                path=path,
                found=gear.leader,
                remedy="Drive the leading joint with a motor, or model the gear as a closed chain of bodies and joints",
            )
        if path in drives and drives[path].source not in (CONSTANT, GEARED):
            reading.note(f"{path}: it is geared to {gear.leader}, so its own animation is not used")
        drives[path] = Drive(joints[path], GEARED, gear=gear)


def read_motor(drive: Drive, index: int, motors: dict[str, int], reading: Reading) -> Motor:
    """The motor of a drive, limits in SI.

    Args:
        motors: Index of each motor, by the path of its joint.

    Raises:
        ShotError: A limit that is not positive; a model or gains that cannot be used.
    """
    prim, gear = drive.joint.prim, drive.gear
    described = described_motor(reading, drive.joint, drive.actuator)
    for actuator in affine_actuators(described.mujoco):
        if actuator.holds and (doubt := actuator.doubt()):
            reading.note(f"{drive.joint.path}: {doubt} ({actuator.prim.GetPath()})")
    gains = read_gains(described)
    motor = Motor(
        joint=index,
        path=drive.joint.path,
        attribute=_WRITTEN_AS.get(drive.source, target_attribute(drive.joint)),
        source=drive.source if drive.source in _WRITTEN_AS else DRIVE,
        optimize=may_change(prim),
        max_velocity=velocity_limit(described),
        max_acceleration=described.own_or_named("maxAcceleration", "", described.length, math.inf),
        max_jerk=described.own_or_named("maxJerk", "", described.length, math.inf),
        max_torque=effort_limit(described),
        linear=described.linear,
        follows=None if gear is None else Follows(motors[gear.leader], gear.ratio, gear.offset),
        model=described.model,
        position_gain=gains.position,
        velocity_gain=gains.velocity,
        damping_on=gains.damping_on,
        gains_from=gains.source,
        rotor=read_rotor(described),
        delay=read_delay(described),
        backlash=described.own_or_named("backlash", "backlash", described.length, 0.0),
        kind=described.kind.name,
        turns_with=read_turns_with(drive.joint, motors),
    )
    factor = described.own("gainFactor")  # by what a calibration found the gain to differ
    return motor if factor is None else motor.with_gain(factor * motor.position_gain)


def _drive(
    joint: JointPrim, actuated: dict[str, str], reading: Reading, posed: Sequence[str], given: Sequence[str]
) -> Drive | None:
    prim, name = joint.prim, target_attribute(joint)
    drive, unit = joint.drive, _UNITS[joint.kind]
    has_drive, ours = schemas.is_applied(prim, f"PhysicsDriveAPI:{drive}"), schemas.is_applied(prim, _SCHEMA)
    if joint.whole is not None and any(_has_drive(prim, other) for other in joint.free):
        ours = ours and has_drive  # it is for those axes that have a drive
    if joint.path in given:
        return Drive(joint, GIVEN)
    attribute = prim.GetAttribute(name)
    if has_drive and attribute and len(sample_codes(attribute)):
        return Drive(joint, DRIVE)
    if has_drive and attribute:
        refuse_connection(joint.path, attribute)
    if attribute and len(sample_codes(attribute)):
        raise ShotError(
            "the target position is animated, but the joint has no drive",
            path=joint.path,
            attribute=name,
            remedy=f"Apply PhysicsDriveAPI:{drive} to the joint",
        )
    skel_joint = str(schemas.value(prim, _SCHEMA, SKEL_JOINT) or "") if ours else ""
    if not (has_drive or ours or joint.path in actuated):
        return None
    if joint.path in posed:
        return Drive(joint, BODIES)
    if skel_joint:
        return Drive(joint, SKELETON, skel_joint=skel_joint)
    if posed:
        return Drive(joint, BODIES)
    constant = number_of(prim, _TARGET_POSITION, drive) if has_drive else None
    if constant is not None:
        note = f"its drive is not animated and holds {constant:g} {unit}"
        return Drive(joint, CONSTANT, constant=constant * to_si(joint.kind, reading.units), note=note)
    if joint.path not in actuated and prim.GetAttribute(f"drive:{drive}:physics:stiffness").Get():
        note = f"its drive has a stiffness but no target position and holds 0 {unit}"
        return Drive(joint, CONSTANT, constant=0.0, note=note)
    if ours or joint.path in actuated:
        what = "an actuator drives it" if joint.path in actuated else "it is a motor"
        return Drive(joint, CONSTANT, note=f"{what}, nothing animates it, and it holds the pose of its bodies")
    lost = ""
    if prim.GetAttribute(f"drive:{drive}:physics:damping").Get():
        lost = ", without its damping; a targetPosition makes it a motor, with a stiffness one that gives way"
    reading.note(
        f"{joint.path}: its drive has neither a target position nor a stiffness, so the joint moves freely{lost}"
    )
    return None


def _has_drive(prim: Usd.Prim, direction: str) -> bool:
    return schemas.is_applied(prim, f"PhysicsDriveAPI:{direction}")


def _refuse_wrong_motor(joint: JointPrim) -> None:
    if joint.prim is not None and schemas.is_applied(joint.prim, _SCHEMA):
        raise ShotError(
            f"a joint of this type ({joint.kind}) cannot be a motor",
            path=joint.path,
            found=joint.prim.GetTypeName(),
            remedy="Remove CalmMotorAPI, or make it a PhysicsRevoluteJoint or PhysicsPrismaticJoint",
        )
