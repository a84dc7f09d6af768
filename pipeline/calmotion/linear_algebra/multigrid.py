"""A multigrid cycle on nested meshes: an approximate inverse of a stiffness matrix without its factors.

The matrix of the coarsest mesh is factorised. On each finer one, block Gauss-Seidel smooths the nodes near the elements
that its refinement changed; elsewhere its functions are those of the coarser one. The cycle is symmetric and positive
definite, so that conjugate gradients accept it, and reduces errors by a factor that does not grow with the number of
meshes. It works in single precision, which is twice as fast.

Source: Brandt, Multi-level Adaptive Solutions to Boundary-Value Problems, Mathematics of Computation 31, 1977; Bramble,
Pasciak, Wang and Xu, Convergence Estimates for Multigrid Algorithms without Regularity Assumptions, Mathematics of
Computation 57, 1991 (local smoothing).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, IntArray
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.support import interrupts
from calmotion.support.compilation import kernel

WIDTH = 4  # columns of a block of vectors: known to the compiler, which makes vector instructions of them
Single = NDArray[np.float32]


class Blocks:
    """A sparse symmetric matrix of 3 x 3 blocks that multiplies blocks of `WIDTH` vectors.

    Args:
        matrix: Sparse, shape [3n, 3n].
        order: Its block rows, and columns, in another order, shape [n].
    """

    def __init__(self, matrix: Any, order: IntArray | None = None):
        from scipy.sparse import bsr_matrix

        blocks: Any = bsr_matrix(matrix, blocksize=(3, 3))
        self.indptr: IntArray = blocks.indptr
        self.indices: IntArray = blocks.indices
        self.values: Array = blocks.data
        if order is not None:
            counts = np.diff(self.indptr)[order]
            ends = np.cumsum(counts)
            taken = np.arange(ends[-1]) + np.repeat(self.indptr[order] - (ends - counts), counts)
            place = np.empty_like(self.indices, shape=len(order))
            place[order] = np.arange(len(order))
            self.indptr = np.concatenate([[0], ends]).astype(self.indptr.dtype)
            self.indices, self.values = place[self.indices[taken]], self.values[taken]

    def __matmul__(self, x: Array) -> Array:
        """The product with vectors, shape [3n, WIDTH]."""
        out = np.empty_like(x)
        _multiply(self.indptr, self.indices, self.values, x.reshape(-1, 3, WIDTH), out.reshape(-1, 3, WIDTH))
        return out


def near_order(matrix: Any) -> IntArray:
    """An order of the nodes of a stiffness matrix with those that are coupled near to each other, shape [n].

    Bisection appends nodes. In another order products take half of the time with 300,000 of them.

    Args:
        matrix: Sparse, shape [3n, 3n].

    Source: Cuthill and McKee, Reducing the Bandwidth of Sparse Symmetric Matrices, 1969.
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    rows: Any = matrix[::3]
    columns = rows.indices // 3  # each three times
    n = rows.shape[0]
    graph = csr_matrix((np.ones(len(columns), dtype=np.int8), columns, rows.indptr), shape=(n, n))
    return np.asarray(reverse_cuthill_mckee(graph, symmetric_mode=True))


class Level:
    """A mesh of a multigrid cycle, finer than the one before.

    Args:
        matrix: Its stiffness.
        prolongation: Values of its n nodes from those of the m of the coarser mesh, sparse CSR, shape [n, m].
        smoothed: The nodes that are smoothed.
    """

    def __init__(self, matrix: Blocks, prolongation: Any, smoothed: IntArray):
        self.indptr, self.indices = matrix.indptr, matrix.indices
        self.values = matrix.values.astype(np.float32)
        own = np.repeat(np.arange(len(self.indptr) - 1), np.diff(self.indptr)) == self.indices
        self.inverse = np.linalg.inv(matrix.values[own]).astype(np.float32)
        self.prolongation = prolongation.astype(np.float32)
        self.restriction = self.prolongation.T.tocsr()
        self.smoothed = smoothed

    def smooth(self, b: Single, x: Single, order: IntArray) -> None:
        """Improve x, of matrix @ x = b, at the nodes in an order."""
        _smooth(self.indptr, self.indices, self.values, self.inverse, order, b, x, np.empty((3, WIDTH), np.float32))

    def residual(self, b: Single, x: Single) -> Single:
        """b - matrix @ x."""
        out = np.empty_like(x)
        _multiply(self.indptr, self.indices, self.values, x, out)
        np.subtract(b, out, out=out)
        return out


class Multigrid:
    """The cycle over a coarsest mesh and ever finer ones.

    Args:
        coarsest: Solver of its stiffness.
        levels: The finer ones.
    """

    def __init__(self, coarsest: SparseSolver, levels: list[Level]):
        self._coarsest, self._levels = coarsest, levels

    def solve(self, b: Array) -> Array:
        """Roughly x with matrix @ x = b on the finest mesh, shape [3n, WIDTH]."""
        interrupts.check()
        scale = np.maximum(np.abs(b).max(axis=0), np.finfo(float).tiny)  # single precision has few exponents
        x = self._cycle(len(self._levels), (b / scale).astype(np.float32).reshape(-1, 3, WIDTH))
        return np.asarray(x.reshape(-1, WIDTH) * scale)

    def _cycle(self, k: int, b: Single) -> Single:
        if k == 0:
            solved = self._coarsest.solve(b.reshape(-1, WIDTH).astype(float))
            return solved.astype(np.float32).reshape(-1, 3, WIDTH)
        level = self._levels[k - 1]
        x = np.zeros_like(b)
        level.smooth(b, x, level.smoothed)
        rest = level.restriction @ level.residual(b, x).reshape(len(x), -1)
        coarse = self._cycle(k - 1, rest.reshape(-1, 3, WIDTH))
        x += (level.prolongation @ coarse.reshape(len(coarse), -1)).reshape(x.shape)
        level.smooth(b, x, level.smoothed[::-1])
        return x


@kernel
def _multiply(indptr: IntArray, indices: IntArray, values: Any, x: Any, out: Any) -> None:
    """out = matrix @ x."""
    for row in range(len(indptr) - 1):
        for i in range(3):
            for v in range(WIDTH):
                out[row, i, v] = 0.0
        for k in range(indptr[row], indptr[row + 1]):
            column = indices[k]
            for i in range(3):
                for j in range(3):
                    a = values[k, i, j]
                    for v in range(WIDTH):
                        out[row, i, v] += a * x[column, j, v]


@kernel
def _smooth(
    indptr: IntArray, indices: IntArray, values: Any, inverse: Any, order: IntArray, b: Any, x: Any, rest: Any
) -> None:
    """A sweep of block Gauss-Seidel over rows in an order; `rest` is scratch of shape [3, WIDTH]."""
    for row in order:
        for i in range(3):
            for v in range(WIDTH):
                rest[i, v] = b[row, i, v]
        for k in range(indptr[row], indptr[row + 1]):
            column = indices[k]
            for i in range(3):
                for j in range(3):
                    a = values[k, i, j]
                    for v in range(WIDTH):
                        rest[i, v] -= a * x[column, j, v]
        for i in range(3):
            for j in range(3):
                a = inverse[row, i, j]
                for v in range(WIDTH):
                    x[row, i, v] += a * rest[j, v]
