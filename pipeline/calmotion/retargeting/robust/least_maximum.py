"""The smallest largest error that a linear model allows: Newton's method on p-norms of ever higher order.

The largest of the lengths m_i = f_i |r_i + J_i d| over robots, instants and targets is the limit of their power means

    M_p = (1/N sum m_i^p)^(1/p),    F_p = c/2 M_p^2 + R(d)

for p to infinity. F_p is convex where the rest R is, and near its minimum the minimum for a higher p is not far. Where
F_p is smallest, a weighted sum of squares is stationary too, whose weights are (m_i / M_p)^(p - 2) f_i^2 (Lawson 1961):
with these, a search for the smallest weighted sum of squares finds the same curves.

Of high orders, few errors resist a step; the matrix of the sum of all squares, times a number that follows from whether
steps succeed (Levenberg 1944, Marquardt 1963), keeps the others from growing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, solve

from calmotion.shot.character import Array, BoolArray

ORDERS: tuple[int, ...] = (8, 16)
STEPS = 30  # most of each order, with those that fail
_ENDED = 1e-3  # relative decrease of F_p below which the next order follows
_COUNTS = 1e-2  # of the largest weight: smaller ones count in the gradient only
_NOTHING = 1e-12  # of the mean of the matrix's diagonal, added to it
_DAMPED, _EASED, _FAILED = (
    1.0,
    0.25,
    6.0,
)  # first damping, and its factors after a step that succeeds and one that fails
_MOST_DAMPED = 1e8


class Rest(Protocol):
    """The part of the merit that is not errors."""

    def value(self, d: Array) -> float:
        """At a change d of the unknowns, shape [n]."""

    def derivatives(self, d: Array) -> tuple[Array, Array]:
        """Gradient, shape [n], and second derivatives, shape [n, n], at least semidefinite."""


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


def least_maximum(
    linear: LinearErrors, factors: Array, rest: Rest, fixed: BoolArray, start: Array,
    orders: tuple[int, ...] = ORDERS, steps: int = STEPS,
) -> Array:  # fmt: skip
    """The change of the unknowns with the smallest F_p, p the last of some orders, shape [n].

    Args:
        linear: The errors.
        factors: f of each robot and target, shape [S, G].
        rest: Of the merit.
        fixed: Unknowns that do not change, shape [n], bool.
        start: A change, shape [n].
        orders: Of the norms, one after the other.
        steps: Most of each order, with those that fail.
    """
    d, errors, free = start, linear.at(start), np.flatnonzero(~fixed)
    damping = _DAMPED
    for order in orders:
        before = merit(linear.scale, lengths(errors, factors), order, rest.value(d))
        derivatives = None
        for _ in range(steps):
            if derivatives is None:
                derivatives = _derivatives(linear, errors, factors, order, rest.derivatives(d))
            step = np.zeros_like(d)
            step[free] = _step(derivatives[0][free], (derivatives[1] + damping * linear.gram)[np.ix_(free, free)])
            moved = linear.moved(step)
            after = merit(linear.scale, lengths(errors + moved, factors), order, rest.value(d + step))
            if not after < before:
                damping *= _FAILED
                if damping > _MOST_DAMPED:
                    break
                continue
            d, errors, derivatives, fell, before = d + step, errors + moved, None, (before - after) / before, after
            if fell < _ENDED and damping <= _DAMPED:
                break
            damping *= _EASED
        damping = min(damping, _DAMPED)
    return d


def merit(scale: float, m: Array, order: int, rest: float) -> float:
    """F_p."""
    return 0.5 * scale * norm_of(m, order) ** 2 + rest


def _derivatives(
    linear: LinearErrors, errors: Array, factors: Array, order: int, rest: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Gradient of F_p, shape [n], and its second derivatives without the part that is negative, shape [n, n]."""
    m = lengths(errors, factors)
    weights, share = weights_of(m, factors, order), linear.scale / m.size
    gradient, matrix = rest
    gradient = gradient + np.tensordot((share * weights[..., None] * errors).astype(np.float32), linear.changes, 4)
    counts = weights > _COUNTS * weights.max()
    along = errors[counts] / np.maximum(np.linalg.norm(errors[counts], axis=1), 1e-300)[:, None]
    rows, along = linear.changes[counts], along.astype(np.float32)
    # the root of 1 + (p - 2) u u^T is 1 + (sqrt(p - 1) - 1) u u^T
    steeper = np.float32(np.sqrt(order - 1.0) - 1.0)
    rows = rows + steeper * along[:, :, None] * np.einsum("ki,kin->kn", along, rows)[:, None, :]
    rows *= np.sqrt(share * weights[counts]).astype(np.float32)[:, None, None]
    flat = rows.reshape(-1, rows.shape[2])
    return gradient, matrix + flat.T @ flat


def _step(gradient: Array, matrix: Array) -> Array:
    """Newton's step; none where the matrix is singular to rounding, so that it is damped more."""
    matrix[np.diag_indices_from(matrix)] += _NOTHING * np.trace(matrix) / max(len(matrix), 1)
    try:
        return np.asarray(-solve(matrix, gradient, assume_a="pos"))
    except LinAlgError:
        return np.zeros_like(gradient)
