"""A bound below which no curves can bring the largest error: the dual of the least maximum of a linear model.

Let curves leave errors |e_i| <= v on some robots, where those of the nominal one are |e_j| <= a_j, limits c_l <= 0
hold, and offsets change by |x| <= D. Any weights of at least zero, with sum lambda_i = 1, then give

    v^2 >= min_x  sum lambda_i |e_i(x)|^2 + sum mu_j (|e_j(x)|^2 - a_j^2) + 2 sum nu_l c_l(x) + delta (|x|^2 - D^2)

where the minimum of a quadratic function is the solution of one linear system. Where a power mean of high order is
smallest (`least_maximum`), its weights are stationary, and near to those with the largest bound; those of the limits
are their multipliers. All errors also have a small even weight, so that no unknown is left free.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from calmotion.arrays import Array, BoolArray
from calmotion.retargeting.robust.linear_errors import LinearErrors, lengths, weights_of
from calmotion.retargeting.robust.rest_of_merit import RestOfMerit
from calmotion.retargeting.solver.dense_preconditioner import for_each_motor

ORDERS = (16, 32, 64)  # of the power means, one after the other
STEPS = 200  # most of each of them, with those that fail: weights are far from stationary before
MET = (0.97, 1.02)  # what errors of the nominal robot have to meet of what they may be
FIRST_FACTOR = 0.8  # of the nominal robot, see `WorstCase`: over the largest error as a multiple of its own
FARTHEST = 1.0  # root-mean-square change of a motor's offsets to which the bound holds [rad, m]
_EVEN = 5e-3  # even weight of all errors, over the others'
_DISTANT = (1e-6, 1e-4)  # weights of the change of the offsets that are tried: what each takes from the squared bound
_COUNTS = 1e-9  # of the largest weight: smaller ones count as zero


@dataclass(frozen=True, eq=False)
class EvenErrors:
    """The rest of a merit of which all errors are a part: the limits, and a small multiple of all squares.

    Attributes:
        limits: The rest, without regulariser and trust region.
        gram: Second derivatives of c/2 M_2^2, see `LinearErrors`, shape [n, n].
        slope, constant: Its gradient, shape [n], and value where nothing changes.
    """

    limits: RestOfMerit
    gram: Array
    slope: Array
    constant: float

    @classmethod
    def of(cls, linear: LinearErrors, rest: RestOfMerit) -> EvenErrors:
        """The rest for errors and the limits of a rest, in double precision.

        Args:
            linear: The errors.
            rest: Its limits count.
        """
        bare = replace(rest.space, smoothness=0.0, closeness=0.0, base=None)
        gram, slope = (np.zeros((rest.space.size,) * k) for k in (2, 1))
        for errors, changes in zip(linear.errors, linear.changes, strict=True):
            rows = changes.reshape(-1, rest.space.size).astype(float)
            gram += rows.T @ rows
            slope += rows.T @ errors.ravel()
        share = linear.scale / (linear.errors.size // 3)
        constant = 0.5 * share * float(np.sum(linear.errors**2))
        return cls(replace(rest, space=bare, damping=0.0), share * gram, share * slope, constant)

    def value(self, d: Array) -> float:
        """The rest at a change d of the unknowns, shape [n]."""
        return self.limits.value(d) + _EVEN * self.squares(d)

    def derivatives(self, d: Array) -> tuple[Array, Array]:
        """Gradient, shape [n], and second derivatives, shape [n, n]."""
        gradient, matrix = self.limits.derivatives(d)
        return gradient + _EVEN * (self.gram @ d + self.slope), matrix + _EVEN * self.gram

    def squares(self, d: Array) -> float:
        """c/2 M_2^2 at a change."""
        return float(d @ (0.5 * self.gram @ d + self.slope)) + self.constant


def least_possible(
    linear: LinearErrors, factors: Array, most: Array, rest: EvenErrors, fixed: BoolArray, d: Array, duration: float
) -> float:
    """A bound of the largest error of any robot [m], as errors weigh; 0 where the weights tell nothing.

    Args:
        linear: The errors of S robots, the nominal one first, at T instants and G targets.
        factors: With which those of the nominal robot count at d, shape [S, G].
        most: Largest errors of the nominal robot, shape [G] [m]; infinite: as large as those of the others.
        rest: For the same errors.
        fixed: Unknowns that do not change, shape [n], bool.
        d: A change of the unknowns, shape [n], for which the last of `ORDERS` is smallest.
        duration: Of the shot [s].
    """
    errors = linear.at(d)
    m = lengths(errors, factors)
    weights = weights_of(m, factors, ORDERS[-1]) * (linear.scale / m.size)
    weights[weights < _COUNTS * weights.max()] = 0.0
    held = np.isfinite(most) & (factors[0] > 1.0)  # the others are bounded by v as well
    of_held, even = weights[0][:, held], _EVEN * linear.scale
    total = float(weights.sum() - of_held.sum()) + even
    kept, pull = rest.limits.multiplied(d)
    value = float(np.sum(weights * np.sum(errors**2, axis=3)) - np.sum(of_held * most[held] ** 2))
    value = (value + 2.0 * (_EVEN * rest.squares(d) + kept)) / total
    some = weights > 0.0
    roots = np.sqrt(weights[some])[:, None]
    rows = (roots[..., None] * linear.changes[some]).reshape(-1, len(d))
    gradient = rows.T @ (roots * errors[some]).ravel() + _EVEN * (rest.gram @ d + rest.slope) + pull
    free = np.ix_(*[np.flatnonzero(~fixed)] * 2)
    matrix, gradient = ((rows.T @ rows + _EVEN * rest.gram) / total)[free], gradient[~fixed] / total
    space = rest.limits.space
    motors, changed = len(space.motors), d[~fixed]
    apart, within = for_each_motor(space.basis.closeness, motors)[free], FARTHEST**2 * motors * duration
    bounds = [0.0]
    for share in _DISTANT:
        delta = share * max(value, 0.0) / within
        slope = gradient + delta * (apart @ changed)
        least = float(slope @ cho_solve(cho_factor(matrix + delta * apart), slope))
        bounds.append(value - least + delta * (float(changed @ apart @ changed) - within))
    return float(np.sqrt(max(bounds)))
