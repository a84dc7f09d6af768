"""The equations of motion of one joint, with and without play, and of oscillators along a motion, step by step."""

import numpy as np
from calmotion.arrays import Array
from numba import njit


@njit(cache=True)  # type: ignore[untyped-decorator]
def follow(
    h: float, command: Array, rate: Array, inertia: Array, load: Array, slope: Array, near: Array, gains: Array,
    out: Array,
) -> None:  # fmt: skip
    """A joint that a spring and a damper pull to its command, with dry friction; by the implicit midpoint rule.

        inertia y'' = gain (command - y) + damping (share rate - y') - load - slope (y - near) - friction

    Args:
        h: Step [s].
        command, rate: Delayed command and its rate, shape [T].
        inertia, load, slope: Of the joint, the load without the inertia's share where the joint is near, shape [T].
        near: There, shape [T].
        gains: Gain, damping, share of the command's rate, friction, excess of friction at rest, and the speed over
            which that is gone.
        out: Position, speed and acceleration, shape [3, T].
    """
    kp, kd, share, dry, excess, fast = gains[0], gains[1], gains[2], gains[3], gains[4], gains[5]
    # at rest: where it was, as far as friction holds it there
    rest = (kp * command[0] - load[0] + slope[0] * near[0]) / (kp + slope[0])
    held = dry * (1.0 + excess) / (kp + slope[0])
    y = min(max(near[0], rest - held), rest + held)
    v = 0.0
    out[0, 0], out[1, 0], out[2, 0] = y, v, 0.0
    for n in range(len(command) - 1):
        at = 0.5 * (command[n] + command[n + 1])
        J = 0.5 * (inertia[n] + inertia[n + 1])
        g = slope[n]
        force = kp * (at - y) + kd * share * 0.5 * (rate[n] + rate[n + 1]) - 0.5 * (load[n] + load[n + 1])
        force += 2.0 * J * v / h - g * (y - 0.5 * (near[n] + near[n + 1]))
        friction = dry * (1.0 + excess * np.exp(-abs(v) / fast))
        if abs(force) <= friction:
            new = 0.0
            middle = 0.0
        else:
            middle = (force - np.copysign(friction, force)) / (2.0 * J / h + 0.5 * h * (kp + g) + kd)
            new = 2.0 * middle - v
            if dry > 0.0 and new * middle < 0.0:
                new = 0.0
                middle = 0.5 * v
        y += h * middle
        out[2, n + 1] = (new - v) / h
        v = new
        out[0, n + 1], out[1, n + 1] = y, v


@njit(cache=True)  # type: ignore[untyped-decorator]
def follow_with_play(
    h: float, command: Array, rate: Array, inertia: Array, load: Array, gains: Array, width: float, out: Array
) -> None:
    """A joint as in `follow`, with play between its motor, whose rotor has no inertia, and its load.

    The load lies against one side of the play as long as the motor presses it there; between both sides the motor goes
    to its command, and the load moves freely.

    Args:
        h, command, rate, inertia, load, gains: As of `follow`, with the first three gains.
        width: From one side to the other [rad].
        out: Value, speed and acceleration of the load, and value of the motor, shape [4, T].
    """
    kp, kd, share, half = gains[0], gains[1], gains[2], 0.5 * width
    side = -1 if load[0] > 0.0 else 1
    motor, v = command[0] - load[0] / kp, 0.0
    y = motor + side * half
    out[0, 0], out[1, 0], out[2, 0], out[3, 0] = y, 0.0, 0.0, motor
    for n in range(len(command) - 1):
        at, speed = 0.5 * (command[n] + command[n + 1]), share * 0.5 * (rate[n] + rate[n + 1])
        J, pull = 0.5 * (inertia[n] + inertia[n + 1]), 0.5 * (load[n] + load[n + 1])
        if side != 0:
            force = kp * (at + side * half - y) + kd * speed - pull + 2.0 * J * v / h
            middle = force / (2.0 * J / h + 0.5 * h * kp + kd)
            torque = kp * (at + side * half - y - 0.5 * h * middle) + kd * (speed - middle)
            if side * torque > 0.0:
                side = 0
        if side == 0:
            middle = v - 0.5 * h * pull / J
            motor = (motor + h / kd * (kp * at + kd * speed)) / (1.0 + h * kp / kd)
        new = 2.0 * middle - v
        y += h * middle
        if side == 0 and abs(y - motor) >= half:
            side = 1 if y > motor else -1
        if side != 0:
            motor = y - side * half
        out[2, n + 1] = (new - v) / h
        v = new
        out[0, n + 1], out[1, n + 1], out[3, n + 1] = y, v, motor


@njit(cache=True)  # type: ignore[untyped-decorator]
def oscillate(h: float, omega: Array, damping: float, force: Array, out: Array) -> None:
    """Oscillators whose frequencies change in time, from rest; by the implicit midpoint rule.

    Args:
        h: Step [s].
        omega: [rad/s], shape [T, n].
        damping: Ratio of critical.
        force: Accelerations, shape [T, n].
        out: Amplitude, speed and acceleration, shape [3, T, n].
    """
    for k in range(omega.shape[1]):
        a, v = 0.0, 0.0
        for n in range(omega.shape[0] - 1):
            w = 0.5 * (omega[n, k] + omega[n + 1, k])
            # the midpoint rule lowers a frequency to 2/h atan(w h/2): raise it beforehand
            w = 2.0 / h * np.tan(min(0.5 * w * h, 1.4))
            f = 0.5 * (force[n, k] + force[n + 1, k])
            middle = (2.0 * v / h + f - w * w * a) / (2.0 / h + 0.5 * h * w * w + 2.0 * damping * w)
            new = 2.0 * middle - v
            a += h * middle
            out[2, n + 1, k] = (new - v) / h
            v = new
            out[0, n + 1, k], out[1, n + 1, k] = a, v


@njit(cache=True)  # type: ignore[untyped-decorator]
def late(h: float, command: Array, start: float, length: float, out: Array) -> None:
    """The command with one value held from a time on for a while, shape [T, M]."""
    first = int(start / h)
    last = min(int((start + length) / h), command.shape[0] - 1)
    for n in range(command.shape[0]):
        for k in range(command.shape[1]):
            out[n, k] = command[first, k] if first <= n < last else command[n, k]


@njit(cache=True)  # type: ignore[untyped-decorator]
def march(h: float, place: Array, mass: Array, damping: Array, stiffness: Array, force: Array, out: Array) -> None:
    """A linear system whose matrices change from pose to pose, from rest in a place; by the implicit midpoint rule.

        mass y'' + (damping + mass' / 2) y' + stiffness y = force

    Args:
        h: Step [s].
        place: Between which poses the robot is, shape [T].
        mass, damping, stiffness: In the poses, shape [P, n, n].
        force: Shape [T, n].
        out: y, y' and y'', shape [3, T, n]; y begins with the value that is there.
    """
    poses, n = mass.shape[0], mass.shape[1]
    M, A = np.zeros((n, n)), np.zeros((n, n))
    y, v = out[0, 0].copy(), np.zeros(n)
    before = mass[0].copy()
    for t in range(len(force) - 1):
        at = min(max(0.5 * (place[t] + place[t + 1]), 0.0), poses - 1.0)
        p = min(int(at), max(poses - 2, 0))
        q, share = min(p + 1, poses - 1), at - p
        b = 0.5 * (force[t] + force[t + 1])
        for i in range(n):
            for k in range(n):
                M[i, k] = (1.0 - share) * mass[p, i, k] + share * mass[q, i, k]
                C = (1.0 - share) * damping[p, i, k] + share * damping[q, i, k] + 0.5 * (M[i, k] - before[i, k]) / h
                K = (1.0 - share) * stiffness[p, i, k] + share * stiffness[q, i, k]
                A[i, k] = 2.0 * M[i, k] / h + C + 0.5 * h * K
                b[i] += 2.0 * M[i, k] * v[k] / h - K * y[k]
                before[i, k] = M[i, k]
        # Gaussian elimination without pivots: the matrix is positive definite
        for k in range(n):
            for i in range(k + 1, n):
                f = A[i, k] / A[k, k]
                for j in range(k, n):
                    A[i, j] -= f * A[k, j]
                b[i] -= f * b[k]
        for i in range(n - 1, -1, -1):
            for j in range(i + 1, n):
                b[i] -= A[i, j] * b[j]
            b[i] /= A[i, i]
        for i in range(n):
            new = 2.0 * b[i] - v[i]
            y[i] += h * b[i]
            out[2, t + 1, i] = (new - v[i]) / h
            v[i] = new
            out[0, t + 1, i], out[1, t + 1, i] = y[i], v[i]
