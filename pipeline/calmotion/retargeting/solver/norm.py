"""What a search minimises of the residuals: the sum of their squares, or a power mean of the lengths of errors.

The largest of the lengths m_i = |r_i| / u_i of N errors is the limit of their power means

    M_p = (sum_i s_i m_i^p)^(1/p),    F_p = T/2 M_p^2,    sum_i s_i = 1

for p to infinity. With s_i = u_i^2 / T, F_2 is half the sum of the squares. F_p is convex and smooth; where it is
smallest, a sum of squares is stationary too, whose weights are w_i = (m_i / M_p)^(p - 2) (Lawson 1961).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from calmotion.arrays import Array


class Norm(Protocol):
    """A convex function of residuals of shape [T, R], of which three at a time are those of an error."""

    def value(self, residuals: Array) -> float:
        """The function."""

    def gradient(self, residuals: Array) -> Array:
        """Its derivative, shape [T, R]."""

    def product(self, residuals: Array, change: Array) -> Array:
        """Its second derivatives times a change of the residuals, shape [T, R]."""

    def roots(self, residuals: Array) -> Array:
        """Roots of the second derivatives by each error alone, shape [errors, 3, 3], without the part that all have
        together (`lessened`)."""

    def lessened(self, residuals: Array) -> tuple[Array, float]:
        """A vector g, shape [T, R], and a number s: the second derivatives are less than those by the errors alone by
        s g g^T."""


class SumOfSquares:
    """Half the sum of the squares."""

    def value(self, residuals: Array) -> float:
        """The function."""
        return 0.5 * float(np.sum(residuals**2))

    def gradient(self, residuals: Array) -> Array:
        """The residuals themselves."""
        return residuals

    def product(self, residuals: Array, change: Array) -> Array:
        """The change itself."""
        return change

    def roots(self, residuals: Array) -> Array:
        """Unit matrices."""
        return np.broadcast_to(np.eye(3), (residuals.size // 3, 3, 3))

    def lessened(self, residuals: Array) -> tuple[Array, float]:
        """Nothing."""
        return residuals, 0.0


@dataclass(frozen=True, eq=False)
class PowerMean:
    """F_p of errors of three residuals each, and half the sum of the squares of all further residuals.

    Attributes:
        order: p.
        units: u, the residuals of an error of one metre, shape [T, 1]; infinite where errors do not count.
        shares: s, shape [T, 1].
        factors: By which lengths are multiplied, shape [T, G] of G errors: those of some count more.
    """

    order: int
    units: Array
    shares: Array
    factors: Array

    def lengths(self, residuals: Array) -> Array:
        """m, shape [T, G]."""
        return np.asarray(np.linalg.norm(self._errors(residuals), axis=2) * self.factors / self.units)

    def weights(self, residuals: Array) -> Array:
        """Weights w of the squared errors, with their factors, shape [T, G]."""
        m = self.lengths(residuals)
        return np.asarray((m / max(self._mean(m), 1e-300)) ** (self.order - 2) * self.factors**2)

    def value(self, residuals: Array) -> float:
        """F_p and the squares."""
        return 0.5 * float(np.sum(self.gradient(residuals) * residuals))

    def gradient(self, residuals: Array) -> Array:
        """Its derivative, shape [T, R]."""
        weighted = residuals.copy()
        self._errors(weighted)[:] *= self.weights(residuals)[..., None]
        return weighted

    def product(self, residuals: Array, change: Array) -> Array:
        """Its second derivatives times a change of the residuals, shape [T, R]."""
        weights, unit, product = self.weights(residuals)[..., None], self._directions(residuals), change.copy()
        pulls, share = self.lessened(residuals)
        changes = self._errors(product)
        changes += (self.order - 2.0) * unit * np.sum(unit * changes, axis=2, keepdims=True)
        changes *= weights
        return np.asarray(product - share * float(np.sum(pulls * change)) * pulls)

    def roots(self, residuals: Array) -> Array:
        """Of w (1 + (p - 2) u u^T) with the unit vector u of each error."""
        unit, weights = self._directions(residuals), self.weights(residuals)
        along = (np.sqrt(self.order - 1.0) - 1.0) * unit[..., None] * unit[..., None, :]
        return np.asarray(np.sqrt(weights)[..., None, None] * (np.eye(3) + along)).reshape(-1, 3, 3)

    def lessened(self, residuals: Array) -> tuple[Array, float]:
        """Of the errors, w r; the square of a mean grows as the square of the errors, not as their power."""
        pulls = np.zeros_like(residuals)
        self._errors(pulls)[:] = self.weights(residuals)[..., None] * self._errors(residuals)
        return pulls, (self.order - 2.0) / max(float(np.sum(pulls * residuals)), 1e-300)  # that sum is 2 F_p

    def _errors(self, residuals: Array) -> Array:
        """The residuals of errors, a view of shape [T, G, 3]."""
        groups = self.factors.shape[1]
        return residuals[:, : 3 * groups].reshape(len(residuals), groups, 3)

    def _directions(self, residuals: Array) -> Array:
        """Unit vectors of the errors, shape [T, G, 3]."""
        errors = self._errors(residuals)
        return np.asarray(errors / np.maximum(np.linalg.norm(errors, axis=2, keepdims=True), 1e-300))

    def _mean(self, m: Array) -> float:
        """M_p."""
        largest = float(m.max(initial=0.0))
        mean = np.sum(self.shares * (m / max(largest, 1e-300)) ** self.order)
        return largest * float(mean ** (1.0 / self.order))
