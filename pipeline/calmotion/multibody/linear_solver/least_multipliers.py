"""Multipliers of least norm where constraints are redundant; compiled."""

from __future__ import annotations

import numpy as np

from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.linear_solver.closed_chains import UNKNOWNS
from calmotion.multibody.model.system import JOINT_ROWS
from calmotion.support.compilation import kernel


@kernel
def least_multipliers(system, border, lam):
    """Take from all multipliers, shape [J, 6], what does no work in any motion: redundant constraints share the load
    so that the sum of squares is least. After `factor_loops`."""
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
                        t += border.free[column, joint, i] * border.null[column, s]
                else:
                    t = border.null[UNKNOWNS * (joint - count) + i, s]
                if not has_row(system, joint, i):
                    t = 0.0
                sets[s, joint, i] = t
        for _ in range(2):
            for other in range(s):
                _remove(joints, sets[other], sets[s])
        size = 0.0
        for joint in range(joints):
            for i in range(JOINT_ROWS):
                size += sets[s, joint, i] ** 2
        scale = 1.0 / np.sqrt(size) if size > 0.0 else 0.0
        for joint in range(joints):
            for i in range(JOINT_ROWS):
                sets[s, joint, i] *= scale
    for s in range(few):
        _remove(joints, sets[s], lam)


@kernel
def _remove(joints, unit, lam):
    """lam -= (unit . lam) unit."""
    t = 0.0
    for joint in range(joints):
        for i in range(JOINT_ROWS):
            t += unit[joint, i] * lam[joint, i]
    for joint in range(joints):
        for i in range(JOINT_ROWS):
            lam[joint, i] -= t * unit[joint, i]
