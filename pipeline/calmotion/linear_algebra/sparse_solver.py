"""Direct solver of the sparse systems of elasticity."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array
from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.linear_algebra.multifrontal import MultifrontalCholesky
from calmotion.linear_algebra.nested_dissection import dissect
from calmotion.support import interrupts


class SparseSolver:
    """A factorised symmetric positive definite matrix: `solve(b)` for b of shape [n] or [n, k].

    Args:
        matrix: Sparse, shape [n, n]. Where n is a multiple of three, its degrees of freedom are the components of
            vectors at nodes.
        points: Coordinates of the nodes, shape [n / 3, 3], for a better order of elimination.

    Raises:
        NotPositiveDefinite: The matrix is not positive definite.
    """

    def __init__(self, matrix: Any, points: Array | None = None):
        interrupts.check()
        matrix = matrix.tocsr()
        block = 3 if matrix.shape[0] % 3 == 0 else 1
        graph = _graph(matrix, block)
        self._scale = 1.0
        self._factors = MultifrontalCholesky(matrix, graph, dissect(graph, points), block)

    def scaled(self, factor: float) -> SparseSolver:
        """The solver of the matrix times a positive factor, with the same factors."""
        other = copy(self)
        other._scale = self._scale * factor
        return other

    @property
    def entries(self) -> int:
        """Number of entries of the factor."""
        return self._factors.entries

    def solve(self, b: Array) -> Array:
        """x with matrix @ x = b, both of shape [n] or [n, k]."""
        interrupts.check()  # in a thread, where no signal arrives
        columns = b.reshape(len(b), -1)
        with one_blas_thread():
            found = self._factors.solve(columns)
        found = found.reshape(b.shape)
        return found if self._scale == 1.0 else found / self._scale


def _graph(matrix: Any, block: int) -> Any:
    """Sparse CSR pattern of the blocks of a CSR matrix, shape [n / block, n / block]."""
    blocks = matrix.shape[0] // block
    row = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr)) // block
    return csr_matrix((np.ones(matrix.nnz, dtype=np.int8), (row, matrix.indices // block)), shape=(blocks, blocks))
