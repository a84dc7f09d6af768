"""A preconditioner with a few more rows, each of which may be far stiffer than all else."""

from collections.abc import Callable

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from calmotion.arrays import Array

ROUNDING = 1e-9  # of the diagonal, added to it: rows that say the same differ by no more


def with_rows(inverse: Callable[[Array], Array], rows: Array, weights: Array) -> Callable[[Array], Array]:
    """The inverse of P + A^T W A from that of P (Woodbury 1950).

    Args:
        inverse: P^-1 times a vector of shape [n]; P is symmetric and positive definite.
        rows: A, shape [k, n].
        weights: Diagonal of W, positive, shape [k].
    """
    if not len(rows):
        return inverse
    solved = np.array([inverse(row) for row in rows])
    inner = np.diag(1.0 / weights) + 0.5 * (rows @ solved.T + solved @ rows.T)
    scale = 1.0 / np.sqrt(np.diag(inner))
    # rounding leaves nothing of the difference of rows that say the same
    inner = scale[:, None] * inner * scale + ROUNDING * np.eye(len(rows))
    factor = cho_factor(inner, lower=True)

    def solve(x: Array) -> Array:
        own = inverse(x)
        return np.asarray(own - (scale * cho_solve(factor, scale * (rows @ own))) @ solved)

    return solve
