"""Elastic and viscous forces of a St. Venant-Kirchhoff body in reduced coordinates; compiled.

With w = W u the coordinates in the subspace of its quadratic strain (all of u where there is no W),
z(u) = (u_k; w_k w_l for k <= l) and A the Gram matrix of the strains that belong to it
(`reduction.elements.elastic_forms`), the energy is z^T A z / 2. Kelvin-Voigt damping adds b C:E' to the stress C:E,
hence, with J = dz/du,

    force      f = J^T A (z + b z'),      z' = J v
    by v       b J^T A J
    by u       J^T A (J + b dz'/du) + d(J^T)/du A (z + b z')

Both are exact: the force is a cubic polynomial, and a rigid rotation of the body, whose z has no strain, has no
energy. As pairs are bilinear, J + b dz'/du is J at u + b v.
"""

from calmotion.arrays import Array
from calmotion.multibody.kernels.components import ElasticLaw
from calmotion.multibody.kernels.work import LawWork
from calmotion.support.compilation import kernel, shared_kernel


@kernel
def _size(law: ElasticLaw) -> int:
    """Number of strain coordinates, r + p (p + 1) / 2."""
    return law.r + (law.points * (law.points + 1)) // 2


@kernel
def _project_to_subspace(law: ElasticLaw, u: Array, w: Array) -> None:
    """w = W u, shape [p]; w = u where p is r, as there is no W then."""
    r, p, W = law.r, law.points, law.data
    at = law.start + _size(law) ** 2
    for a in range(p):
        if p == r:
            w[a] = u[a]
            continue
        total = 0.0
        for k in range(r):
            total += W[at + a * r + k] * u[k]
        w[a] = total


@kernel
def strain_coordinates(law: ElasticLaw, u: Array, v: Array, w: Array, rate: Array, z: Array) -> None:
    """z + beta z' into z, shape [r + p (p + 1) / 2], of coordinates u, w and their rates v, rate."""
    r, p, beta = law.r, law.points, law.retardation
    n = r
    for k in range(r):
        z[k] = u[k] + beta * v[k]
    for k in range(p):
        for l in range(k, p):
            z[n] = w[k] * w[l] + beta * (w[k] * rate[l] + rate[k] * w[l])
            n += 1


@kernel
def _pair_row(r: int, p: int, i: int, l: int) -> int:
    """Row of A that belongs to the pair (i, l)."""
    k, n = min(i, l), max(i, l)
    return r + k * p - (k * (k - 1)) // 2 + n - k


@kernel
def _gram_rows(law: ElasticLaw, w: Array, Y: Array) -> None:
    """Y = J^T A, shape [p, size], with J the derivative of z by w.

    It contains the rows of the single coordinates where these are w.
    """
    r, p, at, A, size = law.r, law.points, law.start, law.data, _size(law)
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
def _stress(law: ElasticLaw, z: Array, stress: Array) -> None:
    """stress = A z, shape [size]: sums of rows of the symmetric A, as these vectorise and dot products do not."""
    at, A, size = law.start, law.data, _size(law)
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
def _stress_of_rows(law: ElasticLaw, u: Array, v: Array, w: Array, rate: Array, Y: Array, stress: Array) -> None:
    """The same from the rows of `_gram_rows`, without reading all of A again: pairs are J(w) w / 2."""
    r, p, beta, at, A, size = law.r, law.points, law.retardation, law.start, law.data, _size(law)
    for m in range(size):
        stress[m] = 0.0
    for k in range(r):
        # where w is u, the rows contain those of the single coordinates
        single = 0.5 * u[k] if p == r else u[k] + beta * v[k]
        line = A[at + k * size : at + (k + 1) * size]
        for m in range(size):
            stress[m] += single * line[m]
    for a in range(p):
        pairs, y = 0.5 * w[a] + beta * rate[a], Y[a]
        for m in range(size):
            stress[m] += pairs * y[m]


@kernel
def _times_pairs(p: int, pairs: Array, x: Array, row: Array) -> None:
    """row = pairs^T J_w(x), shape [p]: a row of A by the coordinates of the subspace, at w = x."""
    for a in range(p):
        row[a] = 0.0
    n = 0
    for k in range(p):
        # two sums, as each addition to one waits for the one before
        factor, even, odd = x[k], 0.0, 0.0
        l = k
        while l + 2 <= p:
            y0, y1 = pairs[n], pairs[n + 1]
            even += y0 * x[l]
            odd += y1 * x[l + 1]
            row[l] += factor * y0
            row[l + 1] += factor * y1
            n += 2
            l += 2
        if l < p:
            even += pairs[n] * x[l]
            row[l] += factor * pairs[n]
            n += 1
        row[k] += even + odd


@kernel
def _add_from_subspace(law: ElasticLaw, scale: float, row: Array, out: Array) -> None:
    """out += scale row W: from the coordinates of the subspace to the elastic coordinates."""
    r, p, W = law.r, law.points, law.data
    at = law.start + _size(law) ** 2
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
def _tangent_row(law: ElasticLaw, a: int, x: Array, stress: Array, Y: Array, row: Array) -> None:
    """row = Y_pairs[a] J_w(x) + d(J_w^T)/dw stress; without the latter where `stress` is empty."""
    r, p = law.r, law.points
    _times_pairs(p, Y[a, r:], x, row)
    if len(stress) == 0:
        return
    for l in range(p):
        y = stress[_pair_row(r, p, a, l)]
        row[l] += 2.0 * y if l == a else y


@kernel
def _add_tangent(law: ElasticLaw, x: Array, stress: Array, scale: float, work: LawWork, out: Array) -> None:
    """out[6:, 6:] += scale (J(w)^T A J(x) + d(J^T)/du stress), without the latter where `stress` is empty.

    Needs `_gram_rows` first.
    """
    r, p, at, A, size = law.r, law.points, law.start, law.data, _size(law)
    Y, row, inner = work.rows, work.row, work.inner
    if p == r:
        for a in range(r):
            _tangent_row(law, a, x, stress, Y, row)
            elastic = out[6 + a, 6:]
            for k in range(r):
                elastic[k] += scale * (Y[a, k] + row[k])
        return
    W = at + size * size
    # by the subspace first: inner = Y_u + (Y_pairs J_w(x) + d(J_w^T)/dw stress) W
    for a in range(p):
        _tangent_row(law, a, x, stress, Y, row)
        for k in range(r):
            inner[a, k] = Y[a, k]
        _add_from_subspace(law, 1.0, row, inner[a])
    for i in range(r):
        start = at + i * size
        line = A[start : start + size]
        _times_pairs(p, line[r:], x, row)
        elastic = out[6 + i, 6:]
        for k in range(r):
            elastic[k] += scale * line[k]
        _add_from_subspace(law, scale, row, elastic)
        for a in range(p):
            factor = scale * A[W + a * r + i]
            for k in range(r):
                elastic[k] += factor * inner[a, k]


@shared_kernel
def stvk_forces(
    law: ElasticLaw, u: Array, v: Array, tangent: bool, work: LawWork, res: Array, P: Array, K: Array
) -> None:
    """Adds the forces to res[6:], and with `tangent` their derivatives by v and by u to P and K.

    Args:
        law: Its data start with the Gram matrix, shape [size, size], with W after it where p is below r; see
            `LawWork` for p and size.
        u, v: Elastic coordinates and their rates, shape [r].
        res, P, K: Shapes [6 + r], [6 + r, 6 + r] twice.
    """
    r, p, beta, size = law.r, law.points, law.retardation, _size(law)
    w, rate, x = work.subspace[0], work.subspace[1], work.subspace[2]
    z, stress = work.strain, work.strain[size:]
    _project_to_subspace(law, u, w)
    _project_to_subspace(law, v, rate)
    if tangent:
        _gram_rows(law, w, work.rows)
        _stress_of_rows(law, u, v, w, rate, work.rows, stress)
    else:
        strain_coordinates(law, u, v, w, rate, z)
        _stress(law, z, stress)
    elastic = res[6:]
    for k in range(r):
        elastic[k] += stress[k]
    _times_pairs(p, stress[r:], w, work.row)
    _add_from_subspace(law, 1.0, work.row, elastic)
    if not tangent:
        return
    for a in range(p):
        x[a] = w[a] + beta * rate[a]
    _add_tangent(law, x, stress, 1.0, work, K)
    if beta != 0.0:
        _add_tangent(law, w, stress[:0], beta, work, P)
