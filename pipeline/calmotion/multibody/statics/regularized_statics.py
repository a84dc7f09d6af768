"""Static equations of a system whose tree has no stiffness of its own somewhere, regularised; compiled.

At rest a joint that moves freely may have no other support than the closed chain that it is part of (a linkage in a
horizontal plane, or a balanced one), or none at all (a wheel, a door, a carriage on a level rail): it keeps its angle
or length then, but the tree cannot be eliminated. Each free hinge and slider therefore gets a weak spring that acts on
the component that it carries, against the motion relative to its parent; on a ball joint the spring acts against the
rotation of the component, on one that floats (and that contacts hold) against its translation, too. With E the matrix
of the springs, iterative refinement removes them from the solution,

    (K + E) x_k+1 = r + E x_k

which converges as REGULARIZATION to the squared angular frequencies at which the joint swings, and at once where
closed chains or nothing support it. Weaker springs would converge faster, but a hinge without stiffness would rotate
so much farther than others that redundant constraints could not be detected.
"""

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.kernels.sliders import LENGTH, slides_freely
from calmotion.multibody.linear_solver.closed_chains import copy_rows, solve_system, solve_system_transposed
from calmotion.multibody.linear_solver.step_matrix import SolutionScratch, StepMatrix
from calmotion.multibody.model.system import System
from calmotion.support.compilation import NO, YES, kernel, shared_kernel

REGULARIZATION = 1e-2  # stiffness over inertia [1/s^2]
REFINEMENTS = 8  # solutions after the first: exact to rounding for a period of six seconds, to 1e-9 for twenty
KRYLOV = 40  # most solutions of `without_regularization`
INVARIANT = 1e-13  # of a unit vector, that may lie outside of the space that it spans
LEAST_STIFFNESS = 1e-7  # of a joint over that of its weak spring, down to which the joint moves by its own
LARGEST_TURN = 0.5  # of a joint in one correction [rad]
ROUNDING_LOAD = 1e-13  # of a weak spring over the weight of all bodies, that rounding may have left
HINGE, BALL = 5, 3  # rows of a joint that rotates freely about one axis (or slides along it), and of a ball joint


@kernel
def is_regularized(system: System) -> bool:
    """Whether any component of the tree is."""
    for b in range(len(system.parent)):
        if _hinge(system, b) or _ball(system, b) or slides_freely(system, b) or system.rows[b] == 0:
            return True
    return False


@kernel
def _hinge(system: System, b: int) -> bool:
    """Whether a component is carried by a free hinge."""
    return system.rows[b] == HINGE and not system.sliding[b]


@kernel
def _ball(system: System, b: int) -> bool:
    """Whether it is carried by a ball joint."""
    ball: bool = system.rows[b] == BALL
    return ball


@kernel
def regularize(system: System, K: Array, Lc: Array, Nc: Array) -> None:
    """Add E to the tangents; arguments as of `system.Blocks`."""
    for b in range(len(system.parent)):
        stiffness = REGULARIZATION * system.held[b]
        if _hinge(system, b):
            for i in range(3):
                moment = stiffness * system.rotation[b, 1, i, 2]
                for k in range(3):
                    K[b, 3 + i, 3 + k] += moment * system.rotation[b, 1, k, 2]
                # the parent-side marker rotates about its z axis
                Nc[b, 3 + i, 2] -= moment
        elif _ball(system, b):
            for i in range(3):
                K[b, 3 + i, 3 + i] += stiffness
        elif system.rows[b] == 0:
            for i in range(3):
                K[b, i, i] += REGULARIZATION * system.mass[b]
                K[b, 3 + i, 3 + i] += stiffness
        elif slides_freely(system, b):
            # the length is an unknown of its own
            for i in range(3):
                Lc[b, i, LENGTH] += stiffness * system.rotation[b, 1, i, 2]


@kernel
def _add_regularization(
    system: System, Jp: Array, x: Array, lam: Array, out: Array, out_lam: Array, transposed: bool
) -> None:
    """(out, out_lam) += E (x, lam), or with E^T; shapes [B, N] and [J, 6]."""
    for b in range(len(system.parent)):
        p = system.side[b, 0]
        stiffness = REGULARIZATION * system.held[b]
        if _hinge(system, b):
            turn = 0.0
            for i in range(3):
                turn += system.rotation[b, 1, i, 2] * x[b, 3 + i]
            if p >= 0 and not transposed:
                for a in range(6 + system.elastic[p]):
                    turn -= Jp[b, 2, a] * x[p, a]
            moment = stiffness * turn
            for i in range(3):
                out[b, 3 + i] += moment * system.rotation[b, 1, i, 2]
            if p >= 0 and transposed:
                for a in range(6 + system.elastic[p]):
                    out[p, a] -= Jp[b, 2, a] * moment
        elif _ball(system, b):
            for i in range(3):
                out[b, 3 + i] += stiffness * x[b, 3 + i]
        elif system.rows[b] == 0:
            for i in range(3):
                out[b, i] += REGULARIZATION * system.mass[b] * x[b, i]
                out[b, 3 + i] += stiffness * x[b, 3 + i]
        elif slides_freely(system, b):
            for i in range(3):
                if transposed:
                    out_lam[b, LENGTH] += stiffness * system.rotation[b, 1, i, 2] * x[b, i]
                else:
                    out[b, i] += stiffness * system.rotation[b, 1, i, 2] * lam[b, LENGTH]


@kernel
def _refine(
    system: System, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch, transposed: bool
) -> None:
    """(x, lam) <- (r, r_lam) + E (x, lam), the right-hand side of the next refinement."""
    copy_rows(scratch.right, scratch.X)
    copy_rows(scratch.right_lam, scratch.lam)
    _add_regularization(system, matrix.Jp, x, lam, scratch.X, scratch.lam, transposed)
    copy_rows(scratch.X, x)
    copy_rows(scratch.lam, lam)


@shared_kernel
def solve_statics(system: System, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch) -> None:
    """`solve_system` of the static equations, by factors of the regularised ones."""
    copy_rows(x, scratch.right)
    copy_rows(lam, scratch.right_lam)
    solve_system(system, matrix, x, lam, scratch)
    if is_regularized(system):
        for _ in range(REFINEMENTS):
            _refine(system, matrix, x, lam, scratch, NO)
            solve_system(system, matrix, x, lam, scratch)


@shared_kernel
def solve_statics_transposed(
    system: System, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch
) -> None:
    """The transposed equations; same arguments."""
    copy_rows(x, scratch.right)
    copy_rows(lam, scratch.right_lam)
    solve_system_transposed(system, matrix, x, lam, scratch)
    if is_regularized(system):
        for _ in range(REFINEMENTS):
            _refine(system, matrix, x, lam, scratch, YES)
            solve_system_transposed(system, matrix, x, lam, scratch)


def without_regularization(
    system: System, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch
) -> tuple[Array, Array]:
    """A correction that descends by what K says, from that of (K + E) (x, lam) = r.

    Refinement takes as many solutions as a joint's stiffness is smaller than its spring: a million for a rod between
    two ball joints whose centre of mass lies 1e-10 m off its axis. (K + E)^-1 K is the identity but for the joints that
    the springs hold, so that an Arnoldi process from x (Saad, Iterative Methods for Sparse Linear Systems, 2003,
    section 6.3) has the whole of it in about one solution for each different stiffness of theirs. Each part of x in an
    eigenvector is divided by the absolute eigenvalue, as a negative one is that of a centre of mass above its joint
    (Dauphin et al., Advances in Neural Information Processing Systems 27, 2014).

    Returns:
        The correction, shaped as x and lam; no part of it turns a joint by more than half a radian.
    """
    size = np.linalg.norm(_weighted(system, x))
    basis, weighted = [(x / size, lam / size)], [_weighted(system, x / size)]
    H = np.zeros((KRYLOV + 1, KRYLOV))
    for k in range(KRYLOV):
        moved, moved_lam = np.zeros_like(x), np.zeros_like(lam)
        _add_regularization(system, matrix.Jp, *basis[k], moved, moved_lam, NO)
        solve_system(system, matrix, moved, moved_lam, scratch)
        left, left_lam = basis[k][0] - moved, basis[k][1] - moved_lam
        for row in [*range(k + 1)] * 2:
            part = float(weighted[row] @ _weighted(system, left))
            H[row, k] += part
            left, left_lam = left - part * basis[row][0], left_lam - part * basis[row][1]
        H[k + 1, k] = np.linalg.norm(_weighted(system, left))
        if H[k + 1, k] < INVARIANT:
            break
        basis.append((left / H[k + 1, k], left_lam / H[k + 1, k]))
        weighted.append(_weighted(system, basis[-1][0]))
    values, vectors = np.linalg.eig(H[: k + 1, : k + 1])
    shares = size * np.linalg.pinv(vectors)[:, 0] / np.maximum(np.abs(values), LEAST_STIFFNESS)
    turns = np.abs(np.array(weighted[: k + 1]).T @ (vectors * shares)).max(axis=0)
    parts = np.real(vectors @ (shares * LARGEST_TURN / np.maximum(turns, LARGEST_TURN)))
    used = basis[: k + 1]
    return (
        np.einsum("k,kbi->bi", parts, np.array([part for part, _ in used])),
        np.einsum("k,kji->ji", parts, np.array([part for _, part in used])),
    )


def _weighted(system: System, x: Array) -> Array:
    """A correction in `System.unit`, as one row; without the entries that its component does not have."""
    used = np.arange(x.shape[1]) < 6 + system.elastic[:, None]
    weighted: Array = np.where(used, x / system.unit, 0.0).ravel()
    return weighted


def moves_nothing(
    system: System, matrix: StepMatrix, x: Array, lam: Array, scratch: SolutionScratch, tolerance: float
) -> bool:
    """Whether the solution of (K + E) (x, lam) = r is a motion of free joints that K does not feel, under loads that
    are rounding: it changes nothing but the pose of these joints.

    Args:
        tolerance: Of what K feels of it, (K + E)^-1 K x, in `System.unit`.
    """
    load, load_lam = np.zeros_like(x), np.zeros_like(lam)
    _add_regularization(system, matrix.Jp, x, lam, load, load_lam, NO)
    weight = system.mass.sum() * np.linalg.norm(system.gravity)
    if np.abs(_loads(system, load)).max(initial=0.0) > ROUNDING_LOAD * weight:
        return False
    solve_system(system, matrix, load, load_lam, scratch)
    return bool(np.abs(_weighted(system, x - load)).max(initial=0.0) < tolerance)


def _loads(system: System, load: Array) -> Array:
    """Forces, and moments over a length of the mechanism [N]."""
    loads: Array = load / np.where(np.arange(load.shape[1]) < 3, 1.0, system.unit[0, 0])
    return loads
