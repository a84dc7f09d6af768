"""Elastic and viscous forces of a compressible Neo-Hookean body by cubature; compiled.

W = mu/2 (tr F^T F - 3) - mu L(J) + lame/2 L(J)^2 with L = ln J. Below J = JOIN, where a finite element is nearly flat
or turned inside out, L goes on as its second-order expansion about JOIN, so that W, P and dP/dF are continuous, finite
in every state and push back towards J = 1.

    P = mu F + g(J) cof F,                 g = (lame L - mu) L'
    dP = mu dF + g' (cof F : dF) cof F + g dcof F,   g' = lame L'^2 + (lame L - mu) L''

Kelvin-Voigt damping adds b F (C : E') with E' = sym(F^T F').
Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis; An, Kim, James, Optimizing Cubature
for Efficient Integration of Subspace Deformations, 2008.
"""

import math

from calmotion.arrays import Array
from calmotion.multibody.kernels.components import ElasticLaw
from calmotion.multibody.kernels.work import LawWork
from calmotion.support.compilation import kernel, shared_kernel

JOIN = 0.2  # volume ratio below which the logarithm is continued as a parabola; `fem.cubature` does the same


@kernel
def volumetric(J: float, lame: float, mu: float) -> tuple[float, float, float]:
    """(g, g', energy density of the terms in J) [Pa]."""
    if J >= JOIN:
        L, d1, d2 = math.log(J), 1.0 / J, -1.0 / (J * J)
    else:
        x = (J - JOIN) / JOIN
        L = math.log(JOIN) + x - 0.5 * x * x
        d1 = (1.0 - x) / JOIN
        d2 = -1.0 / (JOIN * JOIN)
    h = lame * L - mu
    return h * d1, lame * d1 * d1 + h * d2, (0.5 * lame * L - mu) * L


@kernel
def cofactor(F: Array, out: Array) -> float:
    """cof F = J F^-T of a matrix given as nine entries, row by row; returns J."""
    for i in range(3):
        a, b = 3 * ((i + 1) % 3), 3 * ((i + 2) % 3)
        for j in range(3):
            k, l = (j + 1) % 3, (j + 2) % 3
            out[3 * i + j] = F[a + k] * F[b + l] - F[a + l] * F[b + k]
    J: float = F[0] * out[0] + F[1] * out[1] + F[2] * out[2]
    return J


@kernel
def stress_tangent(F: Array, mu: float, g: float, dg: float, cof: Array, A: Array) -> None:
    """dP/dF, shape [9, 9], both indices row by row."""
    for m in range(9):
        for n in range(9):
            A[m, n] = dg * cof[m] * cof[n]
        A[m, m] += mu
    # d(cof F)_ij = eps eps F_kl dF: nonzero where both rows and both columns differ
    for i in range(3):
        for k in range(3):
            if i == k:
                continue
            o = 3 - i - k
            sign_rows = 1.0 if (k - i) % 3 == 1 else -1.0
            for j in range(3):
                for l in range(3):
                    if j == l:
                        continue
                    q = 3 - j - l
                    sign = sign_rows if (l - j) % 3 == 1 else -sign_rows
                    A[3 * i + j, 3 * k + l] += g * sign * F[3 * o + q]


@kernel
def viscous_stress(law: ElasticLaw, F: Array, Fd: Array, S: Array, P: Array) -> None:
    """P += beta F S with S = C : sym(F^T F'), which is left in S (nine entries)."""
    lame, mu, beta = law.lame[0], law.lame[1], law.retardation
    trace = 0.0
    for i in range(3):
        for j in range(3):
            t = 0.0
            for c in range(3):
                t += F[3 * c + i] * Fd[3 * c + j] + F[3 * c + j] * Fd[3 * c + i]
            S[3 * i + j] = mu * t
            if i == j:
                trace += 0.5 * t
    for i in range(3):
        S[4 * i] += lame * trace
    for i in range(3):
        for j in range(3):
            t = 0.0
            for c in range(3):
                t += F[3 * i + c] * S[3 * c + j]
            P[3 * i + j] += beta * t


@kernel
def _viscous_direction(law: ElasticLaw, F: Array, Fd: Array, S: Array, dF: Array, dFd: Array, out: Array) -> None:
    """Derivative of F S(F, F') in the direction (dF, dF'), nine entries each."""
    lame, mu = law.lame[0], law.lame[1]
    trace = 0.0
    for i in range(3):
        for j in range(3):
            t = 0.0
            for c in range(3):
                t += dF[3 * c + i] * Fd[3 * c + j] + dF[3 * c + j] * Fd[3 * c + i]
                t += F[3 * c + i] * dFd[3 * c + j] + F[3 * c + j] * dFd[3 * c + i]
            out[9 + 3 * i + j] = mu * t
            if i == j:
                trace += 0.5 * t
    for i in range(3):
        out[9 + 4 * i] += lame * trace
    for i in range(3):
        for j in range(3):
            t = 0.0
            for c in range(3):
                t += dF[3 * i + c] * S[3 * c + j] + F[3 * i + c] * out[9 + 3 * c + j]
            out[3 * i + j] = t


@kernel
def _deformation(law: ElasticLaw, u: Array, v: Array, at: int, F: Array, Fd: Array) -> None:
    """Deformation gradient and its rate, nine entries each, at the point whose modes' gradients start at `at`."""
    r, cubature = law.r, law.data
    for m in range(9):
        F[m] = 0.0
        Fd[m] = 0.0
    F[0] = 1.0
    F[4] = 1.0
    F[8] = 1.0
    for m in range(9):
        row = at + m * r
        s = 0.0
        t = 0.0
        for k in range(r):
            s += cubature[row + k] * u[k]
            t += cubature[row + k] * v[k]
        F[m] += s
        Fd[m] += t


@shared_kernel
def neohookean_forces(
    law: ElasticLaw, u: Array, v: Array, tangent: bool, work: LawWork, res: Array, P: Array, K: Array
) -> None:
    """Adds the forces to res[6:], and with `tangent` their derivatives by v and by u to P and K.

    Args:
        law: Its data start with a correction of the stiffness (r x r, for the part that the points do not integrate
            exactly), then for each point its weight [m^3] and the displacement gradients of the modes, 9 x r, row by
            row.
        u, v: Elastic coordinates and their rates, shape [r].
        res, P, K: Shapes [6 + r], [6 + r, 6 + r] twice.
    """
    r, lame, mu, beta = law.r, law.lame[0], law.lame[1], law.retardation
    at, cubature, w, Y = law.start, law.data, work.point, work.rows
    for i in range(r):
        t = 0.0
        for k in range(r):
            t += cubature[at + i * r + k] * (u[k] + beta * v[k])
            if tangent:
                K[6 + i, 6 + k] += cubature[at + i * r + k]
                P[6 + i, 6 + k] += beta * cubature[at + i * r + k]
        res[6 + i] += t
    F, Fd, stress, cof, S = w[0], w[1], w[2], w[3], w[4]
    A = w[9:]
    for point in range(law.points):
        start = at + r * r + point * (1 + 9 * r)
        weight = cubature[start]
        G = start + 1
        _deformation(law, u, v, G, F, Fd)
        J = cofactor(F, cof)
        g, dg, _ = volumetric(J, lame, mu)
        for m in range(9):
            stress[m] = mu * F[m] + g * cof[m]
        if beta != 0.0:
            viscous_stress(law, F, Fd, S, stress)
        for m in range(9):
            s = weight * stress[m]
            for i in range(r):
                res[6 + i] += s * cubature[G + m * r + i]
        if not tangent:
            continue
        stress_tangent(F, mu, g, dg, cof, A)
        for m in range(9):
            for k in range(r):
                t = 0.0
                for n in range(9):
                    t += A[m, n] * cubature[G + n * r + k]
                Y[m, k] = weight * t
        if beta != 0.0:
            _viscous_rows(law, weight, G, work)
        for m in range(9):
            for i in range(r):
                s = cubature[G + m * r + i]
                for k in range(r):
                    K[6 + i, 6 + k] += s * Y[m, k]
        if beta != 0.0:
            for m in range(9):
                for i in range(r):
                    s = cubature[G + m * r + i]
                    for k in range(r):
                        P[6 + i, 6 + k] += s * Y[9 + m, k]


@kernel
def _viscous_rows(law: ElasticLaw, weight: float, G: int, work: LawWork) -> None:
    """Adds the viscous stress's derivative by u to the first nine rows and writes that by v to the next nine.

    Args:
        weight: Of the point [m^3].
        G: Where the gradients of the modes at the point start in the law's data.
    """
    r, beta, cubature, w, Y = law.r, law.retardation, law.data, work.point, work.rows
    F, Fd, S, dF, zero, out = w[0], w[1], w[4], w[5], w[6], w[7]
    for m in range(9):
        zero[m] = 0.0
    for k in range(r):
        for m in range(9):
            dF[m] = cubature[G + m * r + k]
        _viscous_direction(law, F, Fd, S, dF, zero, out)
        for m in range(9):
            Y[m, k] += weight * beta * out[m]
        _viscous_direction(law, F, Fd, S, zero, dF, out)
        for m in range(9):
            Y[9 + m, k] = weight * beta * out[m]
