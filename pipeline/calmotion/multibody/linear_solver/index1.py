"""The index-1 form: accelerations and multipliers at a state, the constraints differentiated twice; compiled.

    M V' + (forces) = (constraint forces),     C'' + 2 a C' + a^2 C = 0

with Baumgarte's coefficient a, which holds positions and velocities to the constraints where they are integrated
without them (J. Baumgarte, Stabilization of constraints and integrals of motion, 1972).
"""

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.integrators.newton import solve_correction
from calmotion.multibody.integrators.workspace import Scratch, Workspace
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.kernels.sliders import LENGTH, slides_freely
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.kernels.work import Work
from calmotion.multibody.linear_solver.closed_chains import copy_rows, factor_closed_chains
from calmotion.multibody.linear_solver.elimination import factor
from calmotion.multibody.linear_solver.least_multipliers import least_multipliers
from calmotion.multibody.model.system import JOINT_ROWS, Blocks, Integrator, State, System
from calmotion.support.compilation import NO, YES, inlined_kernel, shared_kernel

VELOCITY_ROWS = Integrator(velocity=0.0, acceleration=0.0, gamma=1.0, alpha=0.0)
POSITION_ROWS = Integrator(velocity=0.0, acceleration=0.0, gamma=0.0, alpha=1.0)


@inlined_kernel
def _velocity_coordinates(system: System, V: Array, work: Work, moving: Array) -> None:
    """Rates of the coordinates (R^T dc, dphi, du) into `moving`, shape [B, N]."""
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            moving[b, i] = V[b, i]
        for i in range(3):
            moving[b, i] = work.R[b, 0, i] * V[b, 0] + work.R[b, 1, i] * V[b, 1] + work.R[b, 2, i] * V[b, 2]


@inlined_kernel
def _acceleration_constraints(
    system: System, rate: Array, acceleration: Array, baumgarte: float, blocks: Blocks, scratch: Scratch
) -> None:
    """Residual and rows of the constraints differentiated twice, in place of those by velocity."""
    moving = scratch.taken
    for j in range(len(system.rows)):
        p = system.side[j, 0]
        b = system.side[j, 1]
        free = slides_freely(system, j)
        for i in range(JOINT_ROWS):
            t = blocks.by_angle[j, i] * rate[j] + blocks.by_rate[j, i] * acceleration[j]
            for a in range(6 + system.elastic[b]):
                t += blocks.Hc[j, i, a] * moving[b, a]
            if p >= 0:
                for a in range(6 + system.elastic[p]):
                    t += blocks.Hp[j, i, a] * moving[p, a]
            # the length of a free slider is no unknown of this form
            length = free and i == LENGTH
            blocks.gap[j, i] = 0.0 if length else t + 2.0 * baumgarte * blocks.gap[j, i] + scratch.taken_lam[j, i]
            for a in range(6 + system.elastic[b]):
                blocks.Hc[j, i, a] = 0.0 if length else -blocks.Lc[j, a, i]
            if p >= 0:
                for a in range(6 + system.elastic[p]):
                    if length:
                        blocks.Lp[j, a, i] = 0.0
                    blocks.Hp[j, i, a] = -blocks.Lp[j, a, i]
    blocks.Nc[:] = 0.0
    blocks.Jp[:] = 0.0
    for b in range(len(system.parent)):
        copy_rows(blocks.D[b], blocks.K[b])


@shared_kernel
def accelerations(
    system: System, state: State, angle: Array, rate: Array, acceleration: Array, baumgarte: float, ws: Workspace
) -> int:
    """V' = (c'', alpha in body axes, u'') into scratch.Vd, shape [B, N], and multipliers into state.lam.

    Args:
        state: Positions and velocities.
        angle, rate, acceleration: Of each joint's motor, shape [J].
        baumgarte: Baumgarte's coefficient a [1/s]; 0 at a state that satisfies the constraints.

    Returns:
        -1, or the component whose equations are singular.
    """
    count, joints = len(system.parent), len(system.rows)
    work, blocks, scratch = ws.work, ws.blocks, ws.scratch
    Hv, Vd, lam = scratch.Hv, scratch.Vd, scratch.lam
    Hv[:] = 0.0
    Vd[:] = 0.0
    state.lam[:] = 0.0
    for j in range(joints):
        for i in range(JOINT_ROWS):
            scratch.taken_lam[j, i] = 0.0
    if baumgarte > 0.0:
        assemble(system, POSITION_ROWS, state, Vd, angle, rate, Hv, NO, work, blocks)
        for j in range(joints):
            for i in range(JOINT_ROWS):
                scratch.taken_lam[j, i] = baumgarte * baumgarte * blocks.gap[j, i]
    assemble(system, VELOCITY_ROWS, state, Vd, angle, rate, Hv, YES, work, blocks)
    _velocity_coordinates(system, state.V, work, scratch.taken)
    _acceleration_constraints(system, rate, acceleration, baumgarte, blocks, scratch)
    bad = factor(system, blocks, ws.matrix, scratch.solution.block)
    if bad >= 0:
        return bad
    if joints > count:
        factor_closed_chains(system, ws.matrix, scratch.border)
    solve_correction(system, blocks, ws.matrix, scratch)
    if joints > count:
        least_multipliers(system, scratch.border, lam)
    copy_rows(lam, state.lam)
    for b in range(count):
        matrix_of(state.q[b], work.R[b])
        for i in range(3):
            t = 0.0
            for k in range(3):
                t += work.R[b, i, k] * scratch.x[b, k]
            Vd[b, i] = t
        for i in range(3, 6 + system.elastic[b]):
            Vd[b, i] = scratch.x[b, i]
        for i in range(6 + system.elastic[b]):
            if not np.isfinite(Vd[b, i]):
                return b
    return -1
