"""The arrays that a simulation writes to besides its trajectory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.kernels.work import Work, allocate_work
from calmotion.multibody.linear_solver.step_matrix import (
    Border,
    SolutionScratch,
    StepMatrix,
    allocate_border,
    allocate_solution,
    step_matrix,
)
from calmotion.multibody.model.system import JOINT_ROWS, Blocks, State, System, allocate_blocks, allocate_state
from calmotion.support.by_reference import by_reference


@by_reference
class Scratch(NamedTuple):
    """Scratch of a step, besides `Work`, `Blocks` and `StepMatrix`.

    Attributes:
        J, T, Wt: Small matrices, shape [3, 3].
        Hv: Derivative of velocities by positions, shape [B, 4, 4], see `assembly.assemble`.
        Vd: Accelerations, shape [B, N].
        x, lam: Correction, shapes [B, N] and [J, 6].
        solution, border: Scratch of the linear system.
        memory: Accelerations of the instant before: those of the motion, those of Newmark's formulas, and room for the
            new ones of these; then what the prediction of that instant missed (`predictor`), shape [4, B, N]. Zero
            before a start at rest.
        start: The state that was predicted.
        kept: The state before a correction.
        taken, taken_lam: That correction.
    """

    J: Array
    T: Array
    Wt: Array
    Hv: Array
    Vd: Array
    x: Array
    lam: Array
    solution: SolutionScratch
    border: Border
    memory: Array
    start: State
    kept: State
    taken: Array
    taken_lam: Array


def allocate_scratch(system: System) -> Scratch:
    """Scratch for one system."""
    count, size, joints = len(system.parent), system.size, len(system.rows)
    return Scratch(
        J=np.zeros((3, 3)),
        T=np.zeros((3, 3)),
        Wt=np.zeros((3, 3)),
        Hv=np.zeros((count, 4, 4)),
        Vd=np.zeros((count, size)),
        x=np.zeros((count, size)),
        lam=np.zeros((joints, JOINT_ROWS)),
        solution=allocate_solution(system),
        border=allocate_border(system),
        memory=np.zeros((4, count, size)),
        start=allocate_state(system),
        kept=allocate_state(system),
        taken=np.zeros((count, size)),
        taken_lam=np.zeros((joints, JOINT_ROWS)),
    )


@by_reference
class Workspace(NamedTuple):
    """Everything a simulation writes to besides its trajectory; made once for a system, not shared by threads."""

    work: Work
    blocks: Blocks
    matrix: StepMatrix
    scratch: Scratch

    @classmethod
    def for_system(cls, system: System) -> Workspace:
        """Allocate for one system."""
        blocks = allocate_blocks(system)
        return cls(allocate_work(system), blocks, step_matrix(system, blocks), allocate_scratch(system))
