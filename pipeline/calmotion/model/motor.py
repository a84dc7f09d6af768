"""Motors: how a joint is driven, and the units in which its values are displayed (degrees, millimetres)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

PRESCRIBED, DRIVE, SERVO = MODELS = ("prescribed", "drive", "servo")  # models of motors
ON_JOINT, ON_ERROR = "joint", "error"  # what a velocity gain multiplies
FRICTION_SPEED = float(np.radians(5.0))  # within which Coulomb friction changes its sign, where none is given [rad/s]


@dataclass(frozen=True)
class Rotor:
    """What a servo has between its controller and the joint, seen at the joint; metres on a slider.

    Attributes:
        armature: Inertia of the rotor [kg m^2].
        gear_stiffness, gear_damping: Of the gear [N m/rad], [N m s/rad]; an infinite stiffness: a rigid gear.
        viscous_friction: [N m s/rad].
        friction: Coulomb friction [N m].
        friction_speed: Speed by which it is smoothed [rad/s].
        no_load_speed: At which the motor has no torque left [rad/s].
        knee: Share of it up to which the largest torque is there.
    """

    armature: float = 0.0
    gear_stiffness: float = np.inf
    gear_damping: float = 0.0
    viscous_friction: float = 0.0
    friction: float = 0.0
    friction_speed: float = FRICTION_SPEED
    no_load_speed: float = np.inf
    knee: float = 0.0


@dataclass(frozen=True)
class Follows:
    """How one motor is geared to another: value = offset + ratio * value of the leader.

    Attributes:
        leader: Index of the motor that leads, which follows none itself.
        ratio: [-], or [m/rad] and [rad/m] between an angle and a length.
        offset: [rad or m].
    """

    leader: int
    ratio: float
    offset: float


@dataclass(frozen=True, eq=False)
class Motor:
    """A driven joint.

    Attributes:
        joint: Index of the joint.
        path: Prim path of the joint, with the name of the axis behind it where the joint has several (`.rotX`).
        attribute: Name of the attribute that holds its track.
        source: Where the track is: `drive` (the target position of its drive), `bodies` (the transforms of the bodies
            that it joins), or `skeleton` (a joint of a UsdSkel animation).
        optimize: Whether its curve may be changed.
        max_velocity, max_acceleration, max_jerk: [rad/s], [rad/s^2], [rad/s^3]; infinite when there are none.
        max_torque: [N m]; likewise.
        linear: Whether it sets a length along the joint's axis instead of an angle: metres then stand for radians,
            and newtons for newton metres.
        follows: The motor that it is geared to, or None; it then has no curve of its own.
        idle: Whether its curve stays as it is although it may change, since it moves no target.
        model: PRESCRIBED: the joint follows the curve exactly; DRIVE: the curve is a command, towards which a spring
            and a damper pull the joint; SERVO: they turn a rotor, which moves the joint through a gear.
        position_gain: Stiffness of the drive [N m/rad].
        velocity_gain: Its damping [N m s/rad].
        damping_on: What that multiplies: ON_ERROR: the difference of the command's rate and the joint's (the rotor's,
            of a SERVO), ON_JOINT: the joint's own rate.
        gains_from: Where these were read, also where the model does not use them.
        rotor: Of a SERVO; of a PRESCRIBED motor the one that it would have as a SERVO.
        delay: Time after which the command acts [s]; not of a PRESCRIBED motor, which does not use it.
        backlash: Play between the motor and the joint, from one end to the other [rad]; it is not simulated.
        kind: Name of the real motor that it is, or empty; its rotor is then known, whatever the model.
    """

    joint: int
    path: str
    attribute: str
    source: str = "drive"
    optimize: bool = True
    max_velocity: float = np.inf
    max_acceleration: float = np.inf
    max_jerk: float = np.inf
    max_torque: float = np.inf
    linear: bool = False
    follows: Follows | None = None
    idle: bool = False
    model: str = PRESCRIBED
    position_gain: float = 0.0
    velocity_gain: float = 0.0
    damping_on: str = ON_ERROR
    gains_from: str = ""
    rotor: Rotor = Rotor()
    delay: float = 0.0
    backlash: float = 0.0
    kind: str = ""

    @property
    def prim_path(self) -> str:
        """Path of the joint's prim, without the name of an axis."""
        return self.path.partition(".")[0]

    @property
    def model_of_gains(self) -> str:
        """The model that simulates what is known of the motor; its own where it gives, or where no gain is known."""
        if self.model != PRESCRIBED or not self.position_gain > 0.0:
            return self.model
        return SERVO if self.kind or self.rotor != Rotor() else DRIVE


class Measure(NamedTuple):
    """Words and units for one kind of motor.

    Attributes:
        name, effort: Name of the value, and of the effort.
        unit, effort_unit, si: Unit that is shown, unit of the effort, unit of the value in SI.
        factor: From SI to the unit that is shown.
    """

    name: str
    effort: str
    unit: str
    effort_unit: str
    si: str
    factor: float


ANGLE = Measure("angle", "torque", "deg", "N m", "rad", float(np.degrees(1.0)))
LENGTH = Measure("length", "force", "mm", "N", "m", 1e3)


def measure_of(motor: Motor) -> Measure:
    """The measure of a motor."""
    return LENGTH if motor.linear else ANGLE
