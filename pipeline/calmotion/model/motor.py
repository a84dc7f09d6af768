"""Motors: how a joint is driven, and the units in which its values are displayed (degrees, millimetres)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import ClassVar, NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.model.animation import Schedule

PRESCRIBED, DRIVE, SERVO = MODELS = ("prescribed", "drive", "servo")  # models of motors
ON_JOINT, ON_ERROR = "joint", "error"  # what a velocity gain multiplies
FRICTION_SPEED = float(np.radians(5.0))  # within which Coulomb friction changes its sign, where none is given [rad/s]


class FrictionTerms(NamedTuple):
    """Terms of the largest friction of a rotor beside Coulomb's, see `multibody.motors.friction`.

    Attributes:
        stribeck: Friction that is there at rest and gone at speed [N m].
        speed, exponent: Of its decay exp(-(|speed| / speed)^exponent) [rad/s], [-].
        motor_load, joint_load: Friction by the torques on the motor's and on the joint's side of the gear [-].
        stribeck_motor_load, stribeck_joint_load: The same, gone at speed [-].
        motor_quadratic, joint_quadratic: Friction by the square of the smaller of both torques, while the motor drives
            or is driven against its torque, gone at speed [1/(N m)].
    """

    stribeck: float = 0.0
    speed: float = 1.0
    exponent: float = 1.0
    motor_load: float = 0.0
    joint_load: float = 0.0
    stribeck_motor_load: float = 0.0
    stribeck_joint_load: float = 0.0
    motor_quadratic: float = 0.0
    joint_quadratic: float = 0.0


@dataclass(frozen=True)
class Coulomb:
    """Friction of one size at all speeds and loads, `Rotor.friction` (M1 of Duclusaud et al., Extended Friction Models
    for the Physics Simulation of Servo Actuators, arXiv 2410.08650; the other laws are their M2 to M6)."""

    name: ClassVar[str] = "coulomb"

    def terms(self) -> FrictionTerms:
        """The terms beside Coulomb's."""
        return FrictionTerms()

    @property
    def share(self) -> float:
        """Friction at rest by the mean of the torques on both sides of the gear [-]."""
        own = self.terms()
        return 0.5 * (own.motor_load + own.joint_load + own.stribeck_motor_load + own.stribeck_joint_load)

    def with_share(self, share: float) -> Coulomb:
        """The law with another share, all of it in proportion; itself where it has none."""
        factor = share / self.share if self.share else 1.0
        loads = [item.name for item in fields(self) if item.name.endswith("load")]
        return replace(self, **{name: factor * getattr(self, name) for name in loads})


@dataclass(frozen=True)
class Stribeck(Coulomb):
    """Friction that is larger at rest than at speed (M2); attributes as of `FrictionTerms`."""

    name: ClassVar[str] = "stribeck"
    stribeck: float = 0.0
    stribeck_speed: float = 0.2
    stribeck_exponent: float = 1.0

    def terms(self) -> FrictionTerms:
        """The terms beside Coulomb's."""
        return FrictionTerms(self.stribeck, self.stribeck_speed, self.stribeck_exponent)


@dataclass(frozen=True)
class Load(Coulomb):
    """Friction that grows with the torques on both sides of the gear by the same share (M3)."""

    name: ClassVar[str] = "load"
    load: float = 0.0

    def terms(self) -> FrictionTerms:
        """The terms beside Coulomb's."""
        return FrictionTerms(motor_load=self.load, joint_load=self.load)


@dataclass(frozen=True)
class StribeckLoad(Stribeck):
    """Both (M4)."""

    name: ClassVar[str] = "stribeckLoad"
    load: float = 0.0
    stribeck_load: float = 0.0

    def terms(self) -> FrictionTerms:
        """The terms beside Coulomb's."""
        return super().terms()._replace(
            motor_load=self.load, joint_load=self.load, stribeck_motor_load=self.stribeck_load,
            stribeck_joint_load=self.stribeck_load,
        )  # fmt: skip


@dataclass(frozen=True)
class Directional(Stribeck):
    """As M4, with a share for each side: a gear loses otherwise where the motor drives than where it is driven (M5)."""

    name: ClassVar[str] = "directional"
    motor_load: float = 0.0
    joint_load: float = 0.0
    stribeck_motor_load: float = 0.0
    stribeck_joint_load: float = 0.0

    def terms(self) -> FrictionTerms:
        """The terms beside Coulomb's."""
        return super().terms()._replace(
            motor_load=self.motor_load, joint_load=self.joint_load, stribeck_motor_load=self.stribeck_motor_load,
            stribeck_joint_load=self.stribeck_joint_load,
        )  # fmt: skip


@dataclass(frozen=True)
class Quadratic(Directional):
    """As M5, and by the square of the torque (M6)."""

    name: ClassVar[str] = "quadratic"
    motor_quadratic: float = 0.0
    joint_quadratic: float = 0.0

    def terms(self) -> FrictionTerms:
        """The terms beside Coulomb's."""
        return super().terms()._replace(motor_quadratic=self.motor_quadratic, joint_quadratic=self.joint_quadratic)


FRICTION_LAWS: tuple[type[Coulomb], ...] = (Coulomb, Stribeck, Load, StribeckLoad, Directional, Quadratic)


@dataclass(frozen=True)
class DirectCurrent:
    """A motor that is fed with a voltage: its controller sets the duty cycle in proportion to the error.

        torque = torque_constant / resistance (voltage clip(duty_gain error) - torque_constant speed)

    Attributes:
        voltage, resistance: Of the supply [V] and of the winding [ohm].
        torque_constant: Seen at the joint [N m/A].
        duty_gain: Duty cycle by the error [1/rad].
        max_duty: Largest duty cycle.
    """

    voltage: float
    resistance: float
    torque_constant: float
    duty_gain: float
    max_duty: float = 1.0

    @property
    def position_gain(self) -> float:
        """[N m/rad]."""
        return self.torque_constant / self.resistance * self.voltage * self.duty_gain

    @property
    def largest_torque(self) -> float:
        """At rest [N m]."""
        return self.torque_constant / self.resistance * self.voltage * self.max_duty

    @property
    def back_emf(self) -> float:
        """Torque that the induced voltage takes [N m s/rad]."""
        return self.torque_constant**2 / self.resistance


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
        law: What else friction depends on.
        back_emf: Torque that the voltage which the rotor induces takes from a motor fed with a voltage, whatever its
            controller wants [N m s/rad].
    """

    armature: float = 0.0
    gear_stiffness: float = np.inf
    gear_damping: float = 0.0
    viscous_friction: float = 0.0
    friction: float = 0.0
    friction_speed: float = FRICTION_SPEED
    no_load_speed: float = np.inf
    knee: float = 0.0
    law: Coulomb = Coulomb()
    back_emf: float = 0.0


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


class TurnsWith(NamedTuple):
    """A motor that another joint turns too, through its gearing, as in the wrists of many arms: seen at its own joint,
    its rotor turns by joint + ratio * other joint, and it pulls at the other joint by ratio times its own effort.

    Attributes:
        other: Index of that joint's motor.
        ratio: [-].
    """

    other: int
    ratio: float


def rotor_angles(motors: Sequence[Motor], joint_values: Array) -> Array:
    """How far the rotors of motors with rigid gears have turned, seen at their joints, shape [..., M], where the joints
    stand at values of shape [..., M] [rad or m]."""
    found = joint_values.copy()
    for k, motor in enumerate(motors):
        if motor.turns_with is not None:
            found[..., k] += motor.turns_with.ratio * joint_values[..., motor.turns_with.other]
    return found


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
        powered: When a SERVO is on, as it is at the first frame; off, it exerts no torque. None: always.
        turns_with: The other joint that turns it; None: its own alone.
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
    powered: Schedule | None = None
    turns_with: TurnsWith | None = None

    def with_gain(self, position_gain: float) -> Motor:
        """The motor with another position gain; where it is fed with a voltage, with a winding that makes it so: the
        duty cycle keeps its gain, and the largest torque and the back-EMF change in proportion."""
        if not (self.rotor.back_emf > 0.0 and self.position_gain > 0.0):
            return replace(self, position_gain=position_gain)
        factor = position_gain / self.position_gain
        rotor = replace(self.rotor, back_emf=factor * self.rotor.back_emf)
        return replace(self, position_gain=position_gain, max_torque=factor * self.max_torque, rotor=rotor)

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
