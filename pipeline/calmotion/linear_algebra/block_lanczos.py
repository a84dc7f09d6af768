"""Lowest eigenpairs by the block Lanczos method on the inverse, with full reorthogonalisation.

A block of vectors costs little more than one vector, because the factors are read once. A block also converges to all
modes of a multiple frequency (both bending modes of a square link), a single vector only to one of them.

Source: Golub and Underwood, The Block Lanczos Method for Computing Eigenvalues, 1977; Grimes, Lewis and Simon, A
Shifted Block Lanczos Algorithm, SIAM Journal on Matrix Analysis and Applications 15(1), 1994.
"""

from typing import Any

import numpy as np
from scipy.linalg import eigh

from calmotion.arrays import Array
from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.linear_algebra.sparse_solver import SparseSolver

_WIDTH = 8  # vectors of a block
_CONVERGED = 1e-10  # residual over the eigenvalue of the inverse; the error of the frequency is its square
_ROUNDING = 2e-15  # smallest possible residual over the largest eigenvalue of the inverse
_DEPENDENT = 1e-13  # relative norm of linearly dependent vectors
_MOST_STEPS = 200


def lowest_by_lanczos(
    K: Any, M: Any, count: int, shift: float, solver: SparseSolver, below: float | None, most: int
) -> tuple[Array, Array]:
    """Lowest eigenpairs of K x = value M x.

    Args:
        K, M: Sparse symmetric, shape [n, n], M positive definite.
        count: Number of pairs; with `below` the least number.
        solver: Of K + shift M.
        below: All eigenvalues up to this one are computed, and one above it.
        most: Largest number of pairs.

    Returns:
        Values, ascending, shape [count or more], and M-orthonormal vectors, shape [n, count or more].

    Raises:
        ArithmeticError: They do not converge.
    """
    with one_blas_thread():
        return _lanczos(K, M, count, shift, solver, below, most)


def _lanczos(
    K: Any, M: Any, count: int, shift: float, solver: SparseSolver, below: float | None, most: int
) -> tuple[Array, Array]:
    n = K.shape[0]
    width = min(_WIDTH, max(2, count // 2), n)
    # fixed, so that runs are reproducible
    start = np.random.default_rng(20190712).standard_normal((n, width))
    blocks: list[Array] = []
    block, _ = _normalized(solver.solve(M @ start), M, blocks, None)
    H = np.zeros((0, 0))
    for _ in range(_MOST_STEPS):
        blocks.append(block)
        last = block.shape[1]
        block = solver.solve(M @ block)
        column = _inner(blocks, M @ block)
        corner = column[-last:]
        H = np.block([[H, column[:-last]], [column[:-last].T, 0.5 * (corner + corner.T)]])
        block, rest = _normalized(block, M, blocks, column)
        values, vectors = np.linalg.eigh(H)
        values, vectors = values[::-1], vectors[:, ::-1]
        error = np.linalg.norm(rest @ vectors[-last:], axis=0)
        wanted = count
        if below is not None:
            wanted = min(max(count, int(np.count_nonzero(values * (below + shift) >= 1.0)) + 1), most)
        done = error[:wanted] <= _CONVERGED * values[:wanted] + _ROUNDING * values[0]
        if (len(H) >= wanted and done.all()) or block.shape[1] == 0 or len(H) == n:
            return _refined(K, M, _combined(blocks, vectors[:, :wanted]))
        block = block[:, : n - len(H)]
    raise ArithmeticError(f"{count} modes do not converge in {_MOST_STEPS} steps")


def _inner(blocks: list[Array], vectors: Array) -> Array:
    """Products of all columns of the blocks with vectors."""
    return np.vstack([block.T @ vectors for block in blocks])


def _combined(blocks: list[Array], share: Array) -> Array:
    """The blocks side by side, times `share`."""
    result, at = np.zeros((len(blocks[0]), share.shape[1])), 0
    for block in blocks:
        result += block @ share[at : at + block.shape[1]]
        at += block.shape[1]
    return result


def _normalized(W: Array, M: Any, blocks: list[Array], inner: Array | None) -> tuple[Array, Array]:
    """M-orthonormal columns of the part of W orthogonal to the blocks, and R with W = blocks (...) + columns R.

    Args:
        inner: Products of the blocks with M W; None when there are no blocks.
    """
    R = np.eye(W.shape[1])
    largest = np.sqrt(np.einsum("ij,ij->j", W, M @ W).max(initial=0.0)) if inner is None else np.abs(inner).max()
    for repetition in range(2):  # the second pass removes the rounding of the first
        if inner is not None:
            W = W - _combined(blocks, _inner(blocks, M @ W) if repetition else inner)
        MW = M @ W
        gram = W.T @ MW
        values, vectors = np.linalg.eigh(0.5 * (gram + gram.T))
        keep = values > (_DEPENDENT * largest) ** 2
        root = np.sqrt(values[keep])
        W = W @ (vectors[:, keep] / root)
        R = (root[:, None] * vectors[:, keep].T) @ R
        largest = 1.0
    return W, R


def _refined(K: Any, M: Any, modes: Array) -> tuple[Array, Array]:
    """Ritz values and vectors in the span of the modes; the error of the values is the square of that of the modes."""
    values, U = eigh(modes.T @ (K @ modes), modes.T @ (M @ modes))
    return values, modes @ U
