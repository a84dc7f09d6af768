"""Compliant motors: a drive is one elastic coordinate of the body that it moves, a servo with a gear two.

The marker by which a component hangs on a driven joint is turned about the joint's axis by coordinates of the
component's own (moved along it, on a slider), and the motor's constraint holds this marker.

Drive: psi without inertia, on a spring k_p and a damper k_d; the marker is held at the command, theta + psi = theta_c.
The multiplier of the motor's row is then the force of the drive,

    tau = k_p psi + k_d psi' = k_p (theta_c - theta) + k_d (theta_c' - theta')

so that elimination, statics, tangent and adjoint know no drives, efforts and their limits act on tau, and psi counts
turns. The limit k_p -> infinity is the ideal motor. A drive whose damper acts on the joint's own speed, -k_d theta', is
a servo with a rigid gear and a rotor without inertia, friction and limits.

Servo: the rotor's angle phi with its inertia (the armature) and viscous friction, and the deflection psi of the gear
without inertia, on the gear's spring and damper; the marker is held at zero, theta - phi + psi = 0. The multiplier is
the torque of the gear, and the command acts on the row of phi (`servos`). Without psi the gear is rigid.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.model.motor import ON_ERROR, PRESCRIBED, SERVO, Coulomb, Motor, Rotor
from calmotion.multibody.model.system import LINEAR, System
from calmotion.multibody.motors.couplings import Coupling


class GivingMotor(NamedTuple):
    """A compliant motor, and the number of its joint in the system."""

    joint: int
    motor: Motor


class _Coordinate(NamedTuple):
    """An elastic coordinate: its inertia, stiffness, damping, and how far it turns the marker."""

    inertia: float
    stiffness: float
    damping: float
    turn: float


def giving_motors(system: System, motor: IntArray, motors: Sequence[Motor]) -> list[GivingMotor]:
    """The motors that are not ideal.

    Args:
        motor: Motor that drives each joint, -1 for none, shape [J].

    Raises:
        ShotError: One that closes a chain, on a body of large deflection: its turn has no place there.
    """
    found = []
    for joint, k in enumerate(motor):
        if k < 0 or motors[k].model == PRESCRIBED:
            continue
        item = motors[k]
        if joint >= len(system.parent) and system.law[system.side[joint, 1]] != LINEAR:
            raise ShotError(
                "a compliant motor that closes a chain cannot hang on a body of large deflection",
                path=item.path,
                attribute="calm:motor:model",
                found=item.model,
                remedy="Set calm:flexible:elasticity of the body to linear, the model to prescribed, or let another "
                "joint close the chain (physics:excludeFromArticulation)",
            )
        found.append(GivingMotor(joint, item))
    return found


def add_motors(system: System, motors: Sequence[GivingMotor], coupled: Sequence[Coupling] = ()) -> System:
    """The system with the coordinates of these motors, behind the modes of the components on side 1 of their joints.

    Args:
        coupled: Joints whose motors other joints turn too.
    """
    elastic = system.elastic.copy()
    placed: list[tuple[int, int, _Coordinate]] = []
    rotor, servo = system.rotor.copy(), system.servo.copy()
    for joint, motor in motors:
        b = system.side[joint, 1]
        own = _rotor(motor)
        if own is not None:
            rotor[joint], servo[joint] = elastic[b], _controller(motor, own)
        for coordinate in _coordinates(motor):
            placed.append((joint, int(elastic[b]), coordinate))
            elastic[b] += 1
    more = max(0, int(elastic.max()) - (system.size - 6))

    def wider(array: Array, *axes: int) -> Array:
        return np.pad(array, [(0, more if axis in axes else 0) for axis in range(array.ndim)])

    wide = system._replace(
        elastic=elastic, inertia=wider(system.inertia, 1), stiffness=wider(system.stiffness, 1),
        damping=wider(system.damping, 1, 2), M3=wider(system.M3, 1), M4=wider(system.M4, 1), S=wider(system.S, 1, 2),
        axial=wider(system.axial, 1, 2), axial0=wider(system.axial0, 1), Phi=wider(system.Phi, 3),
        Psi=wider(system.Psi, 3), servos=np.flatnonzero(rotor >= 0).astype(np.int32), rotor=rotor, servo=servo,
        unit=np.pad(system.unit, [(0, 0), (0, more)], constant_values=1.0),
    )  # fmt: skip
    for joint, k, item in placed:
        b = system.side[joint, 1]
        wide.unit[b, 6 + k] = system.unit[b, 0] if system.sliding[joint] else 1.0
        wide.inertia[b, k], wide.stiffness[b, k], wide.damping[b, k, k] = item.inertia, item.stiffness, item.damping
        moved = wide.Phi if system.sliding[joint] else wide.Psi
        moved[joint, 1, :, k] = item.turn * system.rotation[joint, 1, :, 2]
        for pair in coupled:
            if pair.compliant and pair.other == joint:
                wide.Psi[pair.joint, 0, :, k] = pair.ratio * item.turn * system.rotation[pair.joint, 0, :, 2]
    return wide


def joint_values(system: System, motor: IntArray, motors: Sequence[Motor], u: Array, joint_angles: Array) -> Array:
    """Where the joints stand, which is not what their motors follow where these give.

    Args:
        system: With the coordinates of its motors.
        motor: Motor that drives each joint, -1 for none, shape [J].
        u: Elastic coordinates of the components, shape [T, B, R].
        joint_angles: What the joints' motors follow, shape [T, J].

    Returns:
        What their motors follow but for their gears and springs, shape [T, J]; of other joints `joint_angles`.
    """
    values, placed = joint_angles.copy(), system.modes.copy()
    for joint, item in giving_motors(system, motor, motors):
        b = system.side[joint, 1]
        own = [u[:, b, placed[b] + k] for k in range(len(_coordinates(item)))]
        placed[b] += len(own)
        if _rotor(item) is not None:
            values[:, joint] = own[0] - (own[1] if len(own) > 1 else 0.0)
        else:
            values[:, joint] -= own[0]
    return values


def _coordinates(motor: Motor) -> list[_Coordinate]:
    """Those of one motor, the rotor first."""
    own = _rotor(motor)
    if own is None:
        return [_Coordinate(0.0, motor.position_gain, motor.velocity_gain, 1.0)]
    found = [_Coordinate(own.armature, 0.0, own.viscous_friction, -1.0)]
    if math.isfinite(own.gear_stiffness):
        found.append(_Coordinate(0.0, own.gear_stiffness, own.gear_damping, 1.0))
    return found


def _rotor(motor: Motor) -> Rotor | None:
    """What the motor's controller turns; None for a drive whose damper acts on the difference from the command."""
    if motor.model == SERVO:
        return motor.rotor
    return None if motor.damping_on == ON_ERROR else Rotor()


def _controller(motor: Motor, own: Rotor) -> list[float]:
    """Row of `System.servo`; the effort of a drive has no limit of its own."""
    return [
        motor.position_gain, motor.velocity_gain, own.friction, own.friction_speed,
        motor.max_torque if motor.model == SERVO else math.inf, 1.0 / own.no_load_speed, own.knee,
        float(motor.damping_on == ON_ERROR), own.back_emf, float(own.law != Coulomb()), *own.law.terms(),
    ]  # fmt: skip
