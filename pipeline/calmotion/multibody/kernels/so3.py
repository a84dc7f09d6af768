"""Rotations: exponential, logarithm, right Jacobian and its derivative; compiled, writing into given arrays.

`right_jacobian(t)` is J_r with exp(t + dt) = exp(t) exp(J_r(t) dt) to first order. Series replace the closed forms
near zero, where those cancel. Source: Sola, Deray, Atchuthan, A micro Lie theory for state estimation (2018).
"""

import math

import numpy as np

from calmotion.arrays import Array
from calmotion.support.compilation import allocating_kernel, kernel

_SMALL = 1e-2  # below this squared angle the four-term series are exact to rounding


@kernel
def cross(a: Array, b: Array, out: Array) -> None:
    """out = a x b; `out` must not alias."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@kernel
def coefficients(angle2: float) -> tuple[float, float, float, float, float]:
    """sin(a)/a, (1 - cos a)/a^2, (a - sin a)/a^3 and the derivatives of the last two by a^2."""
    x = angle2
    if x < _SMALL:
        a0 = 1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0)))
        a1 = 0.5 * (1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0 * (1.0 - x / 90.0))))
        a2 = (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0 * (1.0 - x / 110.0)))) / 6.0
        d1 = -1.0 / 24.0 + x / 360.0 - x * x / 13440.0 + x * x * x / 907200.0
        d2 = -1.0 / 120.0 + x / 2520.0 - x * x / 120960.0 + x * x * x / 9979200.0
        return a0, a1, a2, d1, d2
    a = math.sqrt(x)
    s, c = math.sin(a), math.cos(a)
    a0 = s / a
    a1 = (1.0 - c) / x
    a2 = (a - s) / (x * a)
    d1 = (0.5 * a0 - a1) / x
    d2 = (0.5 * a1 - 1.5 * a2) / x
    return a0, a1, a2, d1, d2


@kernel
def _polynomial(t: Array, a: float, b: float, out: Array) -> None:
    """out = E + a [t]x + b [t]x^2."""
    x, y, z = t[0], t[1], t[2]
    n = x * x + y * y + z * z
    out[0, 0] = 1.0 + b * (x * x - n)
    out[1, 1] = 1.0 + b * (y * y - n)
    out[2, 2] = 1.0 + b * (z * z - n)
    out[0, 1] = b * x * y - a * z
    out[1, 0] = b * x * y + a * z
    out[0, 2] = b * x * z + a * y
    out[2, 0] = b * x * z - a * y
    out[1, 2] = b * y * z - a * x
    out[2, 1] = b * y * z + a * x


@kernel
def exponential(t: Array, out: Array) -> None:
    """Rotation matrix of the rotation vector t (shape [3], rad) into out (shape [3, 3])."""
    a0, a1, _, _, _ = coefficients(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    _polynomial(t, a0, a1, out)


@kernel
def right_jacobian(t: Array, out: Array) -> None:
    """J_r(t) into out, shape [3, 3]; J_r(-t) is its transpose, the left Jacobian."""
    _, a1, a2, _, _ = coefficients(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    _polynomial(t, -a1, a2, out)


@kernel
def inverse_right_jacobian(t: Array, out: Array) -> None:
    """J_r(t)^-1 into out, shape [3, 3], for |t| < 2 pi."""
    x = t[0] * t[0] + t[1] * t[1] + t[2] * t[2]
    a0, a1, _, _, _ = coefficients(x)
    if x < _SMALL:
        b = 1.0 / 12.0 + x / 720.0 + x * x / 30240.0 + x * x * x / 1209600.0
    else:
        b = (1.0 - 0.5 * a0 / a1) / x
    _polynomial(t, 0.5, b, out)


@kernel
def right_jacobian_derivative(t: Array, b: Array, sign: float, out: Array) -> None:
    """d/dt of J_r(sign t) b into out, shape [3, 3]; sign +1 or -1."""
    _, a1, a2, d1, d2 = coefficients(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    t0, t1, t2 = t[0], t[1], t[2]
    b0, b1, b2 = b[0], b[1], b[2]
    c0 = t1 * b2 - t2 * b1
    c1 = t2 * b0 - t0 * b2
    c2 = t0 * b1 - t1 * b0
    e0 = t1 * c2 - t2 * c1
    e1 = t2 * c0 - t0 * c2
    e2 = t0 * c1 - t1 * c0
    # J_r(s t) b = b - s a1 (t x b) + a2 t x (t x b), and t x (t x b) = t (t.b) - b |t|^2
    dot = t0 * b0 + t1 * b1 + t2 * b2
    k = -sign * a1
    # d(t x b) = -[b]x dt
    out[0, 0] = a2 * (t0 * b0 + dot - 2.0 * b0 * t0)
    out[0, 1] = a2 * (t0 * b1 - 2.0 * b0 * t1) + k * b2
    out[0, 2] = a2 * (t0 * b2 - 2.0 * b0 * t2) - k * b1
    out[1, 0] = a2 * (t1 * b0 - 2.0 * b1 * t0) - k * b2
    out[1, 1] = a2 * (t1 * b1 + dot - 2.0 * b1 * t1)
    out[1, 2] = a2 * (t1 * b2 - 2.0 * b1 * t2) + k * b0
    out[2, 0] = a2 * (t2 * b0 - 2.0 * b2 * t0) + k * b1
    out[2, 1] = a2 * (t2 * b1 - 2.0 * b2 * t1) - k * b0
    out[2, 2] = a2 * (t2 * b2 + dot - 2.0 * b2 * t2)
    p, q = -2.0 * sign * d1, 2.0 * d2
    g0 = p * c0 + q * e0
    g1 = p * c1 + q * e1
    g2 = p * c2 + q * e2
    out[0, 0] += g0 * t0
    out[0, 1] += g0 * t1
    out[0, 2] += g0 * t2
    out[1, 0] += g1 * t0
    out[1, 1] += g1 * t1
    out[1, 2] += g1 * t2
    out[2, 0] += g2 * t0
    out[2, 1] += g2 * t1
    out[2, 2] += g2 * t2


@kernel
def matrix_of(q: Array, out: Array) -> None:
    """Rotation matrix of the quaternion q (w, x, y, z), normalised, into out."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    n = 2.0 / (w * w + x * x + y * y + z * z)
    out[0, 0] = 1.0 - n * (y * y + z * z)
    out[0, 1] = n * (x * y - w * z)
    out[0, 2] = n * (x * z + w * y)
    out[1, 0] = n * (x * y + w * z)
    out[1, 1] = 1.0 - n * (x * x + z * z)
    out[1, 2] = n * (y * z - w * x)
    out[2, 0] = n * (x * z - w * y)
    out[2, 1] = n * (y * z + w * x)
    out[2, 2] = 1.0 - n * (x * x + y * y)


@kernel
def turn(q: Array, t: Array, out: Array) -> None:
    """out = q exp(t) as unit quaternions; renormalised, which changes it by rounding alone."""
    x2 = 0.25 * (t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    a0, _, _, _, _ = coefficients(x2)
    c = math.cos(math.sqrt(x2))
    x, y, z = 0.5 * a0 * t[0], 0.5 * a0 * t[1], 0.5 * a0 * t[2]
    w0 = q[0] * c - q[1] * x - q[2] * y - q[3] * z
    w1 = q[0] * x + q[1] * c + q[2] * z - q[3] * y
    w2 = q[0] * y - q[1] * z + q[2] * c + q[3] * x
    w3 = q[0] * z + q[1] * y - q[2] * x + q[3] * c
    n = 1.0 / math.sqrt(w0 * w0 + w1 * w1 + w2 * w2 + w3 * w3)
    out[0] = w0 * n
    out[1] = w1 * n
    out[2] = w2 * n
    out[3] = w3 * n


@allocating_kernel
def logarithm(R: Array, out: Array) -> None:
    """Rotation vector of the rotation matrix R, |out| <= pi, into out."""
    # through the quaternion, largest component first, which is well conditioned at every angle
    q = np.empty(4)
    quaternion_of(R, q)
    s = math.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if s < 1e-9:
        k = 2.0 / q[0]
    else:
        k = 2.0 * math.atan2(s, q[0]) / s
    for i in range(3):
        out[i] = k * q[i + 1]


@allocating_kernel
def turns_between(first: Array, last: Array, out: Array) -> None:
    """Rotation vectors from quaternions to others, in the axes of the first, shape [B, 3], into out."""
    A, B, E = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    for b in range(len(first)):
        matrix_of(first[b], A)
        matrix_of(last[b], B)
        for i in range(3):
            for j in range(3):
                E[i, j] = A[0, i] * B[0, j] + A[1, i] * B[1, j] + A[2, i] * B[2, j]
        logarithm(E, out[b])


@kernel
def quaternion_of(R: Array, out: Array) -> None:
    """Unit quaternion (w, x, y, z), w >= 0, of the rotation matrix R into out."""
    tr = R[0, 0] + R[1, 1] + R[2, 2]
    if tr > 0.0:
        s = math.sqrt(tr + 1.0) * 2.0
        out[0] = 0.25 * s
        out[1] = (R[2, 1] - R[1, 2]) / s
        out[2] = (R[0, 2] - R[2, 0]) / s
        out[3] = (R[1, 0] - R[0, 1]) / s
    else:
        i = 0
        if R[1, 1] > R[0, 0]:
            i = 1
        if R[2, 2] > R[i, i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        s = math.sqrt(max(R[i, i] - R[j, j] - R[k, k] + 1.0, 0.0)) * 2.0
        out[0] = (R[k, j] - R[j, k]) / s
        out[i + 1] = 0.25 * s
        out[j + 1] = (R[j, i] + R[i, j]) / s
        out[k + 1] = (R[k, i] + R[i, k]) / s
    if out[0] < 0.0:
        for i in range(4):
            out[i] = -out[i]
