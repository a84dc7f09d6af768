"""Static equations of a system with loops, whose tree may have no stiffness of its own; compiled.

At rest a hinge of the tree may be held by nothing but the loop that it is part of: a linkage in a horizontal plane, or
a balanced one. The whole system is regular then, but its tree cannot be eliminated. The tree therefore keeps a small
part of its inertia, K + HOLD D, and refinement takes that out of the solution again,

    (K + HOLD D) x_k+1 = r + HOLD D x_k

which converges as HOLD to the squared frequencies at which it swings, and at once where loops hold it. A smaller one
would converge faster, but a hinge without stiffness would turn so much farther than others that redundant
constraints no longer show.
"""

from __future__ import annotations

from ..kernels import kernel
from .loops import copy_rows, solve_system, solve_system_transposed

HOLD = 1e-2  # [1/s^2]
REFINED = 8  # solutions after the first: what swings once in six seconds is known to rounding, and in twenty to 1e-9


@kernel
def hold(system, D, K):
    """K += HOLD D where there are loops; both of shape [B, N, N]."""
    if len(system.rows) == len(system.parent):
        return
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            for k in range(6 + system.elastic[b]):
                K[b, i, k] += HOLD * D[b, i, k]


@kernel
def _held(system, D, rx, rlam, x, lam, X):
    """(x, lam) <- (r + HOLD D x, rlam), by the scratch X."""
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            t = rx[b, i]
            for k in range(6 + system.elastic[b]):
                t += HOLD * D[b, i, k] * x[b, k]
            X[b, i] = t
    copy_rows(X, x)
    copy_rows(rlam, lam)


@kernel
def solve_statics(
    system, D, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block, rx, rlam
):  # fmt: skip
    """`solve_system` of the static equations, by factors of what is held.

    Args:
        D: Blocks that `hold` added, shape [B, N, N]; others as of `solve_system`.
        rx, rlam: Scratch, of the shapes of x and lam.
    """
    copy_rows(x, rx)
    copy_rows(lam, rlam)
    solve_system(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block)
    if len(system.rows) > len(system.parent):
        for _ in range(REFINED):
            _held(system, D, rx, rlam, x, lam, X)
            solve_system(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block)


@kernel
def solve_statics_transposed(
    system, D, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block, rx, rlam
):  # fmt: skip
    """The transposed equations, D being symmetric; same arguments."""
    copy_rows(x, rx)
    copy_rows(lam, rlam)
    solve_system_transposed(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block)
    if len(system.rows) > len(system.parent):
        for _ in range(REFINED):
            _held(system, D, rx, rlam, x, lam, X)
            solve_system_transposed(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block)
