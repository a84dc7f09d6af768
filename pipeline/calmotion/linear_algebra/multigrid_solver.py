"""Conjugate gradients for many right-hand sides, with a multigrid cycle in place of factors.

Factors of a mesh of 200,000 nodes need ten gigabytes; the matrix needs one.

Source: Hestenes and Stiefel, Methods of Conjugate Gradients for Solving Linear Systems, 1952; Tatebe, The Multigrid
Preconditioned Conjugate Gradient Method, 1993.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.linear_algebra.multifrontal import expand
from calmotion.linear_algebra.multigrid import WIDTH, Blocks, Multigrid
from calmotion.linear_algebra.sparse_solver import Solver

_STEPS = 60  # a dozen are usual


class MultigridSolver:
    """Approximate solutions of the systems of a stiffness matrix.

    Args:
        order: Nodes in the order of the matrix, shape [n].
        matrix: Symmetric and positive definite.
        cycle: Roughly its inverse.
        accuracy: Energy x @ matrix @ x of the error of a solution, relative to its own.
        factorised: Makes a solver that takes over where the cycle does not converge.
    """

    def __init__(
        self, order: IntArray, matrix: Blocks, cycle: Multigrid, accuracy: float, factorised: Callable[[], Solver]
    ):  # fmt: skip
        self._rows = expand(order, 3)
        self._matrix, self._cycle, self._accuracy, self._factorised = matrix, cycle, accuracy, factorised
        self._direct: Solver | None = None

    @property
    def entries(self) -> int:
        """Number of entries of factors."""
        return 0 if self._direct is None else self._direct.entries

    def solve(self, b: Array, start: Array | None = None, left: Array | None = None) -> Array:
        """As of `Solver`, b of shape [3n, k]."""
        x = np.zeros(b.shape)
        for first in range(0, b.shape[1], WIDTH):
            if self._direct is not None:
                break
            some = slice(first, first + WIDTH)
            begin = None if start is None else _wide(start[self._rows, some])
            found = self._solved(
                _wide(b[self._rows, some]), begin, None if left is None else _wide(left[None, some])[0]
            )
            if found is None:
                self._direct = self._factorised()
            else:
                x[self._rows, some] = found[:, : x[:, some].shape[1]]
        return x if self._direct is None else self._direct.solve(b)

    def _solved(self, b: Array, start: Array | None, left: Array | None) -> Array | None:
        """Of `WIDTH` columns; None if they do not converge."""
        x = np.zeros_like(b) if start is None else start
        rest = b if start is None else b - self._matrix @ x
        step: Any = 0.0
        before = np.full(WIDTH, np.inf)
        for _ in range(_STEPS):
            better = self._cycle.solve(rest)
            # that of the error, as far as the cycle is the inverse
            energy = np.einsum("ij,ij->j", rest, better)
            if not np.isfinite(energy).all():
                return None
            enough = self._accuracy * np.abs(np.einsum("ij,ij->j", x, b)) if left is None else left
            if (energy <= enough).all():
                return x
            step = better + step * (energy / before)
            moved = self._matrix @ step
            length = energy / np.maximum(np.einsum("ij,ij->j", step, moved), np.finfo(float).tiny)
            x = x + length * step
            rest = rest - length * moved
            before = np.maximum(energy, np.finfo(float).tiny)
        return None


def _wide(columns: Array) -> Array:
    """The columns and as many zero ones as a block has room for."""
    wide = np.zeros((len(columns), WIDTH))
    wide[:, : columns.shape[1]] = columns
    return wide
