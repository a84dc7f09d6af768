"""The matrix of a Newton step written out: all components' coordinates, then all joints' multipliers."""

from __future__ import annotations

import numpy as np

from calmotion.multibody.linear_solver.closed_chains import copy_rows
from calmotion.multibody.linear_solver.elimination import factor, solve
from calmotion.multibody.linear_solver.step_matrix import StepMatrix
from calmotion.multibody.model.system import JOINT_ROWS, Blocks, System
from calmotion.shot.character import Array
from calmotion.support.compilation import kernel


def _offsets(system: System) -> Array:
    return np.concatenate([[0], np.cumsum(6 + system.elastic)])


def dense_step_matrix(system: System, blocks: Blocks) -> Array:
    """The matrix, shape [n, n]; rows that a joint does not have hold their multiplier at zero.

    Systems without free sliders alone.
    """
    start = _offsets(system)
    total = int(start[-1])
    A = np.zeros((total + JOINT_ROWS * len(system.rows),) * 2)
    for b, r in enumerate(system.elastic):
        block = slice(start[b], start[b + 1])
        A[block, block] = blocks.K[b, : 6 + r, : 6 + r]
    for joint, (p, b) in enumerate(system.side):
        block, n = slice(start[b], start[b + 1]), int(6 + system.elastic[b])
        first = total + JOINT_ROWS * joint
        rows = slice(first, first + JOINT_ROWS)
        A[block, rows], A[rows, block] = blocks.Lc[joint, :n], blocks.Hc[joint, :, :n]
        if p >= 0:
            parent, m = slice(start[p], start[p + 1]), int(6 + system.elastic[p])
            A[parent, rows], A[rows, parent] = blocks.Lp[joint, :m], blocks.Hp[joint, :, :m]
            A[block, parent] += blocks.Nc[joint, :n] @ blocks.Jp[joint, :, :m]
        idle = np.arange(first + system.rows[joint], first + JOINT_ROWS)
        A[idle, idle] = 1.0
    return A


def split(system: System, vector: Array) -> tuple[Array, Array]:
    """A vector of all unknowns as (x, lam) of the kernels, shapes [B, N] and [J, 6]."""
    start = _offsets(system)
    x = np.zeros((len(system.parent), system.size))
    for b, r in enumerate(system.elastic):
        x[b, : 6 + r] = vector[start[b] : start[b + 1]]
    return x, vector[start[-1] :].reshape(-1, JOINT_ROWS).copy()


def flat(system: System, x: Array, lam: Array) -> Array:
    """The inverse of `split`."""
    return np.concatenate([*(x[b, : 6 + r] for b, r in enumerate(system.elastic)), lam.ravel()])


@kernel
def solve_again(
    system: System, blocks: Blocks, matrix: StepMatrix, K: Array, right: Array, right_lam: Array, x: Array, lam: Array,
    block: Array, repeats: int,
) -> None:  # fmt: skip
    """Factorise and solve so many times, from a loop that is compiled, as a simulation does."""
    for _ in range(repeats):
        for b in range(len(K)):
            copy_rows(K[b], blocks.K[b])
        copy_rows(right, x)
        copy_rows(right_lam, lam)
        factor(system, blocks, matrix, block)
        solve(system, matrix, x, lam, block)
