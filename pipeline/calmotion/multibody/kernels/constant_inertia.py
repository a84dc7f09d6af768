"""Inertia, elastic, damping and gravity terms of a component that never turns, and their Jacobians; compiled.

What an angular velocity or a deformation changes of the inertia is left out. With s = s0 + M3^T u, J = tr(Z0) E - Z0,
b_k = axial(M4_k) and a = R^T (c'' - g), in body axes, the rows are

    translation  m a + alpha x s + M3^T v'
    rotation     s x a + J alpha + sum_k v'_k b_k
    elastic j    M3_j . a + b_j . alpha + v'_j + k_j u_j + d_j v_j

which is `inertia` for omega = 0, its J(u) and b_k(u) taken at u = 0. Where the frame cannot turn these two act on
nothing but the moment that holds it, and nothing is lost; where it turns a little, with the deflection of what carries
it, terms of second order in the deflection are. The center of mass still moves with u, as its weight bends what
carries it; a holds gravity and acceleration alike, so that s is one and the same for both, and for the mass matrix to
be symmetric.
"""

from __future__ import annotations

from calmotion.multibody.kernels.inertia import rigid_mass_matrix
from calmotion.support.compilation import kernel


@kernel
def straight_residual(r, mass, s0, Z0, M3, axial0, stiffness, damping, a, al, u, v, vd, s, res):
    """Rows of one component without its joints, into res, shape [6 + r], and s, shape [3].

    Args:
        axial0: b_k, shape [r, 3].
        a, al: R^T (c'' - g), alpha, body axes, shape [3].
        u, v, vd: Elastic coordinates, their rates and accelerations, shape [r].
    """
    trace = Z0[0, 0] + Z0[1, 1] + Z0[2, 2]
    for i in range(3):
        t = s0[i]
        f = mass * a[i]
        m = trace * al[i]
        for k in range(3):
            m -= Z0[i, k] * al[k]
        for j in range(r):
            t += M3[j, i] * u[j]
            f += M3[j, i] * vd[j]
            m += axial0[j, i] * vd[j]
        s[i] = t
        res[i] = f
        res[3 + i] = m
    for i in range(3):
        k, m = (i + 1) % 3, (i + 2) % 3
        res[i] += al[k] * s[m] - al[m] * s[k]
        res[3 + i] += s[k] * a[m] - s[m] * a[k]
    for j in range(r):
        t = vd[j] + stiffness[j] * u[j]
        for i in range(3):
            t += M3[j, i] * a[i] + axial0[j, i] * al[i]
        for k in range(r):
            t += damping[j, k] * v[k]
        res[6 + j] = t


@kernel
def straight_mass_matrix(r, mass, s, Z0, M3, axial0, D):
    """D, shape [6 + r, 6 + r]: the rows by (a, alpha, v'), symmetric."""
    rigid_mass_matrix(mass, s, Z0, D)
    for j in range(r):
        for i in range(3):
            D[6 + j, i] = M3[j, i]
            D[i, 6 + j] = M3[j, i]
            D[6 + j, 3 + i] = axial0[j, i]
            D[3 + i, 6 + j] = axial0[j, i]
        for k in range(r):
            D[6 + j, 6 + k] = 0.0
        D[6 + j, 6 + j] = 1.0


@kernel
def straight_velocity_jacobian(r, damping, P):
    """P, shape [6 + r, 6 + r]: the rows by (c', omega, v) at fixed acceleration, of which only v moves any."""
    for i in range(6 + r):
        for k in range(6 + r):
            P[i, k] = 0.0
    for j in range(r):
        for k in range(r):
            P[6 + j, 6 + k] = damping[j, k]


@kernel
def straight_position_jacobian(r, M3, stiffness, a, al, D, K):
    """K, shape [6 + r, 6 + r]: the rows by (R^T dc, dphi, du) at fixed c', omega, v and their rates.

    Args:
        D: From `straight_mass_matrix`.
    """
    n = 6 + r
    # turning the body turns a: da = [a]x dphi
    for i in range(n):
        for k in range(n):
            K[i, k] = 0.0
        d0, d1, d2 = D[i, 0], D[i, 1], D[i, 2]
        K[i, 3] = d1 * a[2] - d2 * a[1]
        K[i, 4] = d2 * a[0] - d0 * a[2]
        K[i, 5] = d0 * a[1] - d1 * a[0]
    for j in range(r):
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            K[i, 6 + j] = al[k] * M3[j, m] - al[m] * M3[j, k]
            K[3 + i, 6 + j] = M3[j, k] * a[m] - M3[j, m] * a[k]
        K[6 + j, 6 + j] = stiffness[j]
