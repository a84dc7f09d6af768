"""Green strain fields of modes and of pairs of directions at quadrature points; compiled."""

from calmotion.arrays import Array
from calmotion.support.compilation import kernel

Strain = tuple[float, float, float, float, float, float]  # entries 00, 11, 22, 12, 02, 01


@kernel
def _store(strain: Strain, weight: float, shear: float, bulk: float, out: Array, m: int) -> None:
    """Write a strain as six numbers: the sum of their squares is its energy density times the squared weight."""
    s00, s11, s22, s12, s02, s01 = strain
    trace = bulk * (s00 + s11 + s22)
    out[0, m] = weight * (shear * s00 + trace)
    out[1, m] = weight * (shear * s11 + trace)
    out[2, m] = weight * (shear * s22 + trace)
    twice = weight * shear * 2.0**0.5
    out[3, m] = twice * s12
    out[4, m] = twice * s02
    out[5, m] = twice * s01


@kernel
def green_fields(G: Array, H: Array, weight: Array, shear: float, bulk: float, out: Array) -> None:
    """Write sym(G_k) of each mode, then sym(H_k^T H_l) of the pairs k <= l of directions, halved where k = l.

    Args:
        G, H: Displacement gradients of r modes and p directions, row by row, shapes [r, 9, n] and [p, 9, n].
        weight: Square roots of the weights of the points [m^1.5], shape [n].
        shear, bulk: The energy density of a strain E is |shear E + bulk tr(E) 1|^2 / 2 [Pa^0.5].
        out: Written: fields, shape [r + p (p + 1) / 2, 6, n]; inner products of fields are those of the energy.
    """
    r, p, n = len(G), len(H), len(weight)
    for k in range(r):
        g, field = G[k], out[k]
        for m in range(n):
            s12, s02, s01 = 0.5 * (g[5, m] + g[7, m]), 0.5 * (g[2, m] + g[6, m]), 0.5 * (g[1, m] + g[3, m])
            _store((g[0, m], g[4, m], g[8, m], s12, s02, s01), weight[m], shear, bulk, field, m)
    row = r
    for k in range(p):
        a = H[k]
        for l in range(k, p):
            b, field = H[l], out[row]
            once = 0.5 if k == l else 1.0
            half = 0.5 * once
            for m in range(n):
                s12 = a[1, m] * b[2, m] + a[4, m] * b[5, m] + a[7, m] * b[8, m]
                s12 += b[1, m] * a[2, m] + b[4, m] * a[5, m] + b[7, m] * a[8, m]
                s02 = a[0, m] * b[2, m] + a[3, m] * b[5, m] + a[6, m] * b[8, m]
                s02 += b[0, m] * a[2, m] + b[3, m] * a[5, m] + b[6, m] * a[8, m]
                s01 = a[0, m] * b[1, m] + a[3, m] * b[4, m] + a[6, m] * b[7, m]
                s01 += b[0, m] * a[1, m] + b[3, m] * a[4, m] + b[6, m] * a[7, m]
                s00 = once * (a[0, m] * b[0, m] + a[3, m] * b[3, m] + a[6, m] * b[6, m])
                s11 = once * (a[1, m] * b[1, m] + a[4, m] * b[4, m] + a[7, m] * b[7, m])
                s22 = once * (a[2, m] * b[2, m] + a[5, m] * b[5, m] + a[8, m] * b[8, m])
                _store((s00, s11, s22, half * s12, half * s02, half * s01), weight[m], shear, bulk, field, m)
            row += 1
