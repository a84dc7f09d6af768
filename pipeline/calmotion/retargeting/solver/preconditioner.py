"""Gauss-Newton matrices that are banded in time, such as that of the rigid robot, as preconditioners."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csr_matrix

from calmotion.multibody.analysis.rigid_response import RigidResponse
from calmotion.retargeting.problem.offset_basis import DEGREE, OffsetBasis
from calmotion.shot.character import Array, BoolArray, IntArray


class BandedGram:
    """Sums of `sum_n b_n b_n^T (x) W_n` over rows b_n of spline matrices, unknowns ordered by basis function, then
    motor; block-banded, since at any time only DEGREE + 1 functions act.

    Periodic functions are ordered first, last, second, last but one ..., so that neighbours across the seam stay close
    in the order.
    """

    def __init__(self, count: int, motors: int, wraps: bool = False):
        """
        Args:
            count: Number of basis functions.
            motors: Unknowns of each.
            wraps: Whether the functions are periodic.
        """
        functions = np.arange(count)
        folded = np.where(2 * functions < count, 2 * functions, 2 * (count - functions) - 1)
        self._place = folded if wraps else functions
        self._blocks = np.zeros((2 * DEGREE + 1 if wraps else DEGREE + 1, count, motors, motors))

    @property
    def order(self) -> IntArray:
        """Which unknown stands at each place of the bands, shape [P * m]."""
        motors = self._blocks.shape[2]
        return np.asarray((motors * np.argsort(self._place)[:, None] + np.arange(motors)).ravel(), np.int32)

    def add(self, basis: csr_matrix, metric: Array) -> None:
        """Add the rows of a matrix of shape [T, P], the metric of shape [T, M, M], symmetric."""
        functions, weights = _rows(basis)
        places = self._place[functions]
        for i in range(DEGREE + 1):
            for j in range(DEGREE + 1):
                product, apart = weights[:, i] * weights[:, j], places[:, j] - places[:, i]
                used = np.flatnonzero((product != 0.0) & (apart >= 0))
                np.add.at(
                    self._blocks, (apart[used], places[used, i]), product[used, None, None] * metric[used]
                )  # fmt: skip

    def add_matrix(self, matrix: csr_matrix) -> None:
        """Add a banded matrix of shape [P, P] for every motor."""
        entries = matrix.tocoo()
        place, apart = self._place[entries.row], self._place[entries.col] - self._place[entries.row]
        used = (apart >= 0) & (entries.data != 0.0)
        eye = np.eye(self._blocks.shape[2])
        np.add.at(self._blocks, (apart[used], place[used]), entries.data[used, None, None] * eye)

    def banded(self) -> Array:
        """The lower bands as `scipy.linalg.cholesky_banded` takes them."""
        bands, count, motors, _ = self._blocks.shape
        banded = np.zeros((bands * motors, count * motors))
        for d in range(bands):
            for a in range(motors):
                for b in range(motors):
                    if d * motors + b - a >= 0:
                        banded[d * motors + b - a, a::motors] = self._blocks[d, :, a, b]
        return banded


def _rows(basis: csr_matrix) -> tuple[IntArray, Array]:
    """Functions that act in each row, DEGREE + 1 of them, and their values; what is missing has value 0."""
    shape = basis.shape[0], DEGREE + 1
    functions, weights = np.zeros(shape, np.int32), np.zeros(shape)
    row = np.repeat(np.arange(shape[0]), np.diff(basis.indptr))
    rank = np.arange(basis.nnz) - basis.indptr[row]
    functions[row, rank], weights[row, rank] = basis.indices, basis.data
    return functions, weights


class Preconditioner(Protocol):
    """An approximate inverse over all unknowns but those that are fixed; see `BandedPreconditioner`."""

    def factor(self, fixed: BoolArray, terms: list[tuple[csr_matrix, Array]] | None = None) -> None:
        """Factorise."""

    def solve(self, x: Array) -> Array:
        """The factor's inverse applied to a vector."""


class BandedPreconditioner:
    """Banded Cholesky factor of a matrix over all unknowns, plus the terms of the limits.

    Args:
        banded: Lower bands of the matrix, see `BandedGram.banded`.
        shape: Functions, motors, and whether the functions are periodic: the arguments of `BandedGram`.
        least: Of the largest diagonal entry, added to all: the factor exists for directions that move no target.
    """

    def __init__(self, banded: Array, shape: tuple[int, int, bool], least: float):
        self._banded, self._shape, self._order = banded, shape, BandedGram(*shape).order
        self._least = least * float(np.max(banded[0]))

    def factor(self, fixed: BoolArray, terms: list[tuple[csr_matrix, Array]] | None = None) -> None:
        """Factorise with the unknowns where `fixed` (shape [P * M], bool) is true excluded.

        Args:
            terms: Spline matrices and metrics of the limits, as `BandedGram.add` takes them.
        """
        banded = self._banded.copy()
        if terms:
            gram = BandedGram(*self._shape)
            for basis, metric in terms:
                gram.add(basis, metric)
            of_limits = gram.banded()
            banded[: len(of_limits)] += of_limits
        fixed = fixed[self._order]
        for d in range(1, len(banded)):
            banded[d, : banded.shape[1] - d] *= ~fixed[d:]
        banded[:, fixed] = 0.0
        banded[0] += max(self._least, 1e-12 * float(np.max(banded[0])))
        banded[0, fixed] = 1.0
        self._factor = cholesky_banded(banded, overwrite_ab=True, lower=True)

    def solve(self, x: Array) -> Array:
        """The factor's inverse applied to a vector of shape [P * M]."""
        solved = np.empty_like(x)
        solved[self._order] = cho_solve_banded((self._factor, True), x[self._order])
        return solved


def rigid_preconditioner(
    response: RigidResponse, weights: Array, basis: OffsetBasis, penalty: csr_matrix
) -> BandedPreconditioner:
    """That of the rigid robot, `B^T (J^T W J) B + penalty`.

    Args:
        response: Of the rigid robot.
        weights: Square roots of the residuals' weights, shape [T, K, 6].
        basis: Offset basis.
        penalty: Matrix of the regulariser for one motor, shape [P, P].
    """
    weighted = response.targets * weights[..., None]
    shape = basis.count, weighted.shape[3], basis.wraps
    gram = BandedGram(*shape)
    gram.add(basis.values, np.einsum("nkia,nkib->nab", weighted, weighted))
    gram.add_matrix(penalty)
    return BandedPreconditioner(gram.banded(), shape, 1e-9)


def banded_preconditioner(bands: Array, basis: OffsetBasis, penalty: csr_matrix) -> BandedPreconditioner:
    """That of responses which end some time after their unknowns have acted, by the bands of their matrix.

    Args:
        bands: Lower bands of the matrix of their products, at least as many as the penalty has; they are taken.
        basis: Offset basis, not periodic.
        penalty: As of `rigid_preconditioner`.
    """
    shape = basis.count, bands.shape[1] // basis.count, False
    gram = BandedGram(*shape)
    gram.add_matrix(penalty)
    more = gram.banded()
    bands[: len(more)] += more
    return BandedPreconditioner(bands, shape, 1e-12)
