"""The eliminated step matrix, the border of closed chains, and the scratch of solutions; compiled."""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.linear_solver.pseudo_inverse import Decomposition, allocate_decomposition
from calmotion.multibody.model.system import JOINT_ROWS, Blocks, CountArray, System
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import kernel

UNKNOWNS = JOINT_ROWS + 3  # of a joint that closes a chain: its multipliers, and the rotation of its parent-side marker


class StepMatrix(NamedTuple):
    """The eliminated step matrix of one instant: the blocks that a solution reads, and the factors.

    L is the number of joints that close chains.

    Attributes:
        Lc, Lp, Hp, Nc, Jp: See `Blocks`.
        Hc: Constraint rows by the component, of the joints that close chains alone, shape [L, 6, N].
        lu, pivots: Factors of each component with its joint, shapes [B, N + 6, N + 6] and [B, N + 6], in the order of
            `elimination.place`.
        Z: The transposed solutions for its multipliers, shape [B, N + 6, 6].
        inverse: Pseudo-inverse of the closed chains' Schur complement (`closed_chains`), shape [9 L, 9 L].
    """

    Lc: Array
    Lp: Array
    Hc: Array
    Hp: Array
    Nc: Array
    Jp: Array
    lu: Array
    pivots: IntArray
    Z: Array
    inverse: Array


@by_reference
class SolutionScratch(NamedTuple):
    """Scratch of solutions.

    Attributes:
        X, lam: Solution of the tree, shapes [B, N] and [J, 6].
        y, g: Unknowns and right-hand side of the closed chains, shape [9 L].
        block: Unknowns of one component with its joint, shape [N + 6].
        right, right_lam: Right-hand side of the static equations, shapes [B, N] and [J, 6].
    """

    X: Array
    lam: Array
    y: Array
    g: Array
    block: Array
    right: Array
    right_lam: Array


@by_reference
class Border(NamedTuple):
    """Results of `closed_chains.factor_closed_chains` besides the inverse, and scratch.

    L is the number of joints that close chains.

    Attributes:
        null: Columns of the null space of S, shape [9 L, 9 L].
        rank: Of S, shape [1].
        margin: Distance of S from a lower rank: its smallest pivot over the largest, shape [1].
        S: Shape [9 L, 9 L]; overwritten by its decomposition.
        decomposition: Scratch of `pseudo_inverse`.
        moved, forces: What each unknown of the border moves in the tree, and the multipliers of the tree's joints with
            it, of opposite sign: A^-1 E, shapes [B, N, 9 L] and [J, 6, 9 L].
        block: Scratch, shape [N + 6, 9 L].
        sets: Scratch of `least_multipliers`, shape [9 L, J, 6].
    """

    null: Array
    rank: CountArray
    margin: Array
    S: Array
    decomposition: Decomposition
    moved: Array
    forces: Array
    block: Array
    sets: Array


def step_matrix(system: System, blocks: Blocks) -> StepMatrix:
    """The matrix of these blocks, whose arrays it shares; its factors are zero."""
    count, joints, size = len(system.parent), len(system.rows), system.size + JOINT_ROWS
    border = UNKNOWNS * (joints - count)
    return StepMatrix(
        Lc=blocks.Lc,
        Lp=blocks.Lp,
        Hc=blocks.Hc[count:],
        Hp=blocks.Hp,
        Nc=blocks.Nc,
        Jp=blocks.Jp,
        lu=np.zeros((count, size, size)),
        pivots=np.zeros((count, size), np.int32),
        Z=np.zeros((count, size, JOINT_ROWS)),
        inverse=np.zeros((border, border)),
    )


def allocate_solution(system: System) -> SolutionScratch:
    """Scratch for one system."""
    count, joints = len(system.parent), len(system.rows)
    border = UNKNOWNS * (joints - count)
    return SolutionScratch(
        X=np.zeros((count, system.size)),
        lam=np.zeros((joints, JOINT_ROWS)),
        y=np.zeros(border),
        g=np.zeros(border),
        block=np.zeros(system.size + JOINT_ROWS),
        right=np.zeros((count, system.size)),
        right_lam=np.zeros((joints, JOINT_ROWS)),
    )


def matrices_between(matrices: StepMatrix, instants: slice) -> StepMatrix:
    """Views of a range of entries of matrices whose arrays have a leading axis of instants."""
    return StepMatrix(
        matrices.Lc[instants], matrices.Lp[instants], matrices.Hc[instants], matrices.Hp[instants],
        matrices.Nc[instants], matrices.Jp[instants], matrices.lu[instants], matrices.pivots[instants],
        matrices.Z[instants], matrices.inverse[instants],
    )  # fmt: skip


def allocate_border(system: System) -> Border:
    """Scratch for one system; empty where it has no closed chains."""
    count, joints = len(system.parent), len(system.rows)
    n = UNKNOWNS * (joints - count)
    return Border(
        null=np.zeros((n, n)),
        rank=np.zeros(1, np.int64),
        margin=np.zeros(1),
        S=np.zeros((n, n)),
        decomposition=allocate_decomposition(n),
        moved=np.zeros((count, system.size, n)),
        forces=np.zeros((joints, JOINT_ROWS, n)),
        block=np.zeros((system.size + JOINT_ROWS, n)),
        sets=np.zeros((n, joints, JOINT_ROWS)),
    )


@kernel
def matrix_at(matrices: StepMatrix, n: int) -> StepMatrix:
    """Views of entry n of matrices whose arrays have a leading axis of instants."""
    return StepMatrix(
        matrices.Lc[n], matrices.Lp[n], matrices.Hc[n], matrices.Hp[n], matrices.Nc[n], matrices.Jp[n],
        matrices.lu[n], matrices.pivots[n], matrices.Z[n], matrices.inverse[n],
    )  # fmt: skip
