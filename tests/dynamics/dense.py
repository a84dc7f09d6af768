"""The whole step matrix written out, for tests."""

import numpy as np


def offsets(system):
    return np.concatenate([[0], np.cumsum(12 + system.elastic)])


def dense_matrix(system, blocks):
    off = offsets(system)
    A = np.zeros((off[-1], off[-1]))
    for b, p in enumerate(system.parent):
        o, n = off[b], 6 + system.elastic[b]
        x, m = slice(o, o + n), slice(o + n, o + n + 6)
        A[x, x] = blocks.K[b, :n, :n]
        A[x, m] = blocks.Lc[b, :n]
        A[m, x] = blocks.Hc[b, :, :n]
        if p >= 0:
            np_ = 6 + system.elastic[p]
            px = slice(off[p], off[p] + np_)
            A[px, m] = blocks.Lp[b, :np_]
            A[m, px] = blocks.Hp[b, :, :np_]
            A[x, px] = blocks.Nc[b, :n] @ blocks.Jp[b, :, :np_]
    return A


def split(system, vector):
    """A dense vector as (x, lam) of the kernels."""
    off = offsets(system)
    x, lam = np.zeros((len(system.parent), system.size)), np.zeros((len(system.parent), 6))
    for b in range(len(system.parent)):
        n = 6 + system.elastic[b]
        x[b, :n], lam[b] = vector[off[b] : off[b] + n], vector[off[b] + n : off[b + 1]]
    return x, lam


def join(system, x, lam):
    parts = [np.concatenate([x[b, : 6 + r], lam[b]]) for b, r in enumerate(system.elastic)]
    return np.concatenate(parts)
