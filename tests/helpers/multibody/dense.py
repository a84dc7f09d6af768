"""The whole step matrix written out, for tests: all components' coordinates, then all joints' multipliers."""

import numpy as np


def offsets(system):
    return np.concatenate([[0], np.cumsum(6 + system.elastic)])


def size(system):
    return offsets(system)[-1] + 6 * len(system.rows)


def multipliers(system, joint):
    start = offsets(system)[-1] + 6 * joint
    return slice(start, start + 6)


def constrains(system):
    """Which rows of the joints are constraints, shape [J, 6]; a free slider has none along its axis."""
    found = np.arange(6) < system.rows[:, None]
    found[free_sliders(system)] = np.arange(6) != 2
    return found


def free_sliders(system):
    return (system.sliding > 0) & (system.rows == 5)


def condense(system, A):
    """Take the lengths of free sliders, which the matrix holds in place of multipliers, out of it."""
    A = A.copy()
    for joint in np.flatnonzero(free_sliders(system)):
        at = multipliers(system, joint).start + 2
        A -= np.outer(A[:, at], A[at])
        A[at], A[:, at] = 0.0, 0.0
    return A


def dense_matrix(system, blocks):
    off = offsets(system)
    A = np.zeros((size(system), size(system)))
    for b, r in enumerate(system.elastic):
        x = slice(off[b], off[b] + 6 + r)
        A[x, x] = blocks.K[b, : 6 + r, : 6 + r]
    for joint, (p, b) in enumerate(system.side):
        n = 6 + system.elastic[b]
        x, m = slice(off[b], off[b] + n), multipliers(system, joint)
        A[x, m] = blocks.Lc[joint, :n]
        A[m, x] = blocks.Hc[joint, :, :n]
        if p >= 0:
            np_ = 6 + system.elastic[p]
            px = slice(off[p], off[p] + np_)
            A[px, m] = blocks.Lp[joint, :np_]
            A[m, px] = blocks.Hp[joint, :, :np_]
            A[x, px] += blocks.Nc[joint, :n] @ blocks.Jp[joint, :, :np_]
    return A


def split(system, vector):
    """A dense vector as (x, lam) of the kernels."""
    off = offsets(system)
    x, lam = np.zeros((len(system.parent), system.size)), np.zeros((len(system.rows), 6))
    for b in range(len(system.parent)):
        x[b, : 6 + system.elastic[b]] = vector[off[b] : off[b + 1]]
    lam[:] = vector[off[-1] :].reshape(-1, 6)
    return x, lam


def join(system, x, lam):
    return np.concatenate([*(x[b, : 6 + r] for b, r in enumerate(system.elastic)), lam.ravel()])
