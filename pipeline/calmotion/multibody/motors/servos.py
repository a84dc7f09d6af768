"""Motors of servos: a rotor that a controller turns towards the command, with friction and limits; compiled.

The rotor's angle phi, seen at the joint, is an elastic coordinate of the component on the joint's side 1
(`drives`), whose inertia, viscous friction and gear are entries of the system. Its row also has

    tau_f tanh(phi' / w_f) - tau_m,     tau_m = sat(k_p (theta_c - phi) + k_d (r theta_c' - phi'), phi')

where r is 1, or 0 for a velocity gain on the joint's own speed. `friction` has other laws of friction than this
Coulomb's, and where a motor is fed with a voltage, the torque by the voltage that it induces is taken from tau_m.
sat keeps the torque, e, between limits that depend on the speed: the largest torque T up to a share (the knee) of the
no-load speed w_0, from there falling linearly to zero at w_0; against the motion it is T. All of it is smooth: with
s(x) = x / (1 + x^16)^(1/16), which is x to 1e-6 up to x = 0.5 and never exceeds one,

    upper = T s((1 - phi'/w_0) / (1 - knee)),   lower = -T s((1 + phi'/w_0) / (1 - knee))
    tau_m = middle + half s((e - middle) / half),   middle, half = (upper + lower) / 2, (upper - lower) / 2
"""

import math

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.model.system import (
    BACK_EMF,
    BEYOND_COULOMB,
    FRICTION,
    FRICTION_SPEED,
    INVERSE_SPEED,
    KNEE,
    LARGEST_EFFORT,
    POSITION_GAIN,
    RATE_SHARE,
    VELOCITY_GAIN,
    Blocks,
    State,
    System,
)
from calmotion.multibody.motors.friction import gear_friction
from calmotion.support.compilation import kernel, shared_kernel

_LEAST = 1e-6  # distance of the limits, of the largest torque


@kernel
def _limited(x: float) -> tuple[float, float]:
    """s(x) and its derivative."""
    if abs(x) > 100.0:
        return (1.0, 0.0) if x > 0.0 else (-1.0, 0.0)
    square = x * x
    fourth = square * square
    eighth = fourth * fourth
    power = 1.0 + eighth * eighth
    root = power ** (-1.0 / 16.0)
    return x * root, root / power


def unsaturated(share: Array) -> Array:
    """The x with s(x) = share, for shares of the largest torque within -1 and 1."""
    return np.asarray(share * (1.0 - share**16) ** (-1.0 / 16.0))


@shared_kernel
def motor_effort(motor: Array, wanted: float, speed: float) -> tuple[float, float, float]:
    """tau_m for the torque that the controller wants, and its derivatives by that and by the rotor's speed.

    Args:
        motor: Row of `System.servo`.
    """
    largest, inverse = motor[LARGEST_EFFORT], motor[INVERSE_SPEED]
    if not largest < math.inf:
        return wanted, 1.0, 0.0
    upper, lower, d_upper, d_lower = largest, -largest, 0.0, 0.0
    if inverse > 0.0:
        falling = 1.0 / (1.0 - motor[KNEE])
        share, slope = _limited((1.0 - speed * inverse) * falling)
        upper, d_upper = largest * share, -largest * slope * inverse * falling
        share, slope = _limited((1.0 + speed * inverse) * falling)
        lower, d_lower = -largest * share, -largest * slope * inverse * falling
    middle, half = 0.5 * (upper + lower), 0.5 * (upper - lower)
    d_middle, d_half = 0.5 * (d_upper + d_lower), 0.5 * (d_upper - d_lower)
    half = max(half, _LEAST * largest)  # both limits are the same far beyond the no-load speed
    x = (wanted - middle) / half
    share, slope = _limited(x)
    return middle + half * share, slope, d_middle + d_half * share - slope * (d_middle + x * d_half)


@kernel
def rotor_effort(system: System, joint: int, angle: float, rate: float, state: State) -> float:
    """tau_m of a servo at a state and a command."""
    b, k = system.side[joint, 1], system.rotor[joint]
    motor, speed = system.servo[joint], state.V[b, 6 + k]
    too_slow = motor[RATE_SHARE] * rate - speed
    wanted = motor[POSITION_GAIN] * (angle - state.u[b, k]) + motor[VELOCITY_GAIN] * too_slow
    induced: float = motor[BACK_EMF] * speed
    return motor_effort(motor, wanted, speed)[0] - induced


@shared_kernel
def servo_rows(
    system: System, joint: int, angle: float, rate: float, gamma: float, state: State, Vd: Array, tangent: bool,
    blocks: Blocks,
) -> None:  # fmt: skip
    """Adds the motor's torque and the friction to the row of the rotor, and their derivatives to K, P, D and on_rotor.

    Args:
        gamma: 1, or 0 where the system rests: nothing then depends on velocities.
        Vd: Accelerations, shape [B, N].
    """
    b, k = system.side[joint, 1], system.rotor[joint]
    motor, a = system.servo[joint], 6 + k
    stiffness, damping = motor[POSITION_GAIN], gamma * motor[VELOCITY_GAIN]
    speed = gamma * state.V[b, a]
    wanted = stiffness * (angle - state.u[b, k]) + damping * (motor[RATE_SHARE] * rate - speed)
    effort, by_wanted, by_speed = motor_effort(motor, wanted, speed)
    effort -= motor[BACK_EMF] * speed
    by_speed -= motor[BACK_EMF]
    drag, by_effort, drag_by_speed = 0.0, 0.0, 0.0
    if motor[BEYOND_COULOMB] > 0.0:
        viscous, inertia = system.damping[b, k, k], system.inertia[b, k]
        left = effort - inertia * Vd[b, a] - viscous * speed
        drag, by_effort, by_left, drag_by_speed = gear_friction(motor, effort, left, speed)
        by_effort += by_left
        drag_by_speed -= by_left * viscous
        if tangent:
            blocks.D[b, a, a] -= by_left * inertia
    elif motor[FRICTION] > 0.0:
        share = math.tanh(speed / motor[FRICTION_SPEED])
        drag = motor[FRICTION] * share
        drag_by_speed = motor[FRICTION] / motor[FRICTION_SPEED] * (1.0 - share * share)
    blocks.res[b, a] += drag - effort
    if not tangent:
        return
    by_wanted *= 1.0 - by_effort
    blocks.K[b, a, a] += by_wanted * stiffness
    blocks.P[b, a, a] += by_wanted * damping - (1.0 - by_effort) * by_speed + drag_by_speed
    blocks.on_rotor[joint, 0] = -by_wanted * stiffness
    blocks.on_rotor[joint, 1] = -by_wanted * damping * motor[RATE_SHARE]
