"""Green strains of modes and of pairs of directions at quadrature points; compiled."""

from __future__ import annotations

from calmotion.support.compilation import kernel


@kernel
def _stored(s00, s11, s22, s12, s02, s01, weight, shear, bulk, out, m):
    """A strain as six numbers whose squares add up to its energy density, times the weight of the point."""
    trace = bulk * (s00 + s11 + s22)
    out[0, m] = weight * (shear * s00 + trace)
    out[1, m] = weight * (shear * s11 + trace)
    out[2, m] = weight * (shear * s22 + trace)
    twice = weight * shear * 2.0**0.5
    out[3, m] = twice * s12
    out[4, m] = twice * s02
    out[5, m] = twice * s01


@kernel
def green_fields(G, turns, weight, shear, bulk, out):
    """sym(G_k) of every mode, then sym(A_k^T A_l) of the pairs k <= l of directions, halved where k is l.

    Args:
        G, turns: Displacement gradients of r modes and p directions, row by row, shapes [r, 9, n] and [p, 9, n].
        weight: Square roots of the points' weights [m^1.5], shape [n].
        shear, bulk: The energy density of a strain E is |shear E + bulk tr(E) 1|^2 / 2.
        out: Fields, shape [r + p (p + 1) / 2, 6, n]: the inner product of two is their energy's.
    """
    r, p, n = len(G), len(turns), len(weight)
    for k in range(r):
        g, own = G[k], out[k]
        for m in range(n):
            _stored(
                g[0, m], g[4, m], g[8, m], 0.5 * (g[5, m] + g[7, m]), 0.5 * (g[2, m] + g[6, m]),
                0.5 * (g[1, m] + g[3, m]), weight[m], shear, bulk, own, m,
            )  # fmt: skip
    row = r
    for k in range(p):
        a = turns[k]
        for l in range(k, p):
            b, own = turns[l], out[row]
            once = 0.5 if k == l else 1.0
            half = 0.5 * once
            for m in range(n):
                s12 = a[1, m] * b[2, m] + a[4, m] * b[5, m] + a[7, m] * b[8, m]
                s12 += b[1, m] * a[2, m] + b[4, m] * a[5, m] + b[7, m] * a[8, m]
                s02 = a[0, m] * b[2, m] + a[3, m] * b[5, m] + a[6, m] * b[8, m]
                s02 += b[0, m] * a[2, m] + b[3, m] * a[5, m] + b[6, m] * a[8, m]
                s01 = a[0, m] * b[1, m] + a[3, m] * b[4, m] + a[6, m] * b[7, m]
                s01 += b[0, m] * a[1, m] + b[3, m] * a[4, m] + b[6, m] * a[7, m]
                _stored(
                    once * (a[0, m] * b[0, m] + a[3, m] * b[3, m] + a[6, m] * b[6, m]),
                    once * (a[1, m] * b[1, m] + a[4, m] * b[4, m] + a[7, m] * b[7, m]),
                    once * (a[2, m] * b[2, m] + a[5, m] * b[5, m] + a[8, m] * b[8, m]),
                    half * s12, half * s02, half * s01, weight[m], shear, bulk, own, m,
                )  # fmt: skip
            row += 1
