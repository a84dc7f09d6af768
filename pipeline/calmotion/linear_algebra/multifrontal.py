"""Sparse Cholesky factors as a tree of dense blocks, by BLAS and LAPACK on all cores.

The elimination of a piece of the nested dissection involves the piece and its border: the nodes of pieces above it to
which the elimination has connected it. Their dense matrix (the front) is the sum of the entries of the matrix and of
the Schur complements of the pieces below. All work is on dense blocks, at the speed of matrix products.

Source: Duff and Reid, The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations, ACM Transactions on
Mathematical Software 9(3), 1983; Liu, The Multifrontal Method for Sparse Matrix Solution, SIAM Review 34(1), 1992.
"""

from typing import Any

import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.linear_algebra.nested_dissection import Dissection
from calmotion.support.compilation import kernel
from calmotion.support.memory import available_memory

_OF_AN_ENTRY = 12.0  # bytes: the number itself, and the complements, 0.16 to 0.37 times as many


class FactorsTooLarge(ShotError):
    """The factors of a matrix would not fit into the memory that this process can take."""


class NotPositiveDefinite(ArithmeticError):
    """A matrix has no Cholesky factors: a body with a rigid motion, or numbers that are not finite."""


@kernel
def _add_triangle(target: Array, update: Array, first: int, at: Array) -> None:
    """target[at[i], at[j]] += update[first + i, first + j] for i >= j."""
    for j in range(len(at)):
        for i in range(j, len(at)):
            target[at[i], at[j]] += update[first + i, first + j]


@kernel
def _add_block(target: Array, update: Array, split: int, at: Array) -> None:
    """target[at[i], at[j]] += update[i, j] for j < split <= i."""
    for j in range(split):
        for i in range(split, len(at)):
            target[at[i], at[j]] += update[i, j]


class _Complements:
    """Schur complements between the elimination of a piece and that of the piece above it.

    Pieces are eliminated in postorder, so the complements form stacks: one of pieces at even depth and one of pieces at
    odd depth. A complement is therefore never in the same stack as those that it is computed from.
    """

    def __init__(self, parent: Any, outer: Any):
        self._outer = outer
        self._children: list[list[int]] = [[] for _ in parent]
        depth = np.zeros(len(parent), dtype=np.int64)
        for k in range(len(parent) - 1, -1, -1):
            if parent[k] >= 0:
                self._children[parent[k]].insert(0, k)
                depth[k] = depth[parent[k]] + 1
        self._odd = depth % 2
        top, most = [0, 0], [0, 0]
        for k, odd in enumerate(self._odd):
            top[odd] += int(outer[k]) ** 2
            most[odd] = max(most[odd], top[odd])
            top[1 - odd] -= sum(int(outer[j]) ** 2 for j in self._children[k])
        self._stacks = [np.empty(size) for size in most]
        self._top = [0, 0]

    def below(self, k: int) -> list[int]:
        """The children of a piece, last first."""
        return self._children[k][::-1]

    def push(self, k: int) -> Array:
        """A zero matrix for the complement of a piece, shape [outer, outer]."""
        odd, m = self._odd[k], int(self._outer[k])
        self._top[odd] += m * m
        complement = self._stacks[odd][self._top[odd] - m * m : self._top[odd]].reshape((m, m), order="F")
        complement[...] = 0.0
        return np.asarray(complement)

    def pop(self, k: int) -> Array:
        """The last complement of this depth, valid until the next push."""
        odd, m = self._odd[k], int(self._outer[k])
        self._top[odd] -= m * m
        return np.asarray(self._stacks[odd][self._top[odd] : self._top[odd] + m * m].reshape((m, m), order="F"))


class MultifrontalCholesky:
    """Factors L L^T of a permuted symmetric positive definite matrix.

    Args:
        matrix: Sparse, shape [n, n]; only its lower triangle is read.
        graph: Sparse CSR pattern of its blocks, shape [n / block, n / block].
        dissection: Of the graph.
        block: Degrees of freedom of a node of the graph.

    Raises:
        NotPositiveDefinite: The matrix is not positive definite.
        FactorsTooLarge: There is not enough memory for them.
    """

    def __init__(self, matrix: Any, graph: Any, dissection: Dissection, block: int):
        order = dissection.order
        self._order = expand(order, block)
        self._start = block * dissection.start
        self._borders = [expand(b, block) for b in _borders(graph[order][:, order].tocsr(), dissection)]
        size = np.diff(self._start)
        outer = np.array([len(border) for border in self._borders], dtype=np.int64)
        # one array for all blocks: the system then uses large pages
        offset = np.concatenate([[0], np.cumsum(size * (size + outer))])
        self.entries = int(offset[-1])
        _require_memory(self.entries, len(order))
        self._factors = np.zeros(self.entries)
        self._diagonal, self._below = [], []
        for at, k, m in zip(offset[:-1], size, outer, strict=True):
            self._diagonal.append(self._factors[at : at + k * k].reshape((k, k), order="F"))
            self._below.append(self._factors[at + k * k : at + k * (k + m)].reshape((m, k), order="F"))
        with one_blas_thread():
            self._factor(matrix.tocsr()[self._order][:, self._order].tocsc(), dissection.parent, outer)

    def _factor(self, A: Any, parent: Any, outer: Any) -> None:
        complements = _Complements(parent, outer)
        place = np.zeros(A.shape[0], dtype=np.int64)
        for k, border in enumerate(self._borders):
            s, e = int(self._start[k]), int(self._start[k + 1])
            F11, F21 = self._diagonal[k], self._below[k]
            place[s:e] = np.arange(e - s)
            place[border] = np.arange(len(border))
            entries = slice(A.indptr[s], A.indptr[e])
            row, value = A.indices[entries], A.data[entries]
            column = np.repeat(np.arange(e - s), np.diff(A.indptr[s : e + 1]))
            inside, below = (row >= s) & (row < e), row >= e
            F11[place[row[inside]], column[inside]] = value[inside]
            F21[place[row[below]], column[below]] = value[below]
            F22 = complements.push(k)
            for piece in complements.below(k):
                rows, update = self._borders[piece], complements.pop(piece)
                split = int(np.searchsorted(rows, e))
                at = place[rows]
                _add_triangle(F11, update, 0, at[:split])
                _add_block(F21, update, split, at)
                _add_triangle(F22, update, split, at[split:])
            # the results overwrite the arguments, which are contiguous in Fortran order
            _, info = dpotrf(F11, lower=1, clean=0, overwrite_a=1)
            # OpenBLAS does not report NaN
            if info != 0 or not np.isfinite(F11.diagonal()).all():
                raise NotPositiveDefinite("the matrix is not positive definite")
            if len(border):
                dtrsm(1.0, F11, F21, side=1, lower=1, trans_a=1, overwrite_b=1)
                dsyrk(-1.0, F21, beta=1.0, c=F22, lower=1, overwrite_c=1)

    def solve(self, b: Array) -> Array:
        """x with matrix @ x = b, b of shape [n, k]."""
        x = np.ascontiguousarray(b[self._order], dtype=float)
        pieces = list(zip(self._start[:-1], self._start[1:], self._borders, self._diagonal, self._below, strict=True))
        for s, e, border, L11, L21 in pieces:
            dtrsm(1.0, L11, x[s:e].T, side=1, lower=1, trans_a=1, overwrite_b=1)
            if len(border):
                x[border] -= L21 @ x[s:e]
        for s, e, border, L11, L21 in reversed(pieces):
            if len(border):
                x[s:e] -= L21.T @ x[border]
            dtrsm(1.0, L11, x[s:e].T, side=1, lower=1, overwrite_b=1)
        out = np.empty_like(x)
        out[self._order] = x
        return out


def _require_memory(entries: int, nodes: int) -> None:
    needed, free = _OF_AN_ENTRY * entries, available_memory()
    if needed > free:
        raise FactorsTooLarge(
            f"there is not enough memory for a mesh of {nodes} nodes",
            attribute="calm:flexible:elementSize",
            found=f"{needed / 1e9:.1f} GB are needed, {free / 1e9:.1f} GB can be taken",
            remedy="Author a larger calm:flexible:elementSize, end other programs, or use a machine with more memory.",
        )


def _borders(graph: Any, dissection: Dissection) -> list[Any]:
    """For each piece the later nodes to which the elimination connects it, ascending; graph in order of elimination."""
    borders: list[Any] = []
    from_below: list[list[Any]] = [[] for _ in dissection.parent]
    for k, above in enumerate(dissection.parent):
        s, e = dissection.start[k], dissection.start[k + 1]
        near = np.unique(np.concatenate([graph.indices[graph.indptr[s] : graph.indptr[e]], *from_below[k]]))
        border = near[near >= e]
        borders.append(border)
        from_below[k] = []
        if above >= 0:
            from_below[above].append(border)
    return borders


def expand(nodes: Any, block: int) -> Any:
    """The degrees of freedom of nodes, `block` of each."""
    return (block * np.asarray(nodes, dtype=np.int64)[:, None] + np.arange(block)).ravel()
