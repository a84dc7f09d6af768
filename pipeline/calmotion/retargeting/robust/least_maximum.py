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

from typing import Protocol

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from calmotion.arrays import Array, BoolArray
from calmotion.retargeting.robust.linear_errors import FewErrors, LinearErrors

ORDERS: tuple[int, ...] = (8, 16)
STEPS = 30  # most of each order, with those that fail
_ENDED = 1e-3  # relative decrease of F_p below which the next order follows
_SEEN = 0.02  # relative decrease of F_p after which it is looked which errors count
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


def least_maximum(
    linear: LinearErrors, factors: Array, rest: Rest, fixed: BoolArray, start: Array,
    orders: tuple[int, ...] = ORDERS, steps: int = STEPS,
) -> Array:  # fmt: skip
    """The change of the unknowns with the smallest F_p, p the last of some orders, shape [n].

    Errors of next to no weight are left out until they have more.

    Args:
        linear: The errors.
        factors: f of each robot and target, shape [S, G].
        rest: Of the merit.
        fixed: Unknowns that do not change, shape [n], bool.
        start: A change, shape [n].
        orders: Of the norms, one after the other.
        steps: Most of each order, with those that fail.
    """
    d, damping, free = start, _DAMPED, np.ix_(*[np.flatnonzero(~fixed)] * 2)
    gram = linear.gram[free]
    for order in orders:
        few = FewErrors.of(linear, linear.at(d), factors, order)
        errors, derivatives = few.errors, None
        before, unseen = few.merit(errors, rest.value(d)), 0.0
        for _ in range(steps):
            if derivatives is None:
                gradient, matrix = few.derivatives(errors, rest.derivatives(d))
                derivatives = gradient[~fixed], matrix[free]
            step = np.zeros_like(d)
            step[~fixed] = _step(derivatives[0], derivatives[1] + damping * gram)
            moved = few.moved(step)
            after = few.merit(errors + moved, rest.value(d + step))
            if not after < before:
                damping *= _FAILED
                if damping > _MOST_DAMPED:
                    break
                continue
            d, errors, derivatives, fell, before = d + step, errors + moved, None, (before - after) / before, after
            ended, unseen = fell < _ENDED and damping <= _DAMPED, unseen + fell
            if ended or unseen > _SEEN:
                everywhere, unseen = linear.at(d), 0.0
                if not few.are_all(everywhere, factors):
                    few, ended = few.with_further(linear, everywhere, factors), False
                    errors, before = few.errors, few.merit(few.errors, rest.value(d))
            if ended:
                break
            damping *= _EASED
        damping = min(damping, _DAMPED)
    return d


def _step(gradient: Array, matrix: Array) -> Array:
    """Newton's step; none where the matrix is singular to rounding, so that it is damped more."""
    matrix[np.diag_indices_from(matrix)] += _NOTHING * np.trace(matrix) / max(len(matrix), 1)
    try:
        return np.asarray(-cho_solve(cho_factor(matrix, overwrite_a=True), gradient))
    except LinAlgError:
        return np.zeros_like(gradient)
