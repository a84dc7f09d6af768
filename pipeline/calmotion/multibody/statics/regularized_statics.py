"""Static equations of a system whose tree may have no stiffness of its own somewhere; compiled.

At rest a hinge of the tree may be held by nothing but the loop that it is part of (a linkage in a horizontal plane, or
a balanced one), or by nothing at all (a wheel, a door): it keeps its angle then, but the tree cannot be eliminated.
Each hinge that moves freely therefore gets a weak spring that acts on what it carries, and what hangs by a ball or a
free slider in a system with loops keeps a small part of its inertia. With E the matrix of both, refinement takes them
out of the solution again,

    (K + E) x_k+1 = r + E x_k

which converges as HOLD to the squared frequencies at which it swings, and at once where loops or nothing hold it.
Weaker springs would converge faster, but a hinge without stiffness would turn so much farther than others that
redundant constraints no longer show.
"""

from __future__ import annotations

from calmotion.multibody.linear_solver.closed_chains import copy_rows, solve_system, solve_system_transposed
from calmotion.support.compilation import NO, YES, kernel

HOLD = 1e-2  # stiffness over inertia [1/s^2]
REFINED = 8  # solutions after the first: what swings once in six seconds is known to rounding, and in twenty to 1e-9
HINGE = 5  # rows of a joint that turns freely about one axis (or slides along it)


@kernel
def is_held(system):
    """Whether anything of its tree is."""
    for b in range(len(system.parent)):
        if _spring(system, b) or _inertia(system, b):
            return True
    return False


@kernel
def _spring(system, b):
    """Whether a component hangs by a free hinge."""
    return system.rows[b] == HINGE and not system.sliding[b]


@kernel
def _inertia(system, b):
    """Whether it keeps a part of its inertia."""
    free = 0 < system.rows[b] <= HINGE and not _spring(system, b)
    return free and len(system.rows) > len(system.parent)


@kernel
def _stiffness(system, D, b):
    """Of its spring: part of its inertia about the axis."""
    t = 0.0
    for i in range(3):
        for k in range(3):
            t += system.rotation[b, 1, i, 2] * D[b, 3 + i, 3 + k] * system.rotation[b, 1, k, 2]
    return HOLD * t


@kernel
def hold(system, D, K, Nc):
    """Add E to the tangents; arguments as of `system.Blocks`."""
    for b in range(len(system.parent)):
        if _spring(system, b):
            stiffness = _stiffness(system, D, b)
            for i in range(3):
                moment = stiffness * system.rotation[b, 1, i, 2]
                for k in range(3):
                    K[b, 3 + i, 3 + k] += moment * system.rotation[b, 1, k, 2]
                # the parent-side marker turns about its z axis
                Nc[b, 3 + i, 2] -= moment
        elif _inertia(system, b):
            for i in range(6 + system.elastic[b]):
                for k in range(6 + system.elastic[b]):
                    K[b, i, k] += HOLD * D[b, i, k]


@kernel
def _add_held(system, D, Jp, x, out, transposed):
    """out += E x, or E^T x; shapes [B, N]."""
    for b in range(len(system.parent)):
        p = system.side[b, 0]
        if _spring(system, b):
            turn = 0.0
            for i in range(3):
                turn += system.rotation[b, 1, i, 2] * x[b, 3 + i]
            if p >= 0 and not transposed:
                for a in range(6 + system.elastic[p]):
                    turn -= Jp[b, 2, a] * x[p, a]
            moment = _stiffness(system, D, b) * turn
            for i in range(3):
                out[b, 3 + i] += moment * system.rotation[b, 1, i, 2]
            if p >= 0 and transposed:
                for a in range(6 + system.elastic[p]):
                    out[p, a] -= Jp[b, 2, a] * moment
        elif _inertia(system, b):
            for i in range(6 + system.elastic[b]):
                for k in range(6 + system.elastic[b]):
                    out[b, i] += HOLD * D[b, i, k] * x[b, k]


@kernel
def _again(system, D, Jp, rx, rlam, x, lam, X, transposed):
    """(x, lam) <- (r + E x, rlam), by the scratch X."""
    copy_rows(rx, X)
    _add_held(system, D, Jp, x, X, transposed)
    copy_rows(X, x)
    copy_rows(rlam, lam)


@kernel
def solve_statics(
    system, D, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block, rx, rlam
):  # fmt: skip
    """`solve_system` of the static equations, by factors of what is held.

    Args:
        D: Of the blocks that were held, shape [B, N, N]; others as of `solve_system`.
        rx, rlam: Scratch, of the shapes of x and lam.
    """
    copy_rows(x, rx)
    copy_rows(lam, rlam)
    solve_system(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block)
    if is_held(system):
        for _ in range(REFINED):
            _again(system, D, Jp, rx, rlam, x, lam, X, NO)
            solve_system(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block)


@kernel
def solve_statics_transposed(
    system, D, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block, rx, rlam
):  # fmt: skip
    """The transposed equations; same arguments."""
    copy_rows(x, rx)
    copy_rows(lam, rlam)
    solve_system_transposed(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block)
    if is_held(system):
        for _ in range(REFINED):
            _again(system, D, Jp, rx, rlam, x, lam, X, YES)
            solve_system_transposed(system, Lc, Lp, Hc, Hp, Nc, Jp, lu, piv, Z, inverse, x, lam, X, tree, y, g, block)
