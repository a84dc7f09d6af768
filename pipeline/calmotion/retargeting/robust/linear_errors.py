"""Errors of several robots that are linear in the unknowns, and power means of their lengths.

Of high orders, only the largest lengths count: the others are left out until they are larger, which makes steps of
Newton's method several times as cheap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, BoolArray

_COUNTS = 1e-2  # of the largest weight: smaller ones count in the gradient only
_LEFT_OUT, _MISSED = 1e-4, 1e-2  # of the largest weight: smaller ones do not count, until they are larger than this


@dataclass(frozen=True, eq=False)
class LinearErrors:
    """Errors of S robots at T instants and G targets, linear in n unknowns.

    Attributes:
        errors: r, shape [S, T, G, 3] [m].
        changes: J, shape [S, T, G, 3, n], of single precision.
        scale: c, of half the squared norm in the merit.
        gram: Second derivatives of c/2 M_2^2 for factors of 1, shape [n, n].
    """

    errors: Array
    changes: NDArray[np.float32]
    scale: float
    gram: Array

    @classmethod
    def of(cls, errors: Array, changes: NDArray[np.float32], scale: float) -> LinearErrors:
        """The errors with the matrix of their derivatives."""
        return cls(errors, changes, scale, scale * _products(changes) / (errors.size // 3))

    def with_robots(self, errors: Array, changes: NDArray[np.float32]) -> LinearErrors:
        """The errors of these robots and of further ones.

        Args:
            errors: Of all robots, shape [S', T, G, 3] [m].
            changes: Of the further ones, shape [S' - S, T, G, 3, n].
        """
        before, after = self.errors.size // 3, errors.size // 3
        gram = (before * self.gram + self.scale * _products(changes)) / after
        return LinearErrors(errors, np.concatenate([self.changes, changes]), self.scale, gram)

    def at(self, d: Array) -> Array:
        """The errors at a change of the unknowns, shape [S, T, G, 3]."""
        return self.errors + self.moved(d)

    def moved(self, d: Array) -> Array:
        """The change of the errors, shape [S, T, G, 3]."""
        # as one matrix: three times as fast as a product for each instant
        flat = self.changes.reshape(-1, len(d)) @ d.astype(np.float32)
        return flat.reshape(self.errors.shape).astype(float)


def _products(changes: NDArray[np.float32]) -> Array:
    """The sum of the squares of changes of shape [..., n] as a matrix, shape [n, n]."""
    flat = changes.reshape(-1, changes.shape[-1])
    return np.asarray(flat.T @ flat, float)


def lengths(errors: Array, factors: Array) -> Array:
    """m of errors of shape [S, T, G, 3] for factors of shape [S, G], shape [S, T, G]."""
    return np.asarray(np.linalg.norm(errors, axis=3) * factors[:, None, :])


def norm_of(m: Array, order: int) -> float:
    """M_p."""
    largest = float(m.max(initial=0.0))
    return largest * float(np.mean((m / largest) ** order)) ** (1.0 / order) if largest > 0.0 else 0.0


def weights_of(m: Array, factors: Array, order: int) -> Array:
    """Weights of the squared errors that are stationary where F_p is, shape [S, T, G]."""
    return np.asarray((m / max(norm_of(m, order), 1e-300)) ** (order - 2) * factors[:, None, :] ** 2)


def merit(scale: float, m: Array, order: int, rest: float) -> float:
    """F_p."""
    return 0.5 * scale * norm_of(m, order) ** 2 + rest


@dataclass(frozen=True, eq=False)
class FewErrors:
    """Those of N errors whose weights count in F_p.

    Attributes:
        some: Which, shape [S, T, G].
        errors: r, shape [k, 3] [m].
        changes: J, shape [3 k, n], of single precision.
        factors: f of each, shape [k].
        scale: c, see `LinearErrors`.
        order: p.
    """

    some: BoolArray
    errors: Array
    changes: NDArray[np.float32]
    factors: Array
    scale: float
    order: int

    @classmethod
    def of(cls, linear: LinearErrors, errors: Array, factors: Array, order: int) -> FewErrors:
        """Those that count at some values of all, shape [S, T, G, 3]."""
        return cls._picked(linear, errors, factors, order, _shares(errors, factors, order) > _LEFT_OUT)

    def with_further(self, linear: LinearErrors, errors: Array, factors: Array) -> FewErrors:
        """The same ones, and those that count at other values, shape [S, T, G, 3]."""
        some = self.some | (_shares(errors, factors, self.order) > _LEFT_OUT)
        return self._picked(linear, errors, factors, self.order, some)

    @classmethod
    def _picked(cls, linear: LinearErrors, errors: Array, factors: Array, order: int, some: BoolArray) -> FewErrors:
        changes = linear.changes[some].reshape(-1, linear.changes.shape[-1])
        own = np.broadcast_to(factors[:, None, :], some.shape)[some]
        return cls(some, errors[some], changes, own, linear.scale, order)

    def are_all(self, errors: Array, factors: Array) -> bool:
        """Whether the others have next to no weight for some values, shape [S, T, G, 3]."""
        return not np.any(_shares(errors, factors, self.order)[~self.some] > _MISSED)

    def moved(self, d: Array) -> Array:
        """Their change, shape [k, 3]."""
        return np.asarray((self.changes @ d.astype(np.float32)).reshape(-1, 3), float)

    def merit(self, errors: Array, rest: float) -> float:
        """F_p of values of them, shape [k, 3], without the others."""
        return merit(self.scale * self._thinned**2, self._lengths(errors), self.order, rest)

    def derivatives(self, errors: Array, rest: tuple[Array, Array]) -> tuple[Array, Array]:
        """Gradient of F_p, shape [n], and its second derivatives without the part that is negative, shape [n, n]."""
        m = self._lengths(errors)
        norm, (gradient, matrix) = max(self._thinned * norm_of(m, self.order), 1e-300), rest
        weights = self.scale / self.some.size * (m / norm) ** (self.order - 2) * self.factors**2
        gradient = gradient + (weights[:, None] * errors).astype(np.float32).ravel() @ self.changes
        counts = weights > _COUNTS * weights.max()
        along = errors[counts] / np.maximum(np.linalg.norm(errors[counts], axis=1), 1e-300)[:, None]
        rows, along = self.changes.reshape(len(m), 3, -1)[counts], along.astype(np.float32)
        # the root of 1 + (p - 2) u u^T is 1 + (sqrt(p - 1) - 1) u u^T
        steeper = np.float32(np.sqrt(self.order - 1.0) - 1.0)
        rows = rows + steeper * along[:, :, None] * np.einsum("ki,kin->kn", along, rows)[:, None, :]
        rows *= np.sqrt(weights[counts]).astype(np.float32)[:, None, None]
        flat = rows.reshape(-1, rows.shape[2])
        return gradient, matrix + flat.T @ flat

    def _lengths(self, errors: Array) -> Array:
        return np.asarray(np.linalg.norm(errors, axis=1) * self.factors)

    @property
    def _thinned(self) -> float:
        """M_p of all N over that of these alone."""
        return float((len(self.errors) / self.some.size) ** (1.0 / self.order))


def _shares(errors: Array, factors: Array, order: int) -> Array:
    """Weights over the largest, but for the squared factors, shape [S, T, G]."""
    m = lengths(errors, factors)
    return np.asarray((m / max(float(m.max(initial=0.0)), 1e-300)) ** (order - 2))
