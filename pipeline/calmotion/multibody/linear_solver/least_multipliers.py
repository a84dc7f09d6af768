"""Multipliers of least norm where constraints are redundant; compiled."""

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.linear_solver.step_matrix import UNKNOWNS, Border
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.support.compilation import kernel, shared_kernel


@shared_kernel
def least_multipliers(system: System, border: Border, lam: Array) -> None:
    """Remove from all multipliers, shape [J, 6], the part that does no work in any motion: redundant constraints share
    the load so that the sum of squares is least, of moments over the length in `System.unit`. After
    `factor_closed_chains`."""
    per_length = 1.0 / system.unit[0, 0]
    joints, count = len(system.rows), len(system.parent)
    n = UNKNOWNS * (joints - count)
    few = n - border.rank[0]
    if few == 0:
        return
    sets = border.sets
    for s in range(few):
        for joint in range(joints):
            for i in range(JOINT_ROWS):
                t = 0.0
                if joint < count:
                    for column in range(n):
                        t -= border.forces[joint, i, column] * border.null[column, s]
                else:
                    t = border.null[UNKNOWNS * (joint - count) + i, s]
                if not has_row(system, joint, i):
                    t = 0.0
                sets[s, joint, i] = t
        for _ in range(2):
            for other in range(s):
                _remove(joints, per_length, sets[other], sets[s])
        size = 0.0
        for joint in range(joints):
            for i in range(JOINT_ROWS):
                size += _weight(i, per_length) * sets[s, joint, i] ** 2
        scale = 1.0 / np.sqrt(size) if size > 0.0 else 0.0
        for joint in range(joints):
            for i in range(JOINT_ROWS):
                sets[s, joint, i] *= scale
    for s in range(few):
        _remove(joints, per_length, sets[s], lam)


@kernel
def _weight(i: int, per_length: float) -> float:
    """Weight of the square of a force or moment."""
    return 1.0 if i < 3 else per_length * per_length


@kernel
def _remove(joints: int, per_length: float, unit: Array, lam: Array) -> None:
    """lam -= (unit . lam) unit."""
    t = 0.0
    for joint in range(joints):
        for i in range(JOINT_ROWS):
            t += _weight(i, per_length) * unit[joint, i] * lam[joint, i]
    for joint in range(joints):
        for i in range(JOINT_ROWS):
            lam[joint, i] -= t * unit[joint, i]
