"""Arrays of the linearised equations of consecutive instants."""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.linear_solver.step_matrix import UNKNOWNS, StepMatrix, matrices_between
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.support.by_reference import by_reference


@by_reference
class LinearizedSteps(NamedTuple):
    """Linearised equations of consecutive instants, all arrays with a leading axis of instants.

    Attributes:
        P, D: See `Blocks`.
        matrix: The eliminated step matrices.
        by_angle, by_rate, on_parent, on_rotor: See `Blocks`.
        R: Rotation matrices of the components, shape [B, 3, 3].
        Hv: Derivative of velocities by positions, shape [B, 4, 4], see `assembly.assemble`.
    """

    P: Array
    D: Array
    matrix: StepMatrix
    by_angle: Array
    by_rate: Array
    on_parent: Array
    on_rotor: Array
    R: Array
    Hv: Array


def allocate_steps(system: System, instants: int) -> LinearizedSteps:
    """Zeroed arrays for so many instants."""
    count, size, joints, m = len(system.parent), system.size, len(system.rows), JOINT_ROWS
    chains = joints - count
    border = UNKNOWNS * chains

    def zeros(*shape: int) -> Array:
        return np.zeros((instants, *shape))

    matrix = StepMatrix(
        Lc=zeros(joints, size, m),
        Lp=zeros(joints, size, m),
        Hc=zeros(chains, m, size),
        Hp=zeros(joints, m, size),
        Nc=zeros(joints, size, 3),
        Jp=zeros(joints, 3, size),
        lu=zeros(count, size + m, size + m),
        pivots=np.zeros((instants, count, size + m), np.int32),
        Z=zeros(count, size + m, m),
        inverse=zeros(border, border),
    )
    return LinearizedSteps(
        P=zeros(count, size, size),
        D=zeros(count, size, size),
        matrix=matrix,
        by_angle=zeros(joints, m),
        by_rate=zeros(joints, m),
        on_parent=zeros(joints, size),
        on_rotor=zeros(joints, 2),
        R=zeros(count, 3, 3),
        Hv=zeros(count, 4, 4),
    )


def steps_between(steps: LinearizedSteps, instants: slice) -> LinearizedSteps:
    """Views of a range of instants."""
    return LinearizedSteps(
        P=steps.P[instants],
        D=steps.D[instants],
        matrix=matrices_between(steps.matrix, instants),
        by_angle=steps.by_angle[instants],
        by_rate=steps.by_rate[instants],
        on_parent=steps.on_parent[instants],
        on_rotor=steps.on_rotor[instants],
        R=steps.R[instants],
        Hv=steps.Hv[instants],
    )


def bytes_of_an_instant(system: System) -> int:
    """Memory of the linearised equations of one instant [bytes]."""
    steps = allocate_steps(system, 1)
    others = (steps.P, steps.D, steps.by_angle, steps.by_rate, steps.on_parent, steps.on_rotor, steps.R, steps.Hv)
    return sum(array.nbytes for array in (*steps.matrix, *others))
