"""Truncated conjugate gradients in a trust region; all iterates are kept, so that a smaller region costs no product."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array

_LEFT = 1.5  # r P^-1 r times this bounds the remaining decrease


@dataclass(frozen=True, eq=False)
class Path:
    """Iterates of conjugate gradients on g s + s H s / 2 from s = 0, and where a trust region ends.

    Attributes:
        steps, curved: s and H s, shape [k + 1, n], the first zero.
        lengths: Norms of the steps in the preconditioner's metric, increasing, shape [k + 1].
        p, Hp: Directions and their products, shape [k, n].
        gradient: g.
    """

    steps: Array
    curved: Array
    lengths: Array
    p: Array
    Hp: Array
    gradient: Array

    @property
    def length(self) -> float:
        """Length of the last step."""
        return float(self.lengths[-1])

    def within(self, radius: float) -> tuple[Array, float, float]:
        """The step to the boundary of a trust region or the last step, its predicted decrease, and its length."""
        k = int(np.searchsorted(self.lengths, radius))
        if k >= len(self.lengths):
            step, curved, length = self.steps[-1], self.curved[-1], self.length
        else:
            # between two iterates lengths are nearly linear, and the region's size is a choice anyway
            span = self.lengths[k] - self.lengths[k - 1]
            t = (radius - self.lengths[k - 1]) / span
            step = (1 - t) * self.steps[k - 1] + t * self.steps[k]
            curved = (1 - t) * self.curved[k - 1] + t * self.curved[k]
            length = radius
        return step, -float(self.gradient @ step + 0.5 * step @ curved), length


def conjugate_gradients(
    product: Callable[[Array], Array], gradient: Array, inverse: Callable[[Array], Array], radius: float,
    share: float, enough: float, limit: int,
) -> Path:  # fmt: skip
    """Minimise g s + s H s / 2 by preconditioned conjugate gradients (Steihaug 1983).

    With r the residual and P the preconditioner, r P^-1 r / 2 is the remaining decrease if P is H. In all measurements
    it was at least a third of the remaining decrease, so it is the criterion to end. The decrease of single steps is no
    criterion: it stalls on stiff directions first.

    Each residual is made orthogonal to all earlier ones. Without that, rounding grows from one to the next: on the
    samples a change of the input by 1e-14 changed the result by 1e-5 and sometimes the number of iterations, and a
    fifth to two fifths more products were needed. It costs little beside a product.

    Args:
        product: H times a vector.
        gradient: g, shape [n].
        inverse: The preconditioner.
        radius: Of the trust region, in the preconditioner's metric.
        share: Ends when the remaining decrease is below this share of the decrease so far.
        enough: Ends when the remaining decrease is below this value.
        limit: Most products.
    """
    n = len(gradient)
    steps, curved, lengths = [np.zeros(n)], [np.zeros(n)], [0.0]
    directions: list[Array] = []
    products: list[Array] = []
    r = gradient.copy()
    z = inverse(r)
    p, rz = -z, float(r @ z)
    residuals: list[Array] = []
    inverted: list[Array] = []
    decrease = 0.0
    ss, sp, pp = 0.0, 0.0, rz  # products of step and direction in the preconditioner's metric
    while len(directions) < limit and _LEFT * rz > max(enough, share * decrease):
        residuals.append(r)
        inverted.append(z / rz)
        Hp = product(p)
        curvature = float(p @ Hp)
        if not curvature > 0.0:
            break
        directions.append(p)
        products.append(Hp)
        a = rz / curvature
        steps.append(steps[-1] + a * p)
        curved.append(curved[-1] + a * Hp)
        ss += 2.0 * a * sp + a * a * pp
        lengths.append(max(np.sqrt(max(ss, 0.0)), np.nextafter(lengths[-1], np.inf)))
        decrease += 0.5 * a * rz
        if lengths[-1] >= radius:
            break
        r = _orthogonal(r + a * Hp, residuals, inverted)
        z = inverse(r)
        new = float(r @ z)
        b = new / rz
        p, rz = b * p - z, new
        sp, pp = b * (sp + a * pp), new + b * b * pp
    shape = (len(directions), n)
    return Path(
        np.array(steps), np.array(curved), np.array(lengths), np.reshape(directions, shape),
        np.reshape(products, shape), gradient,
    )  # fmt: skip


def _orthogonal(r: Array, residuals: list[Array], inverted: list[Array]) -> Array:
    """A residual without its components along earlier ones, which rounding has left."""
    return r - (np.array(inverted) @ r) @ np.array(residuals)
