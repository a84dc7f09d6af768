"""Inertia, elastic, damping and gravity terms of a non-rotating component, and their Jacobians; compiled.

The change of the inertia by angular velocity and deformation is neglected. With s = s0 + M3^T u, J = tr(Z0) E - Z0,
b_k = axial(M4_k) and a = R^T (c'' - g), in body axes, the rows are

    translation  m a + alpha x s + M3^T v'
    rotation     s x a + J alpha + sum_k v'_k b_k
    elastic j    M3_j . a + b_j . alpha + m_j v'_j + k_j u_j + d_j v_j

which is `inertia` for omega = 0, its J(u) and b_k(u) taken at u = 0. Where the frame cannot rotate, these two affect
only the reaction moment, and the motion is exact. Where the frame rotates a little, by the deflection of the component
that carries it, terms of second order in the deflection are neglected. The center of mass still moves with u, as its
weight deflects the component that carries it. The vector a combines gravity and acceleration, so that both use the
same s and the mass matrix is symmetric.
"""

from calmotion.arrays import Array
from calmotion.multibody.kernels.components import Component, ComponentMotion
from calmotion.multibody.kernels.inertia import rigid_mass_matrix
from calmotion.multibody.kernels.work import Work
from calmotion.support.compilation import kernel


@kernel
def nonrotating_residual(component: Component, motion: ComponentMotion, work: Work, res: Array) -> None:
    """Rows of one component without its joints, into res, shape [6 + r]; leaves s in work.s."""
    r, mass, s0, Z0 = component.r, component.mass, component.s, component.Z
    M3, axial0, inertia = component.M3, component.axial0, component.inertia
    stiffness, damping = component.stiffness, component.damping
    a, al, u, v, vd, s = motion.a, motion.al, motion.u, motion.v, motion.vd, work.s
    trace = Z0[0, 0] + Z0[1, 1] + Z0[2, 2]
    for i in range(3):
        t = s0[i]
        f = mass * a[i]
        moment = trace * al[i]
        for k in range(3):
            moment -= Z0[i, k] * al[k]
        for j in range(r):
            t += M3[j, i] * u[j]
            f += M3[j, i] * vd[j]
            moment += axial0[j, i] * vd[j]
        s[i] = t
        res[i] = f
        res[3 + i] = moment
    for i in range(3):
        k, m = (i + 1) % 3, (i + 2) % 3
        res[i] += al[k] * s[m] - al[m] * s[k]
        res[3 + i] += s[k] * a[m] - s[m] * a[k]
    for j in range(r):
        t = inertia[j] * vd[j] + stiffness[j] * u[j]
        for i in range(3):
            t += M3[j, i] * a[i] + axial0[j, i] * al[i]
        for k in range(r):
            t += damping[j, k] * v[k]
        res[6 + j] = t


@kernel
def nonrotating_mass_matrix(component: Component, work: Work, D: Array) -> None:
    """D, shape [6 + r, 6 + r]: the rows by (a, alpha, v'), symmetric; needs `nonrotating_residual` first."""
    r, M3, axial0 = component.r, component.M3, component.axial0
    rigid_mass_matrix(component.mass, work.s, component.Z, D)
    for j in range(r):
        for i in range(3):
            D[6 + j, i] = M3[j, i]
            D[i, 6 + j] = M3[j, i]
            D[6 + j, 3 + i] = axial0[j, i]
            D[3 + i, 6 + j] = axial0[j, i]
        for k in range(r):
            D[6 + j, 6 + k] = 0.0
        D[6 + j, 6 + j] = component.inertia[j]


@kernel
def nonrotating_velocity_jacobian(component: Component, P: Array) -> None:
    """P, shape [6 + r, 6 + r]: the rows by (c', omega, v) at fixed acceleration; only those by v are not zero."""
    r, damping = component.r, component.damping
    for i in range(6 + r):
        for k in range(6 + r):
            P[i, k] = 0.0
    for j in range(r):
        for k in range(r):
            P[6 + j, 6 + k] = damping[j, k]


@kernel
def nonrotating_position_jacobian(component: Component, motion: ComponentMotion, D: Array, K: Array) -> None:
    """K, shape [6 + r, 6 + r]: the rows by (R^T dc, dphi, du) at fixed c', omega, v and their rates.

    Args:
        D: From `nonrotating_mass_matrix`.
    """
    r, M3, stiffness, a, al = component.r, component.M3, component.stiffness, motion.a, motion.al
    n = 6 + r
    # rotating the body changes a: da = [a]x dphi
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
