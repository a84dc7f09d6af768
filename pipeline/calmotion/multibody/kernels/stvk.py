"""Elastic and viscous forces of a St. Venant-Kirchhoff body in reduced coordinates; compiled.

With w = W u the few directions that its quadratic strain sees (all of u where W is none),
z(u) = (u_k; w_k w_l for k <= l) and A the Gram matrix of the strains that belong to it
(`reduction.elements.elastic_forms`), the energy is z^T A z / 2. Kelvin-Voigt damping adds b C:E' to the stress C:E,
hence, with J = dz/du,

    force      f = J^T A (z + b z'),      z' = J v
    by v       b J^T A J
    by u       J^T A (J + b dz'/du) + d(J^T)/du A (z + b z')

Both are exact: the force is a cubic polynomial, and a rigid turn of the body, of which z holds no strain, costs
nothing. As pairs are bilinear, J + b dz'/du is J at u + b v.
"""

from __future__ import annotations

from calmotion.support.compilation import kernel


@kernel
def _seen(r, p, at, W, u, w):
    """w = W u, shape [p]; W starts at `at` of a flat array, and is none where p is r."""
    for a in range(p):
        if p == r:
            w[a] = u[a]
            continue
        total = 0.0
        for k in range(r):
            total += W[at + a * r + k] * u[k]
        w[a] = total


@kernel
def strain_coordinates(r, p, u, v, w, rate, beta, z):
    """z + beta z' into z, shape [r + p (p + 1) / 2], of coordinates u, w and their rates v, rate."""
    n = r
    for k in range(r):
        z[k] = u[k] + beta * v[k]
    for k in range(p):
        for l in range(k, p):
            z[n] = w[k] * w[l] + beta * (w[k] * rate[l] + rate[k] * w[l])
            n += 1


@kernel
def _pair_row(r, p, i, l):
    """Row of A that belongs to the pair (i, l)."""
    k, n = min(i, l), max(i, l)
    return r + k * p - (k * (k - 1)) // 2 + n - k


@kernel
def _project(r, p, w, at, A, size, Y):
    """Y = J^T A, shape [p, size], with J the derivative of z by w; A starts at `at` of a flat array.

    The part of single coordinates is in it where these are w.
    """
    for i in range(p):
        y = Y[i]
        first = A[at + i * size : at + (i + 1) * size]
        single = 1.0 if p == r else 0.0
        for m in range(size):
            y[m] = single * first[m]
        # d(w_i w_l) = w_l dw_i, and twice that where l is i; four rows at a time halve the traffic
        l = 0
        while l + 4 <= p:
            s0, s1 = at + size * _pair_row(r, p, i, l), at + size * _pair_row(r, p, i, l + 1)
            s2, s3 = at + size * _pair_row(r, p, i, l + 2), at + size * _pair_row(r, p, i, l + 3)
            a0, a1, a2, a3 = A[s0 : s0 + size], A[s1 : s1 + size], A[s2 : s2 + size], A[s3 : s3 + size]
            w0, w1, w2, w3 = w[l], w[l + 1], w[l + 2], w[l + 3]
            if l <= i < l + 4:
                if i == l:
                    w0 = 2.0 * w0
                elif i == l + 1:
                    w1 = 2.0 * w1
                elif i == l + 2:
                    w2 = 2.0 * w2
                else:
                    w3 = 2.0 * w3
            for m in range(size):
                y[m] += w0 * a0[m] + w1 * a1[m] + w2 * a2[m] + w3 * a3[m]
            l += 4
        while l < p:
            start = at + size * _pair_row(r, p, i, l)
            last = A[start : start + size]
            factor = 2.0 * w[l] if l == i else w[l]
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
def _times_pairs(p, pairs, x, row):
    """row = pairs^T J_w(x), shape [p]: what a row of A is worth in the directions, at w = x."""
    for a in range(p):
        row[a] = 0.0
    n = 0
    for k in range(p):
        for l in range(k, p):
            y = pairs[n]
            row[k] += y * x[l]
            row[l] += y * x[k]
            n += 1


@kernel
def _add_carried(r, p, at, W, scale, row, out):
    """out += scale row W, of what stands in the directions to what stands in the coordinates."""
    if p == r:
        for k in range(r):
            out[k] += scale * row[k]
        return
    for a in range(p):
        factor = scale * row[a]
        start = at + a * r
        line = W[start : start + r]
        for k in range(r):
            out[k] += factor * line[k]


@kernel
def _along(r, p, a, x, stress, Y, row):
    """row = Y_pairs[a] J_w(x), and what the pairs of `stress` do as w turns; none where that is empty."""
    _times_pairs(p, Y[a, r:], x, row)
    if len(stress) == 0:
        return
    for l in range(p):
        y = stress[_pair_row(r, p, a, l)]
        row[l] += 2.0 * y if l == a else y


@kernel
def _add_tangent(r, p, x, stress, scale, at, A, size, Y, row, inner, out):
    """out[6:, 6:] += scale (J(w)^T A J(x) + d(J^T)/du stress), the last none where `stress` is empty."""
    if p == r:
        for a in range(r):
            _along(r, p, a, x, stress, Y, row)
            own = out[6 + a, 6:]
            for k in range(r):
                own[k] += scale * (Y[a, k] + row[k])
        return
    W = at + size * size
    # by the directions first: inner = Y_u + (Y_pairs J_w(x) + d(J_w^T)/dw stress) W
    for a in range(p):
        _along(r, p, a, x, stress, Y, row)
        for k in range(r):
            inner[a, k] = Y[a, k]
        _add_carried(r, p, W, A, 1.0, row, inner[a])
    for i in range(r):
        start = at + i * size
        line = A[start : start + size]
        _times_pairs(p, line[r:], x, row)
        own = out[6 + i, 6:]
        for k in range(r):
            own[k] += scale * line[k]
        _add_carried(r, p, W, A, scale, row, own)
        for a in range(p):
            factor = scale * A[W + a * r + i]
            for k in range(r):
                own[k] += factor * inner[a, k]


@kernel
def stvk_forces(r, p, u, v, beta, at, A, tangent, z, Y, seen, row, inner, res, P, K):
    """Adds the forces to res[6:], and with `tangent` their derivatives by v and by u to P and K.

    Args:
        r, p: Elastic coordinates, and directions that the quadratic strain sees.
        u, v: Elastic coordinates and their rates, shape [r].
        beta: Retardation time of Kelvin-Voigt damping [s].
        at, A: Flat array of Gram matrices, each with its W after it where p is below r, and where this body's starts.
        z, Y, seen, row, inner: Scratch, shapes [2 size], [p, size], [3, p], [p] and [p, r], with
            size = r + p (p + 1) / 2.
        res, P, K: Shapes [6 + r], [6 + r, 6 + r] twice.
    """
    size = r + (p * (p + 1)) // 2
    W = at + size * size
    w, rate, x = seen[0], seen[1], seen[2]
    _seen(r, p, W, A, u, w)
    _seen(r, p, W, A, v, rate)
    strain_coordinates(r, p, u, v, w, rate, beta, z)
    stress = z[size:]
    _stress(size, at, A, z, stress)
    own = res[6:]
    for k in range(r):
        own[k] += stress[k]
    _times_pairs(p, stress[r:], w, row)
    _add_carried(r, p, W, A, 1.0, row, own)
    if not tangent:
        return
    _project(r, p, w, at, A, size, Y)
    for a in range(p):
        x[a] = w[a] + beta * rate[a]
    _add_tangent(r, p, x, stress, 1.0, at, A, size, Y, row, inner, K)
    if beta != 0.0:
        _add_tangent(r, p, w, stress[:0], beta, at, A, size, Y, row, inner, P)
