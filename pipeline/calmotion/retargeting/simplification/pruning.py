"""Negligible offsets are set to exactly zero, so that their motors and intervals keep the animator's curves."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, BoolArray

BLOCK = 8  # neighbouring coefficients of a motor that vanish together; four already make a curve vanish


def negligible_coefficients(x: Array, motors: int, energy: Array, budget: float) -> BoolArray:
    """Which coefficients can be fixed at zero within a budget.

    Args:
        x: Coefficients, ordered by basis function, then motor, shape [P * m].
        motors: m.
        energy: x_b^T H_b x_b / 2 of each block, shape [blocks, m]: increase of the objective if the block is zero.
        budget: Largest increase of the objective, of all blocks together.

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
    """|x_b^T (M x)_b| / 2 of each block, shape [blocks, m]: their energies if M couples blocks weakly.

    Args:
        x: Coefficients, ordered by basis function, then motor, shape [P * m].
        motors: m.
        product: M x.
    """
    count = len(x) // motors
    blocks = -(-count // BLOCK)
    padded = np.zeros((blocks * BLOCK, motors))
    padded[:count] = np.abs(x * product).reshape(count, motors)
    energies: Array = 0.5 * padded.reshape(blocks, BLOCK, motors).sum(axis=1)
    return energies
