"""The rotation of an interface from its small-rotation coordinates, two ways; compiled.

LINEAR_BODY: psi is a rotation vector, R = exp(psi).

Any other: the basis contains the displacements of a patch after a finite rotation, R - E restricted to the patch,
and psi is the axial vector of its skew part: psi = sin(a) n for a rotation by a about n. Hence

    R = E + [psi]x + c [psi]x^2,      c = 1 / (1 + C),  C = cos(a) = sqrt(1 - psi.psi)
    R^T dR = [H dpsi]x,               H = E - c [psi]x + (c / C) psi psi^T

up to (not including) a rotation by 90 degrees, where it is not a number and the step fails.
"""

import math

from calmotion.arrays import Array
from calmotion.multibody.kernels.so3 import exponential, right_jacobian, right_jacobian_derivative
from calmotion.support.compilation import kernel

LINEAR_BODY = 0


@kernel
def _cosine(psi: Array) -> float:
    s = psi[0] * psi[0] + psi[1] * psi[1] + psi[2] * psi[2]
    if not (s < 1.0):
        return math.nan
    return math.sqrt(1.0 - s)


@kernel
def interface_rotation(kind: int, psi: Array, R: Array, H: Array) -> None:
    """R and H with R^T dR = [H dpsi]x, shapes [3, 3]; H of -psi is its transpose."""
    if kind == LINEAR_BODY:
        exponential(psi, R)
        right_jacobian(psi, H)
        return
    C = _cosine(psi)
    c = 1.0 / (1.0 + C)
    k = c / C
    x, y, z = psi[0], psi[1], psi[2]
    for i in range(3):
        for j in range(3):
            R[i, j] = c * psi[i] * psi[j]
            H[i, j] = k * psi[i] * psi[j]
        # c [psi]x^2 = c (psi psi^T - s E), and 1 - c s = C
        R[i, i] += C
        H[i, i] += 1.0
    R[0, 1] -= z
    R[1, 0] += z
    R[0, 2] += y
    R[2, 0] -= y
    R[1, 2] -= x
    R[2, 1] += x
    H[0, 1] += c * z
    H[1, 0] -= c * z
    H[0, 2] -= c * y
    H[2, 0] += c * y
    H[1, 2] += c * x
    H[2, 1] -= c * x


@kernel
def interface_rotation_derivative(kind: int, psi: Array, b: Array, sign: float, out: Array) -> None:
    """d/dpsi of H(sign psi) b into out, shape [3, 3]; sign +1 or -1."""
    if kind == LINEAR_BODY:
        right_jacobian_derivative(psi, b, sign, out)
        return
    C = _cosine(psi)
    c = 1.0 / (1.0 + C)
    k = c / C
    # derivatives by psi.psi
    dc = 0.5 * c * c / C
    dk = dc / C + 0.5 * k / (C * C)
    dot = psi[0] * b[0] + psi[1] * b[1] + psi[2] * b[2]
    for i in range(3):
        j, l = (i + 1) % 3, (i + 2) % 3
        # H(sign psi) b = b - sign c psi x b + k psi (psi . b)
        g = 2.0 * (dk * dot * psi[i] - sign * dc * (psi[j] * b[l] - psi[l] * b[j]))
        for m in range(3):
            out[i, m] = g * psi[m] + k * psi[i] * b[m]
        out[i, i] += k * dot
        out[i, l] += sign * c * b[j]
        out[i, j] -= sign * c * b[l]
