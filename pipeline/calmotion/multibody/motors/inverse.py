"""Commands under which compliant motors would do exactly what ideal ones do, from the efforts that this takes.

They are exact on rigid links, but for damping in gears, and limits that a torque would exceed.
"""

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.model.motor import ON_JOINT, PRESCRIBED, SERVO, Coulomb, Motor, Rotor, rotor_angles
from calmotion.multibody.model.system import FRICTION, FRICTION_TERMS, SERVO_COLUMNS
from calmotion.multibody.motors.friction import largest_friction

_TURNS = 20
_TORQUE_SHARE = 0.95  # of its largest torque, that a command asks of a motor at most


def inverse_commands(motors: Sequence[Motor], times: Array, values: Array, efforts: Array) -> Array:
    """Commands of motors from what their joints should do.

    Args:
        motors: Ideal ones are commanded what they do.
        times: Equidistant [s], shape [T].
        values: Of their joints [rad or m], shape [T, M].
        efforts: Of ideal motors that move the joints so [N m or N], shape [T, M].

    Returns:
        Shape [T, M].
    """
    commands, turned = values.copy(), rotor_angles(motors, values)
    for k, motor in enumerate(motors):
        if motor.model != PRESCRIBED and motor.position_gain > 0.0:
            commands[:, k] = _command(motor, times, turned[:, k], efforts[:, k])
    for k, motor in enumerate(motors):
        if motor.turns_with is not None and motor.model != PRESCRIBED:
            commands[:, k] -= motor.turns_with.ratio * commands[:, motor.turns_with.other]
    return commands


def rotor_efforts(own: Rotor, times: Array, turned: Array, efforts: Array) -> Array:
    """What a motor exerts on its rotor [N m or N], shape [T]: what the joint takes, and what turns and rubs the rotor.

    Args:
        own: The rotor; its back-EMF is none of these.
        times: Equidistant [s], shape [T].
        turned: Angle of the rotor [rad or m], shape [T].
        efforts: That move the joint so [N m or N], shape [T].
    """
    h = float(times[1] - times[0])
    speed = np.gradient(turned, h)
    found = efforts + own.armature * np.gradient(speed, h) + own.viscous_friction * speed
    return np.asarray(found + _friction(own, efforts, found, speed))


def _command(motor: Motor, times: Array, value: Array, effort: Array) -> Array:
    own, h = motor.rotor if motor.model == SERVO else Rotor(), float(times[1] - times[0])
    turned = value + effort / own.gear_stiffness
    speed = np.gradient(turned, h)
    wanted = rotor_efforts(own, times, turned, effort) + own.back_emf * speed
    if motor.model == SERVO:
        wanted = np.clip(wanted, -_TORQUE_SHARE * motor.max_torque, _TORQUE_SHARE * motor.max_torque)
    lag = motor.velocity_gain / motor.position_gain
    ahead = wanted / motor.position_gain
    ahead = ahead + lag * speed if motor.damping_on == ON_JOINT else _relaxed(ahead, h / max(lag, 1e-9 * h))
    return np.asarray(np.interp(times + motor.delay, times, turned + ahead))


def _friction(own: Rotor, effort: Array, left: Array, speed: Array) -> Array:
    """Friction of a rotor that passes an effort on.

    Args:
        left: What the motor exerts besides friction, shape [T].
        speed: Of the rotor, shape [T].
    """
    share = np.tanh(speed / own.friction_speed)
    found = own.friction * share
    if own.law == Coulomb():
        return np.asarray(found)
    row = np.zeros(SERVO_COLUMNS)
    row[FRICTION], row[FRICTION_TERMS:] = own.friction, own.law.terms()
    for _ in range(_TURNS):  # it is less than the torque of the motor that it depends on
        sizes = [largest_friction(row, m, t, w)[0] for m, t, w in zip(left + found, effort, speed, strict=True)]
        found = share * np.array(sizes)
    return np.asarray(found)


def _relaxed(wanted: Array, ratio: float) -> Array:
    """The solution x of x + x' / ratio = wanted, times in steps, that begins at rest."""
    found = wanted.copy()
    for n in range(1, len(wanted)):
        found[n] = (found[n - 1] + ratio * wanted[n]) / (1.0 + ratio)
    return found
