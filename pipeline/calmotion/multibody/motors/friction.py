"""Friction of a servo's rotor beyond Coulomb's: by the speed, and by the torques on both sides of its gear; compiled.

With the motor's torque m, the torque t that the gear passes on to the joint, and the rotor's speed w, the friction is

    f = tanh(w / w_f) F,
    F = f_0 + s f_s + |k_m m + k_t t| + s |k_ms m + k_ts t| + s g (p q_t t^2 + (1 - p) q_m m^2),   s = exp(-(|w|/w_s)^a)

g is 1 where m and t have the same sign, p 1 where |t| < |m|: the motor drives. These are the laws M1 to M6 of M.
Duclusaud et al., Extended Friction Models for the Physics Simulation of Servo Actuators, arXiv 2410.08650, with the
torque that the gear really carries, which includes what accelerates the links; theirs has gravity alone. Signs and
sizes change smoothly, over a tenth of f_0 + f_s.

As t = y - f, with y = m less what accelerates and brakes the rotor, f is the solution of one equation for each servo;
it is unique while k_t + k_ts < 1.
"""

import math

from calmotion.arrays import Array
from calmotion.multibody.model.system import FRICTION, FRICTION_SPEED, FRICTION_TERMS
from calmotion.support.compilation import kernel, shared_kernel

_SOFT = 0.1  # torque within which signs and sizes change, over the friction without load
_SIDE = 0.1  # relative difference of the squares of both torques within which the larger one changes
_TURNS = 40  # of the solution for the friction


@kernel
def _size(x: float, soft: float) -> tuple[float, float]:
    """A smooth |x| and its derivative."""
    root = math.sqrt(x * x + soft * soft)
    if root == 0.0:
        return 0.0, 0.0
    return root - soft, x / root


@kernel
def _decay(speed: float, scale: float, exponent: float) -> tuple[float, float]:
    """exp(-(|speed| / scale)^exponent) and its derivative by the speed."""
    x = abs(speed) / scale
    if x == 0.0:
        return 1.0, 0.0
    power = x**exponent
    share = math.exp(-power)
    return share, -share * exponent * power / speed


@kernel
def _quadratic(by_motor: float, by_joint: float, m: float, t: float, soft: float) -> tuple[float, float, float]:
    """The quadratic term and its derivatives by m and t."""
    a, b = m * m, t * t
    width = _SIDE * (a + b) + soft * soft
    if width == 0.0:
        return 0.0, 0.0, 0.0
    drives = math.tanh((a - b) / width)
    p, slope = 0.5 * (1.0 + drives), 0.5 * (1.0 - drives * drives) / (width * width)
    p_a = slope * (width - _SIDE * (a - b))
    p_b = slope * (-width - _SIDE * (a - b))
    value = p * by_joint * b + (1.0 - p) * by_motor * a
    more = by_joint * b - by_motor * a
    value_a = p_a * more + (1.0 - p) * by_motor
    value_b = p_b * more + p * by_joint
    product, least = m * t, soft**4
    root = math.sqrt(product * product + least)
    same, by_product = (0.0, 0.0) if root == 0.0 else (product / root, least / root**3)
    gate, d_gate = 0.5 * (1.0 + same), 0.5 * by_product
    return gate * value, 2.0 * gate * value_a * m + d_gate * t * value, 2.0 * gate * value_b * t + d_gate * m * value


@shared_kernel
def largest_friction(motor: Array, m: float, t: float, speed: float) -> tuple[float, float, float, float]:
    """F and its derivatives by m, t and the speed.

    Args:
        motor: Row of `System.servo`.
        m, t: Torques of the motor and of the gear on the joint [N m].
        speed: Of the rotor [rad/s].
    """
    terms = motor[FRICTION_TERMS:]
    fs, scale, exponent = terms[0], terms[1], terms[2]
    km, kt, kms, kts, qm, qt = terms[3], terms[4], terms[5], terms[6], terms[7], terms[8]
    soft = _SOFT * (motor[FRICTION] + fs)
    share, d_share = _decay(speed, scale, exponent)
    load, d_load = _size(km * m + kt * t, soft)
    fading, d_fading = _size(kms * m + kts * t, soft)
    square, square_m, square_t = 0.0, 0.0, 0.0
    if qm > 0.0 or qt > 0.0:
        square, square_m, square_t = _quadratic(qm, qt, m, t, soft)
    gone = fs + fading + square
    return (
        motor[FRICTION] + load + share * gone,
        km * d_load + share * (kms * d_fading + square_m),
        kt * d_load + share * (kts * d_fading + square_t),
        d_share * gone,
    )


@shared_kernel
def gear_friction(motor: Array, m: float, y: float, speed: float) -> tuple[float, float, float, float]:
    """The friction f and its derivatives by m, by y with m kept, and by the speed with both kept.

    Args:
        motor: Row of `System.servo`.
        m: Torque of the motor [N m].
        y: The same, less what accelerates the rotor and its viscous friction [N m].
        speed: Of the rotor [rad/s].
    """
    width = motor[FRICTION_SPEED]
    side = math.tanh(speed / width)
    largest, by_m, by_t, by_speed = largest_friction(motor, m, y, speed)
    f = side * largest
    for _ in range(_TURNS):
        largest, by_m, by_t, by_speed = largest_friction(motor, m, y - f, speed)
        change = (side * largest - f) / max(1.0 + side * by_t, 0.1)
        f += change
        if abs(change) <= 1e-14 * (abs(f) + abs(y)):
            break
    whole = 1.0 / (1.0 + side * by_t)
    turned = (1.0 - side * side) / width * largest
    return f, whole * side * by_m, whole * side * by_t, whole * (turned + side * by_speed)
