"""A dense approximation of the Gauss-Newton matrix as a preconditioner."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csr_matrix, identity, kron

from calmotion.arrays import Array, BoolArray
from calmotion.retargeting.solver.preconditioner import BandedGram

_LEAST = 1e-12  # of the largest diagonal entry, added to all: the factor exists for directions that move no target


class DensePreconditioner:
    """Cholesky factor of a matrix over all unknowns, plus the terms of the limits.

    Args:
        gram: Matrix of the squared residuals, shape [P * m, P * m].
        penalty: Matrix of the regulariser for one motor, shape [P, P].
        wraps: Whether the functions are periodic.
    """

    def __init__(self, gram: Array, penalty: csr_matrix, wraps: bool):
        motors = len(gram) // penalty.shape[0]
        self._shape = penalty.shape[0], motors, wraps
        self._matrix = for_each_motor(penalty, motors)
        self._matrix += gram

    def factor(
        self, fixed: BoolArray, terms: list[tuple[csr_matrix, Array]] | None = None, rows: Array | None = None
    ) -> None:
        """Factorise with the unknowns where `fixed` (shape [P * m], bool) is true excluded.

        Args:
            terms: As of `BandedPreconditioner.factor`.
            rows: Further ones, of which the squares are added, shape [r, P * m].
        """
        matrix = self._matrix.copy() if rows is None else self._matrix + rows.T @ rows
        if terms:
            add_terms(matrix, self._shape, terms)
        matrix[fixed, :] = 0.0
        matrix[:, fixed] = 0.0
        diagonal = np.einsum("ii->i", matrix)
        diagonal += _LEAST * float(np.max(diagonal))
        diagonal[fixed] = 1.0
        self._factor = cho_factor(matrix, lower=True, overwrite_a=True, check_finite=False)

    def solve(self, x: Array) -> Array:
        """The factor's inverse applied to a vector of shape [P * m]."""
        return np.asarray(cho_solve(self._factor, x, check_finite=False))


def for_each_motor(matrix: csr_matrix, motors: int) -> Array:
    """A matrix over the functions, shape [P, P], as one over all unknowns, the same for each motor."""
    return np.asarray(kron(matrix, identity(motors)).toarray())


def add_terms(matrix: Array, shape: tuple[int, int, bool], terms: list[tuple[csr_matrix, Array]]) -> None:
    """Add terms of limits to a matrix over all unknowns.

    Args:
        matrix: Shape [P * m, P * m].
        shape, terms: As of `BandedPreconditioner`.
    """
    gram = BandedGram(*shape)
    for basis, metric in terms:
        gram.add(basis, metric)
    _add_banded(gram, matrix)


def _add_banded(gram: BandedGram, matrix: Array) -> None:
    """Add a banded matrix to a dense one, both triangles."""
    order, banded = gram.order, gram.banded()
    for d, band in enumerate(banded):
        rows, columns = order[d:], order[: len(order) - d]
        matrix[rows, columns] += band[: len(columns)]
        if d:
            matrix[columns, rows] += band[: len(columns)]
