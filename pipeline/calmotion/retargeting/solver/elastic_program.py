"""A quadratic program whose constraints may give way: the point that keeps them, or exceeds them least.

    minimise  1/2 x^T H x + c^T x + rho sum(s)   with  G x <= b + s,  s >= 0

by a primal-dual interior-point method (Wright, Primal-Dual Interior-Point Methods, 1997). With a large rho the
constraints hold exactly where that is possible (Fletcher, Practical Methods of Optimization, 1987, section 14.3).
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags
from scipy.sparse.linalg import splu

from calmotion.arrays import Array, BoolArray

ITERATIONS = 100  # iterations
FRACTION_TO_BOUNDARY = 0.995  # share of the way to the boundary that a step takes
FULL, FEW = 0.25, 8  # share of the unknowns of a row that would fill the matrix of all others, and most such rows
COMPLEMENTARITY = 1e-14  # complementarity at the end, relative to rho


@dataclass(frozen=True, eq=False)
class ElasticPoint:
    """Where the program ends.

    Attributes:
        x: Shape [n].
        multipliers: Of the constraints, at most rho, shape [m].
    """

    x: Array
    multipliers: Array


def elastic_minimum(H: csr_matrix, c: Array, G: csr_matrix, b: Array, rho: float) -> ElasticPoint:
    """Solve the program.

    Args:
        H: Positive definite, sparse, shape [n, n].
        c: Shape [n].
        G: Sparse, shape [m, n].
        b: Shape [m], finite.
        rho: What an excess of one costs.
    """
    count, x, Gt = max(1, len(b)), np.zeros(len(c)), csc_matrix(G.T)
    gap = G @ x - b
    full = np.diff(G.indptr) > FULL * len(c)
    full &= np.count_nonzero(full) <= FEW
    multipliers = other = np.full(len(b), 0.5 * rho)  # other: rho - multipliers, whose digits a difference would lose
    below, above = np.maximum(-gap, 0.0) + 1.0, np.maximum(gap, 0.0) + 1.0
    for _ in range(ITERATIONS):
        measure = float(below @ multipliers + above @ other) / (2 * count)
        dual = H @ x + c + Gt @ multipliers
        primal = G @ x + below - above - b
        if measure <= COMPLEMENTARITY * rho and np.max(np.abs(primal), initial=0.0) <= 1e-9:
            break
        goal = 0.1 * measure
        weight = 1.0 / (below / multipliers + above / other)
        right = -primal - (goal / multipliers - below) + (goal / other - above)
        step = _step(H, G, weight, full, -dual + Gt @ (weight * right))
        d_multipliers = weight * (G @ step - right)
        d_below = (goal - below * d_multipliers) / multipliers - below
        d_above = (goal + above * d_multipliers) / other - above
        length = min(
            _longest(multipliers, d_multipliers), _longest(other, -d_multipliers),
            _longest(below, d_below), _longest(above, d_above),
        )  # fmt: skip
        x = x + length * step
        multipliers, other, below, above = (
            multipliers + length * d_multipliers,
            other - length * d_multipliers,
            below + length * d_below,
            above + length * d_above,
        )
    return ElasticPoint(x, multipliers)


def _step(H: csr_matrix, G: csr_matrix, weight: Array, full: BoolArray, right: Array) -> Array:
    """The solution of (H + G^T W G) x = right; full rows are eliminated, since they would fill the matrix."""
    sparse, rows = G[~full], G[full].toarray()
    matrix = csc_matrix(H + sparse.T @ diags(weight[~full]) @ sparse)
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    solved = np.asarray(factors.solve(right))
    if len(rows) == 0:
        return solved
    responses = np.asarray(factors.solve(rows.T))
    # a row and its opposite, both at their bounds, have only the difference of their forces
    forces = np.linalg.lstsq(rows @ responses + np.diag(1.0 / weight[full]), rows @ solved)[0]
    return np.asarray(solved - responses @ forces)


def _longest(values: Array, change: Array) -> float:
    """Share of a change, at most 1, that keeps positive values positive."""
    falling = change < 0.0
    return min(1.0, FRACTION_TO_BOUNDARY * float(np.min(-values[falling] / change[falling], initial=np.inf)))
