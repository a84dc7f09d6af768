"""Offsets that gain next to nothing, set to exactly zero: motors and ranges that the animator finds untouched."""

from __future__ import annotations

import numpy as np

from calmotion.shot.character import Array, BoolArray

UNCHANGED = 1e-5  # an offset that stays below this angle [rad] is none
BLOCK = 8  # neighbouring coefficients of a motor that vanish together; four already make a curve vanish


def worthless(x: Array, motors: int, energy: Array, budget: float) -> BoolArray:
    """Which coefficients to fix at zero.

    Args:
        x: Coefficients, ordered by basis function, then motor, shape [P * m].
        motors: m.
        energy: x_b^T H_b x_b / 2 of each block, shape [blocks, m]: what the objective would lose without it.
        budget: Most that all of them together may cost, in the objective.

    Returns:
        Shape [P * m].
    """
    count = len(x) // motors
    order = np.argsort(energy, axis=None)
    affordable = np.cumsum(energy.ravel()[order]) <= budget
    chosen = np.zeros(energy.size, bool)
    chosen[order[affordable]] = True
    by_function = np.repeat(chosen.reshape(energy.shape), BLOCK, axis=0)[:count]
    return by_function.ravel()


def block_energies(x: Array, motors: int, product: Array) -> Array:
    """|x_b^T (M x)_b| / 2 of each block, shape [blocks, m]: their energies where M couples neighbours little.

    Args:
        x: Coefficients, ordered by basis function, then motor, shape [P * m].
        motors: m.
        product: M x.
    """
    count = len(x) // motors
    blocks = -(-count // BLOCK)
    padded = np.zeros((blocks * BLOCK, motors))
    padded[:count] = np.abs(x * product).reshape(count, motors)
    return 0.5 * padded.reshape(blocks, BLOCK, motors).sum(axis=1)
