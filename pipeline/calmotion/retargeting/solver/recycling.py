"""Search directions of conjugate gradients, recycled to precondition the next Gauss-Newton matrix."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from calmotion.arrays import Array


class Recycled:
    """A limited-memory quasi-Newton inverse from pairs (p, H p) over another inverse.

    The matrices of successive Gauss-Newton steps differ little, and the directions of conjugate gradients are
    conjugate, so with n pairs the preconditioned matrix has about n eigenvalues moved to one (J. L. Morales,
    J. Nocedal, Automatic preconditioning by limited memory quasi-Newton updating, SIAM J. Optim. 10, 2000).

    Attributes:
        p, Hp: Directions and products, shape [n, size] each.
    """

    def __init__(self, p: Array, Hp: Array):
        self.p, self.Hp = p, Hp
        self._curvature = np.einsum("ij,ij->i", p, Hp)

    @classmethod
    def none(cls, size: int) -> Recycled:
        """No pairs."""
        return cls(np.zeros((0, size)), np.zeros((0, size)))

    def inverse(self, base: Callable[[Array], Array]) -> Callable[[Array], Array]:
        """The base inverse, corrected by the pairs: symmetric and positive definite when the base is."""

        def apply(g: Array) -> Array:
            used = np.zeros(len(self.p))
            q = g.copy()
            for k in range(len(self.p) - 1, -1, -1):
                used[k] = self.p[k] @ q / self._curvature[k]
                q -= used[k] * self.Hp[k]
            r = base(q)
            for k in range(len(self.p)):
                r += (used[k] - self.Hp[k] @ r / self._curvature[k]) * self.p[k]
            return r

        return apply

    def followed_by(self, p: Array, Hp: Array, most: int) -> Recycled:
        """With the pairs of a new solution, evenly sampled, and the newest old pairs up to `most` in all."""
        good = np.einsum("ij,ij->i", p, Hp) > 0.0
        p, Hp = p[good], Hp[good]
        if len(p) > most:
            chosen = np.unique(np.linspace(0, len(p) - 1, most).round().astype(int))
            p, Hp = p[chosen], Hp[chosen]
        room = most - len(p)
        kept = slice(len(self.p) - min(room, len(self.p)), None)
        return Recycled(np.vstack([self.p[kept], p]), np.vstack([self.Hp[kept], Hp]))
