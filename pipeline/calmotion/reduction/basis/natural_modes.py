"""Natural frequencies and modes of the full model."""

from typing import Any

import numpy as np
from scipy.linalg import eigh

from calmotion.arrays import Array, Indices
from calmotion.linear_algebra.block_lanczos import lowest_by_lanczos
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.reduction.elements.assembly import FEModel, vector_mass

__all__ = ["SparseSolver", "clamped_modes", "lowest_modes", "vector_mass"]

_RIGID = 6  # modes of a free body without frequency
_BELOW = 0.01  # shift over the square of a frequency above the first elastic one
_DENSE = 60  # degrees of freedom up to which a dense solver is as fast


def lowest_modes(
    K: Any, M: Any, count: int, *, shift: float = 0.0, solver: SparseSolver | None = None, below: float | None = None,
    most: int | None = None, points: Array | None = None,
) -> tuple[Array, Array]:  # fmt: skip
    """Lowest eigenpairs of K x = omega^2 M x.

    Args:
        K, M: Sparse symmetric, shape [n, n]; K + shift M positive definite.
        count: Number of pairs, at most n; with `below` the least number.
        shift: [1/s^2], positive where K alone is singular.
        solver: Of K + shift M, where it is known.
        below: All pairs up to this omega^2 [1/s^2] are computed, and one above.
        most: Largest number of pairs.
        points: As of `SparseSolver`, where one is made.

    Returns:
        omega^2 [1/s^2], ascending, shape [count] (or more), and M-orthonormal modes, shape [n, count] (or more).

    Raises:
        NotPositiveDefinite: K + shift M is not.
    """
    n = K.shape[0]
    most = n if most is None else min(most, n)
    count = min(count, most)
    if count == 0 and below is None:
        return np.zeros(0), np.zeros((n, 0))
    if n <= _DENSE or 3 * count >= n:
        values, vectors = eigh(K.toarray(), M.toarray())
        if below is not None:
            count = min(max(count, int(np.count_nonzero(values <= below)) + 1), most)
        return values[:count], vectors[:, :count]
    solver = solver or SparseSolver(K + shift * M if shift else K, points)
    return lowest_by_lanczos(K, M, max(count, 1), shift, solver, below, most)


def shift_of_free(model: FEModel) -> float:
    """A shift [1/s^2] for the modes of a free body: below its first elastic mode, far above the rounding of rigid ones.

    The lowest elastic frequency of displacements that are polynomials of degree 2 is above that of the body. The
    diagonal of the matrices does not tell it: flat elements make that larger by orders of magnitude, and with such a
    shift Lanczos' method does not converge, or tells fewer than six rigid modes.

    Args:
        model: Its matrices.
    """
    x = model.mesh.nodes - model.mesh.nodes.mean(axis=0)
    x = x / max(float(np.abs(x).max()), np.finfo(float).tiny)
    i, j = np.triu_indices(3)
    terms = np.hstack([np.ones((len(x), 1)), x, x[:, i] * x[:, j]])
    fields = np.einsum("nk,cd->nckd", terms, np.eye(3)).reshape(3 * len(x), -1)
    fields, _ = np.linalg.qr(fields)  # flat bodies: some of them are nothing
    values = eigh(fields.T @ (model.stiffness @ fields), fields.T @ model.momentum(fields), eigvals_only=True)
    return _BELOW * float(values[_RIGID])


def clamped_modes(model: FEModel, count: int, clamped: Indices | None = None) -> tuple[Array, Array]:
    """Lowest elastic frequencies [Hz], shape [count], and their modes, shape [n, 3, count].

    Args:
        model: Its matrices.
        count: Number of elastic frequencies; the six rigid modes of a free body are not counted.
        clamped: Clamped nodes; None for a free body.
    """
    n = len(model.mesh.nodes)
    free = np.ones(n, dtype=bool)
    if clamped is not None and len(clamped):
        free[clamped] = False
        rigid, shift = 0, 0.0
    else:
        rigid, shift = 6, shift_of_free(model)
    K, M = model.among(np.flatnonzero(free))
    values, vectors = lowest_modes(K, M, rigid + count, shift=shift, points=model.mesh.nodes[free])
    modes = np.zeros((3 * n, vectors.shape[1]))
    modes[np.repeat(free, 3)] = vectors
    return np.sqrt(np.maximum(values[rigid:], 0.0)) / (2.0 * np.pi), modes.reshape(n, 3, -1)[:, :, rigid:]
