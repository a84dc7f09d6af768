"""Inertia, elastic, damping and gravity terms of one component, and their Jacobians; compiled.

With y = X + Phi u, body axes: s = int rho y, Z = int rho y y^T, B_j = int rho y phi_j^T, J = tr(Z) E - Z,
b_j = axial(B_j) = int rho y x phi_j, W = [alpha]x + [omega]x^2, and a = R^T (c'' - g), the rows are

    translation  m a + W s + 2 omega x (M3^T v) + M3^T v'
    rotation     s x a + axial(Z W^T) + 2 sum_k v_k (tr(B_k) - B_k^T) omega + sum_k v'_k b_k
    elastic j    M3_j . a + tr(W B_j) + 2 omega . sum_k v_k axial(S_kj) + m_j v'_j + k_j u_j + d_j v_j

with m_j = 1, or 0 for the deflection of a drive: formulation, section 1 (Seed (4)-(10), (19)-(22), with the rows of c
and omega that the seed omits).
"""

from calmotion.arrays import Array
from calmotion.multibody.kernels.components import Component, ComponentMotion
from calmotion.multibody.kernels.work import Work
from calmotion.support.compilation import kernel, shared_kernel


@shared_kernel
def deformed_integrals(component: Component, u: Array, work: Work) -> None:
    """s, Z and B_j (shapes [3], [3, 3], [r, 3, 3]) of the deformed component into the scratch."""
    r, s0, Z0, M3, M4, S = component.r, component.s, component.Z, component.M3, component.M4, component.S
    s, Z, B = work.s, work.Z, work.B
    for i in range(3):
        t = s0[i]
        for j in range(r):
            t += M3[j, i] * u[j]
        s[i] = t
    for j in range(r):
        for a in range(3):
            for b in range(3):
                t = M4[j, a, b]
                for k in range(r):
                    t += u[k] * S[k, j, a, b]
                B[j, a, b] = t
    for a in range(3):
        for b in range(3):
            t = Z0[a, b]
            for j in range(r):
                # Z = Z0 + sum u_j (M4_j^T + B_j): X phi^T is in M4, phi y^T is B^T
                t += u[j] * (M4[j, a, b] + B[j, b, a])
            Z[a, b] = t


@kernel
def _gradient_of_acceleration(al: Array, om: Array, W: Array) -> None:
    """W = [alpha]x + [omega]x^2."""
    w2 = om[0] * om[0] + om[1] * om[1] + om[2] * om[2]
    for a in range(3):
        for b in range(3):
            W[a, b] = om[a] * om[b]
        W[a, a] -= w2
    W[0, 1] -= al[2]
    W[1, 0] += al[2]
    W[0, 2] += al[1]
    W[2, 0] -= al[1]
    W[1, 2] -= al[0]
    W[2, 1] += al[0]


@kernel
def _axial_of_product(Z: Array, W: Array, out: Array) -> None:
    """out = axial(Z W^T), with axial(y z^T) = y x z."""
    for i in range(3):
        k, m = (i + 1) % 3, (i + 2) % 3
        t = 0.0
        for n in range(3):
            t += Z[k, n] * W[m, n] - Z[m, n] * W[k, n]
        out[i] = t


@kernel
def _elastic_momentum(r: int, M3: Array, v: Array) -> tuple[float, float, float]:
    """int rho Phi v = M3^T v."""
    p0 = 0.0
    p1 = 0.0
    p2 = 0.0
    for j in range(r):
        p0 += M3[j, 0] * v[j]
        p1 += M3[j, 1] * v[j]
        p2 += M3[j, 2] * v[j]
    return p0, p1, p2


@shared_kernel
def body_residual(component: Component, motion: ComponentMotion, work: Work, res: Array) -> None:
    """Rows of one component without its joints, into res, shape [6 + r].

    Needs `deformed_integrals` first; leaves [alpha]x + [omega]x^2 in work.W.
    """
    r, mass, M3, axial = component.r, component.mass, component.M3, component.axial
    inertia, stiffness, damping = component.inertia, component.stiffness, component.damping
    a, om, al, u, v, vd = motion.a, motion.om, motion.al, motion.u, motion.v, motion.vd
    s, Z, B, W, tmp = work.s, work.Z, work.B, work.W, work.tmp
    _gradient_of_acceleration(al, om, W)
    p0, p1, p2 = _elastic_momentum(r, M3, v)
    for i in range(3):
        t = mass * a[i]
        for k in range(3):
            t += W[i, k] * s[k]
        for j in range(r):
            t += M3[j, i] * vd[j]
        res[i] = t
    res[0] += 2.0 * (om[1] * p2 - om[2] * p1)
    res[1] += 2.0 * (om[2] * p0 - om[0] * p2)
    res[2] += 2.0 * (om[0] * p1 - om[1] * p0)
    _axial_of_product(Z, W, tmp)
    res[3] = tmp[0] + s[1] * a[2] - s[2] * a[1]
    res[4] = tmp[1] + s[2] * a[0] - s[0] * a[2]
    res[5] = tmp[2] + s[0] * a[1] - s[1] * a[0]
    for j in range(r):
        tr = B[j, 0, 0] + B[j, 1, 1] + B[j, 2, 2]
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            t = tr * om[i]
            for n in range(3):
                t -= B[j, n, i] * om[n]
            res[3 + i] += 2.0 * v[j] * t + vd[j] * (B[j, k, m] - B[j, m, k])
    for j in range(r):
        t = inertia[j] * vd[j] + stiffness[j] * u[j]
        for i in range(3):
            t += M3[j, i] * a[i]
            for k in range(3):
                t += W[i, k] * B[j, k, i]
        for k in range(r):
            rotating = om[0] * axial[k, j, 0] + om[1] * axial[k, j, 1] + om[2] * axial[k, j, 2]
            t += v[k] * (damping[j, k] + 2.0 * rotating)
        res[6 + j] = t


@kernel
def rigid_mass_matrix(mass: float, s: Array, Z: Array, D: Array) -> None:
    """The part of `mass_matrix` by (a, alpha), shape [6, 6]."""
    trace = Z[0, 0] + Z[1, 1] + Z[2, 2]
    for i in range(3):
        for k in range(3):
            D[i, k] = 0.0
            D[3 + i, 3 + k] = -Z[i, k]
        D[i, i] = mass
        D[3 + i, 3 + i] += trace
        D[3 + i, i] = 0.0
        D[i, 3 + i] = 0.0
    D[3, 1] = -s[2]
    D[3, 2] = s[1]
    D[4, 0] = s[2]
    D[4, 2] = -s[0]
    D[5, 0] = -s[1]
    D[5, 1] = s[0]
    for i in range(3):
        for k in range(3):
            D[i, 3 + k] = D[3 + k, i]


@shared_kernel
def mass_matrix(component: Component, work: Work, D: Array) -> None:
    """D, shape [6 + r, 6 + r]: the rows by (a, alpha, v'), symmetric. Formulation, section 1."""
    r, M3, B = component.r, component.M3, work.B
    rigid_mass_matrix(component.mass, work.s, work.Z, D)
    for j in range(r):
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            D[6 + j, i] = M3[j, i]
            D[i, 6 + j] = M3[j, i]
            b = B[j, k, m] - B[j, m, k]
            D[6 + j, 3 + i] = b
            D[3 + i, 6 + j] = b
        for k in range(r):
            D[6 + j, 6 + k] = 0.0
        D[6 + j, 6 + j] = component.inertia[j]


@shared_kernel
def velocity_jacobian(component: Component, motion: ComponentMotion, work: Work, P: Array) -> None:
    """P, shape [6 + r, 6 + r]: the rows by (c', omega, v) at fixed acceleration; its first three columns are zero."""
    r, M3, axial, damping = component.r, component.M3, component.axial, component.damping
    om, v, s, Z, B = motion.om, motion.v, work.s, work.Z, work.B
    n = 6 + r
    for i in range(n):
        for k in range(n):
            P[i, k] = 0.0
    p0, p1, p2 = _elastic_momentum(r, M3, v)
    # translation by omega: -[omega x s + 2 p]x - [omega]x [s]x
    so = s[0] * om[0] + s[1] * om[1] + s[2] * om[2]
    e0 = om[1] * s[2] - om[2] * s[1] + 2.0 * p0
    e1 = om[2] * s[0] - om[0] * s[2] + 2.0 * p1
    e2 = om[0] * s[1] - om[1] * s[0] + 2.0 * p2
    for i in range(3):
        for k in range(3):
            P[i, 3 + k] = -s[i] * om[k]
        P[i, 3 + i] += so
    P[0, 4] += e2
    P[0, 5] -= e1
    P[1, 3] -= e2
    P[1, 5] += e0
    P[2, 3] += e1
    P[2, 4] -= e0
    # rotation by omega: [omega]x J - [J omega]x + 2 sum v (tr B - B^T)
    trace = Z[0, 0] + Z[1, 1] + Z[2, 2]
    for k in range(3):
        j0, j1, j2 = -Z[0, k], -Z[1, k], -Z[2, k]
        if k == 0:
            j0 += trace
        elif k == 1:
            j1 += trace
        else:
            j2 += trace
        P[3, 3 + k] = om[1] * j2 - om[2] * j1
        P[4, 3 + k] = om[2] * j0 - om[0] * j2
        P[5, 3 + k] = om[0] * j1 - om[1] * j0
    q0 = trace * om[0] - Z[0, 0] * om[0] - Z[0, 1] * om[1] - Z[0, 2] * om[2]
    q1 = trace * om[1] - Z[1, 0] * om[0] - Z[1, 1] * om[1] - Z[1, 2] * om[2]
    q2 = trace * om[2] - Z[2, 0] * om[0] - Z[2, 1] * om[1] - Z[2, 2] * om[2]
    P[3, 4] += q2
    P[3, 5] -= q1
    P[4, 3] -= q2
    P[4, 5] += q0
    P[5, 3] += q1
    P[5, 4] -= q0
    for j in range(r):
        tr = B[j, 0, 0] + B[j, 1, 1] + B[j, 2, 2]
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            P[i, 6 + j] = 2.0 * (om[k] * M3[j, m] - om[m] * M3[j, k])
            t = tr * om[i]
            g = -2.0 * tr * om[i]
            for n2 in range(3):
                P[3 + i, 3 + n2] -= 2.0 * v[j] * B[j, n2, i]
                t -= B[j, n2, i] * om[n2]
                g += (B[j, i, n2] + B[j, n2, i]) * om[n2]
            P[3 + i, 3 + i] += 2.0 * v[j] * tr
            P[3 + i, 6 + j] = 2.0 * t
            for l in range(r):
                g += 2.0 * v[l] * axial[l, j, i]
            P[6 + j, 3 + i] = g
        for k in range(r):
            rotating = om[0] * axial[k, j, 0] + om[1] * axial[k, j, 1] + om[2] * axial[k, j, 2]
            P[6 + j, 6 + k] = 2.0 * rotating + damping[j, k]


@shared_kernel
def position_jacobian(component: Component, motion: ComponentMotion, work: Work, D: Array, K: Array) -> None:
    """K, shape [6 + r, 6 + r]: the rows by (R^T dc, dphi, du) at fixed c', omega, v and their rates.

    Needs `body_residual` first.

    Args:
        D: From `mass_matrix`.
    """
    r, M3, S, axial, stiffness = component.r, component.M3, component.S, component.axial, component.stiffness
    a, om, v, vd = motion.a, motion.om, motion.v, motion.vd
    B, W, E, T, tmp = work.B, work.W, work.E, work.T, work.tmp
    n = 6 + r
    # rotating the body changes a: da = [a]x dphi
    for i in range(n):
        for k in range(3):
            K[i, k] = 0.0
        d0, d1, d2 = D[i, 0], D[i, 1], D[i, 2]
        K[i, 3] = d1 * a[2] - d2 * a[1]
        K[i, 4] = d2 * a[0] - d0 * a[2]
        K[i, 5] = d0 * a[1] - d1 * a[0]
    for k in range(r):
        for i in range(3):
            K[i, 6 + k] = W[i, 0] * M3[k, 0] + W[i, 1] * M3[k, 1] + W[i, 2] * M3[k, 2]
        for i in range(3):
            for m in range(3):
                T[i, m] = B[k, i, m] + B[k, m, i]
                t = 0.0
                for l in range(r):
                    t += v[l] * S[k, l, i, m]
                E[i, m] = t
        _axial_of_product(T, W, tmp)
        tr = E[0, 0] + E[1, 1] + E[2, 2]
        for i in range(3):
            p, q = (i + 1) % 3, (i + 2) % 3
            t = tmp[i] + M3[k, p] * a[q] - M3[k, q] * a[p] + 2.0 * tr * om[i]
            for m in range(3):
                t -= 2.0 * E[m, i] * om[m]
            for l in range(r):
                t += vd[l] * axial[k, l, i]
            K[3 + i, 6 + k] = t
        for j in range(r):
            t = 0.0
            for i in range(3):
                for m in range(3):
                    t += W[i, m] * S[k, j, m, i]
            K[6 + j, 6 + k] = t
        K[6 + k, 6 + k] += stiffness[k]
