"""Elastic and viscous forces of a St. Venant-Kirchhoff body in reduced coordinates; compiled.

With z(u) = (u_k; u_k u_l for k <= l) and A the Gram matrix of the strains that belong to it (`fem.elastic_forms`),
the energy is z^T A z / 2. Kelvin-Voigt damping adds b C:E' to the stress C:E, hence, with J = dz/du,

    force      f = J^T A (z + b z'),      z' = J v
    by v       b J^T A J
    by u       J^T A (J + b dz'/du) + d(J^T)/du A (z + b z')

Both are exact: the force is a cubic polynomial, and a rigid turn of the body, of which z holds no strain, costs
nothing.
"""

from __future__ import annotations

from ..kernels import kernel


@kernel
def strain_coordinates(r, u, v, beta, z):
    """z(u) + beta z'(u, v) into z, shape [r + r (r + 1) / 2]."""
    p = r
    for k in range(r):
        z[k] = u[k] + beta * v[k]
        for l in range(k, r):
            z[p] = u[k] * u[l] + beta * (u[k] * v[l] + v[k] * u[l])
            p += 1


@kernel
def _pair_row(r, i, l):
    """Row of A that belongs to the pair (i, l)."""
    k, n = min(i, l), max(i, l)
    return r + k * r - (k * (k - 1)) // 2 + n - k


@kernel
def _project(r, u, at, A, size, Y):
    """Y = J(u)^T A, shape [r, size]; A starts at `at` of a flat array."""
    for i in range(r):
        y = Y[i]
        first = A[at + i * size : at + (i + 1) * size]
        for m in range(size):
            y[m] = first[m]
        # d(u_i u_l) = u_l du_i, and twice that where l is i; four rows at a time halve the traffic
        l = 0
        while l + 4 <= r:
            s0, s1 = at + size * _pair_row(r, i, l), at + size * _pair_row(r, i, l + 1)
            s2, s3 = at + size * _pair_row(r, i, l + 2), at + size * _pair_row(r, i, l + 3)
            a0, a1, a2, a3 = A[s0 : s0 + size], A[s1 : s1 + size], A[s2 : s2 + size], A[s3 : s3 + size]
            u0, u1, u2, u3 = u[l], u[l + 1], u[l + 2], u[l + 3]
            if l <= i < l + 4:
                if i == l:
                    u0 = 2.0 * u0
                elif i == l + 1:
                    u1 = 2.0 * u1
                elif i == l + 2:
                    u2 = 2.0 * u2
                else:
                    u3 = 2.0 * u3
            for m in range(size):
                y[m] += u0 * a0[m] + u1 * a1[m] + u2 * a2[m] + u3 * a3[m]
            l += 4
        while l < r:
            start = at + size * _pair_row(r, i, l)
            last = A[start : start + size]
            factor = 2.0 * u[l] if l == i else u[l]
            for m in range(size):
                y[m] += factor * last[m]
            l += 1


@kernel
def _stress(size, at, A, z, stress):
    """stress = A z, shape [size]: sums of rows of the symmetric A, as they run in vectors and dot products do not."""
    for m in range(size):
        stress[m] = 0.0
    n = 0
    while n + 4 <= size:
        start = at + n * size
        a0, a1 = A[start : start + size], A[start + size : start + 2 * size]
        a2, a3 = A[start + 2 * size : start + 3 * size], A[start + 3 * size : start + 4 * size]
        z0, z1, z2, z3 = z[n], z[n + 1], z[n + 2], z[n + 3]
        for m in range(size):
            stress[m] += z0 * a0[m] + z1 * a1[m] + z2 * a2[m] + z3 * a3[m]
        n += 4
    while n < size:
        last, factor = A[at + n * size : at + (n + 1) * size], z[n]
        for m in range(size):
            stress[m] += factor * last[m]
        n += 1


@kernel
def _times_jacobian(r, i, Y, w, scale, row):
    """row += scale * Y[i] J(w), shape [r]: the pairs of J(w) alone, without the part of single coordinates."""
    p = r
    for k in range(r):
        for l in range(k, r):
            y = scale * Y[i, p]
            row[k] += y * w[l]
            row[l] += y * w[k]
            p += 1


@kernel
def stvk_forces(r, u, v, beta, at, A, tangent, z, Y, row, res, P, K):
    """Adds the forces to res[6:], and with `tangent` their derivatives by v and by u to P and K.

    Args:
        u, v: Elastic coordinates and their rates, shape [r].
        beta: Retardation time of Kelvin-Voigt damping [s].
        at, A: Flat array of Gram matrices, and where this body's starts.
        z, Y, row: Scratch, shapes [2 size], [r, size] and [r], with size = r + r (r + 1) / 2.
        res, P, K: Shapes [6 + r], [6 + r, 6 + r] twice.
    """
    size = r + (r * (r + 1)) // 2
    strain_coordinates(r, u, v, beta, z)
    stress = z[size:]
    _stress(size, at, A, z, stress)
    p = r
    for k in range(r):
        res[6 + k] += stress[k]
        for l in range(k, r):
            res[6 + k] += stress[p] * u[l]
            res[6 + l] += stress[p] * u[k]
            p += 1
    if not tangent:
        return
    _project(r, u, at, A, size, Y)
    for i in range(r):
        for k in range(r):
            row[k] = Y[i, k]
        _times_jacobian(r, i, Y, u, 1.0, row)
        for k in range(r):
            K[6 + i, 6 + k] += row[k]
            P[6 + i, 6 + k] += beta * row[k]
        if beta != 0.0:
            for k in range(r):
                row[k] = 0.0
            _times_jacobian(r, i, Y, v, beta, row)
            for k in range(r):
                K[6 + i, 6 + k] += row[k]
    p = r
    for k in range(r):
        for l in range(k, r):
            K[6 + k, 6 + l] += stress[p]
            K[6 + l, 6 + k] += stress[p]
            p += 1
