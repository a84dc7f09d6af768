"""Static equations of a system whose tree has no stiffness of its own somewhere, regularised; compiled.

At rest a hinge of the tree may have no other support than the closed chain that it is part of (a linkage in a
horizontal plane, or a balanced one), or none at all (a wheel, a door): it keeps its angle then, but the tree cannot be
eliminated. Each hinge that moves freely therefore gets a weak spring that acts on the component that it carries, and a
component on a ball joint or a free slider in a system with closed chains keeps a small fraction of its inertia. With E
the matrix of both, iterative refinement removes them from the solution,

    (K + E) x_k+1 = r + E x_k

which converges as REGULARIZATION to the squared angular frequencies at which the hinge swings, and at once where
closed chains or nothing support it. Weaker springs would converge faster, but a hinge without stiffness would rotate
so much farther than others that redundant constraints could not be detected.
"""

from __future__ import annotations

from calmotion.multibody.linear_solver.closed_chains import copy_rows, solve_system, solve_system_transposed
from calmotion.multibody.linear_solver.step_matrix import SolutionScratch, StepMatrix
from calmotion.multibody.model.system import System
from calmotion.shot.character import Array
from calmotion.support.compilation import NO, YES, kernel, shared_kernel

REGULARIZATION = 1e-2  # stiffness over inertia [1/s^2]
REFINEMENTS = 8  # solutions after the first: exact to rounding for a period of six seconds, to 1e-9 for twenty
HINGE = 5  # rows of a joint that rotates freely about one axis (or slides along it)


@kernel
def is_regularized(system: System) -> bool:
    """Whether any component of the tree is."""
    for b in range(len(system.parent)):
        if _spring(system, b) or _inertia(system, b):
            return True
    return False


@kernel
def _spring(system: System, b: int) -> bool:
    """Whether a component is carried by a free hinge."""
    return system.rows[b] == HINGE and not system.sliding[b]


@kernel
def _inertia(system: System, b: int) -> bool:
    """Whether it keeps a fraction of its inertia."""
    free = 0 < system.rows[b] <= HINGE and not _spring(system, b)
    return free and len(system.rows) > len(system.parent)


@kernel
def _stiffness(system: System, D: Array, b: int) -> float:
    """Of its spring: a fraction of its inertia about the axis."""
    t = 0.0
    for i in range(3):
        for k in range(3):
            t += system.rotation[b, 1, i, 2] * D[b, 3 + i, 3 + k] * system.rotation[b, 1, k, 2]
    return REGULARIZATION * t


@kernel
def regularize(system: System, D: Array, K: Array, Nc: Array) -> None:
    """Add E to the tangents; arguments as of `system.Blocks`."""
    for b in range(len(system.parent)):
        if _spring(system, b):
            stiffness = _stiffness(system, D, b)
            for i in range(3):
                moment = stiffness * system.rotation[b, 1, i, 2]
                for k in range(3):
                    K[b, 3 + i, 3 + k] += moment * system.rotation[b, 1, k, 2]
                # the parent-side marker rotates about its z axis
                Nc[b, 3 + i, 2] -= moment
        elif _inertia(system, b):
            for i in range(6 + system.elastic[b]):
                for k in range(6 + system.elastic[b]):
                    K[b, i, k] += REGULARIZATION * D[b, i, k]


@kernel
def _add_regularization(system: System, D: Array, Jp: Array, x: Array, out: Array, transposed: bool) -> None:
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
                    out[b, i] += REGULARIZATION * D[b, i, k] * x[b, k]


@kernel
def _refine(
    system: System, D: Array, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch, transposed: bool
) -> None:
    """(x, lam) <- (r + E x, r_lam), the right-hand side of the next refinement."""
    copy_rows(scratch.right, scratch.X)
    _add_regularization(system, D, matrix.Jp, x, scratch.X, transposed)
    copy_rows(scratch.X, x)
    copy_rows(scratch.right_lam, lam)


@shared_kernel
def solve_statics(system: System, D: Array, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch) -> None:
    """`solve_system` of the static equations, by factors of the regularised ones.

    Args:
        D: Of the blocks that were regularised, shape [B, N, N].
    """
    copy_rows(x, scratch.right)
    copy_rows(lam, scratch.right_lam)
    solve_system(system, matrix, x, lam, scratch)
    if is_regularized(system):
        for _ in range(REFINEMENTS):
            _refine(system, D, matrix, x, lam, scratch, NO)
            solve_system(system, matrix, x, lam, scratch)


@shared_kernel
def solve_statics_transposed(
    system: System, D: Array, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch
) -> None:
    """The transposed equations; same arguments."""
    copy_rows(x, scratch.right)
    copy_rows(lam, scratch.right_lam)
    solve_system_transposed(system, matrix, x, lam, scratch)
    if is_regularized(system):
        for _ in range(REFINEMENTS):
            _refine(system, D, matrix, x, lam, scratch, YES)
            solve_system_transposed(system, matrix, x, lam, scratch)
