"""Gauss-Newton matrices that are banded in time, such as that of the rigid robot, as preconditioners."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.multibody.analysis.rigid_response import RigidResponse
from calmotion.retargeting.problem.offset_basis import DEGREE, OffsetBasis

_NOTHING = 1e-12  # of the largest entry, and a motor does not move a target


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
        acting = metric.any(axis=(1, 2))  # of limits, few
        functions, weights, metric = functions[acting], weights[acting], metric[acting]
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


@dataclass(frozen=True, eq=False)
class Sharpened:
    """A preconditioner from what was worked out at a point, shape [n]."""

    point: Array
    preconditioner: Preconditioner

    def factor(self, fixed: BoolArray, terms: list[tuple[csr_matrix, Array]] | None = None) -> None:
        """As of `Preconditioner`."""
        self.preconditioner.factor(fixed, terms)

    def solve(self, x: Array) -> Array:
        """As of `Preconditioner`."""
        return self.preconditioner.solve(x)


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
        least = max(self._least, 1e-12 * float(np.max(banded[0])))
        self._factor = _factored(banded, fixed[self._order], least)

    def solve(self, x: Array) -> Array:
        """The factor's inverse applied to a vector of shape [P * M]."""
        solved = np.empty_like(x)
        solved[self._order] = cho_solve_banded((self._factor, True), x[self._order])
        return solved


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


class RigidPreconditioner:
    """Banded Cholesky factors of `B^T (J^T W J) B + penalty`, plus the terms of the limits.

    Motors that move no target together and share no limit, as those of several arms on one base, have factors of their
    own: the cost of a band grows with the cube of its motors.
    """

    def __init__(self, response: RigidResponse, weights: Array, basis: OffsetBasis, penalty: csr_matrix):
        """
        Args:
            response: Of the rigid robot.
            weights: Square roots of the residuals' weights, shape [T, K, 6].
            basis: Offset basis.
            penalty: Matrix of the regulariser for one motor, shape [P, P].
        """
        self._targets, self._weights, self._basis, self._penalty = response.targets, weights, basis, penalty
        largest = np.maximum(response.targets.max(axis=(0, 2)), -response.targets.min(axis=(0, 2)))
        self._moves = largest > _NOTHING * np.max(largest, initial=0.0)
        self._banded: dict[tuple[int, ...], Array] = {}
        self._factors: list[tuple[IntArray, Array]] = []

    def factor(self, fixed: BoolArray, terms: list[tuple[csr_matrix, Array]] | None = None) -> None:
        """Factorise with the unknowns where `fixed` (shape [P * M], bool) is true excluded.

        Args:
            terms: Spline matrices and metrics of the limits, as `BandedGram.add` takes them.
        """
        parts, scale = [], 0.0
        for group in self._groups(terms or []):
            banded = self._band_of(group)
            scale = max(scale, float(np.max(banded[0])))
            gram = self._gram(group)
            order = gram.order
            order = (order // len(group)) * self._moves.shape[1] + group[order % len(group)]
            for basis, metric in terms or []:
                gram.add(basis, metric[:, group[:, None], group])
            parts.append((order, banded + gram.banded() if terms else banded.copy()))
        # a small diagonal, so that the factor exists for directions that move no target
        least = max(1e-9 * scale, 1e-12 * max(float(np.max(banded[0])) for _, banded in parts))
        self._factors = [(order, _factored(banded, fixed[order], least)) for order, banded in parts]

    def solve(self, x: Array) -> Array:
        """The factor's inverse applied to a vector of shape [P * M]."""
        solved = np.empty_like(x)
        for order, factor in self._factors:
            solved[order] = cho_solve_banded((factor, True), x[order])
        return solved

    def _groups(self, terms: list[tuple[csr_matrix, Array]]) -> list[IntArray]:
        """Motors that move targets or share limits with each other, and with no others."""
        moves = self._moves.astype(np.int32)
        linked = moves.T @ moves
        for _, metric in terms:
            largest = np.abs(metric).max(axis=0)
            linked += largest > _NOTHING * np.max(largest)
        labels = connected_components(csr_matrix(linked), directed=False)[1]
        return [np.flatnonzero(labels == label).astype(np.int32) for label in range(labels.max() + 1)]

    def _gram(self, group: IntArray) -> BandedGram:
        return BandedGram(self._basis.count, len(group), self._basis.wraps)

    def _band_of(self, group: IntArray) -> Array:
        """The matrix of some motors without limits, as bands."""
        name = tuple(group.tolist())
        if name not in self._banded:
            moved = np.flatnonzero(self._moves[:, group].any(axis=1))
            weighted = self._targets[:, moved][..., group] * self._weights[:, moved, :, None]
            weighted = weighted.reshape(len(weighted), 6 * len(moved), len(group))
            gram = self._gram(group)
            gram.add(self._basis.values, weighted.transpose(0, 2, 1) @ weighted)
            gram.add_matrix(self._penalty)
            self._banded[name] = gram.banded()
        return self._banded[name]


def _factored(banded: Array, fixed: BoolArray, least: float) -> Array:
    """The Cholesky factor of bands, with what is fixed excluded and a small number added to the diagonal."""
    for d in range(1, len(banded)):
        banded[d, : banded.shape[1] - d] *= ~fixed[d:]
    banded[:, fixed] = 0.0
    banded[0] += least
    banded[0, fixed] = 1.0
    return np.asarray(cholesky_banded(banded, overwrite_ab=True, lower=True))
