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
def _project(r, u, at, A, size, Y):
    """Y = J(u)^T A, shape [r, size]; A starts at `at` of a flat array."""
    for i in range(r):
        row = at + i * size
        for m in range(size):
            Y[i, m] = A[row + m]
    p = r
    for k in range(r):
        for l in range(k, r):
            row = at + p * size
            # d(u_k u_l) = u_l du_k + u_k du_l
            a, b = u[l], u[k]
            if l == k:
                a = 2.0 * a
                b = 0.0
            for m in range(size):
                Y[k, m] += a * A[row + m]
            if b != 0.0:
                for m in range(size):
                    Y[l, m] += b * A[row + m]
            p += 1


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
        z, Y, row: Scratch, shapes [size], [r, size] and [r], with size = r + r (r + 1) / 2.
        res, P, K: Shapes [6 + r], [6 + r, 6 + r] twice.
    """
    size = r + (r * (r + 1)) // 2
    strain_coordinates(r, u, v, beta, z)
    _project(r, u, at, A, size, Y)
    for i in range(r):
        t = 0.0
        for m in range(size):
            t += Y[i, m] * z[m]
        res[6 + i] += t
    if not tangent:
        return
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
    # stress on the pairs: d(u_k u_l) twice
    p = r
    for k in range(r):
        for l in range(k, r):
            s = 0.0
            start = at + p * size
            for m in range(size):
                s += A[start + m] * z[m]
            K[6 + k, 6 + l] += s
            K[6 + l, 6 + k] += s
            p += 1
