"""The simulation linearised about a trajectory: blocks and factors of every instant, for `sweeps`; compiled.

A perturbation at instant n is (R^T dc, dphi, du) of each component. With (dV, dtheta) following from it and the
earlier instants by the backward differences of `bdf2`, each step reads

    K z_n = -( P h_V + D h_A + r_theta dtheta_m + r_rate dtheta_m' )

with h_V, h_A the part of dV, dV' that earlier instants determine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels import kernel
from ..shot.character import Array, IntArray
from .assembly import assemble
from .bdf2 import position_to_velocity, velocities
from .elimination import factor
from .failure import SimulationFailure
from .loops import UNKNOWNS, copy_rows, factor_loops
from .schemes import bdf2_scheme
from .simulation import Trajectory, Workspace, instant_of
from .statics import STATIC
from .system import JOINT_ROWS, Blocks, System


@dataclass(frozen=True, eq=False)
class Linearization:
    """What the sweeps need of every instant: blocks of `system.Blocks`, factors, rotations, velocity maps."""

    system: System
    trajectory: Trajectory
    data: tuple[Array, ...]
    pivots: IntArray


@kernel
def _linearize(system, static, scheme, h, states, angles, rates, world, work, blocks, scratch, data, pivots):
    """Blocks and factors of all instants; returns -1 or the component that is singular, and the instant."""
    J, T, Wt, Vd, block, border = scratch.J, scratch.T, scratch.Wt, scratch.Vd, scratch.block, scratch.border
    P, D, Lc, Lp, Hc, Hp, Nc, Jp, by_angle, by_rate, on_parent, lu, Z, inverse, R, Hv = data
    count, size = Vd.shape
    joints = len(system.rows)
    for n in range(len(angles)):
        now = instant_of(states, n)
        if n == 0:
            for b in range(count):
                for i in range(4):
                    for k in range(4):
                        Hv[0, b, i, k] = 0.0
                for i in range(size):
                    Vd[b, i] = 0.0
        else:
            before = instant_of(states, n - 1)
            before2 = instant_of(states, max(n - 2, 0))
            velocities(system, h, now, before, before2, J, Vd)
            position_to_velocity(system, h, now, before, J, T, Wt, Hv[n])
        copy_rows(world[n], work.world)
        # the sweeps read these in place, so they are made there
        here = Blocks(
            blocks.K, P[n], D[n], Lc[n], Lp[n], blocks.Hc, Hp[n], Nc[n], Jp[n], by_angle[n], by_rate[n], on_parent[n],
            blocks.res, blocks.gap,
        )  # fmt: skip
        kind = static if n == 0 else scheme
        assemble(
            system, kind, now.c, now.q, now.u, now.V, Vd, now.lam, angles[n], rates[n], Hv[n], True, work, here
        )  # fmt: skip
        bad = factor(system, here, lu[n], pivots[n], Z[n], block)
        if bad >= 0:
            return bad, n
        if joints > count:
            for j in range(count, joints):
                copy_rows(blocks.Hc[j], Hc[n, j - count])
            factor_loops(system, Lc[n], Lp[n], Hc[n], Hp[n], Nc[n], Jp[n], lu[n], pivots[n], Z[n], border, block)
            copy_rows(border.inverse, inverse[n])
        for b in range(count):
            for i in range(3):
                for k in range(3):
                    R[n, b, i, k] = work.R[b, i, k]
    return -1, 0


def linearize(
    system: System,
    trajectory: Trajectory,
    angles: Array,
    rates: Array,
    workspace: Workspace,
    previous: Linearization | None = None,
) -> Linearization:
    """Linearise a simulation about its trajectory.

    Args:
        angles, rates: The joint angles (or lengths) and rates it was simulated with, shape [T, J].
        previous: A linearisation of the same size whose memory is used again (it becomes invalid).

    Raises:
        SimulationFailure: A singular step, or one that had to be refined: its equations are not those of the others.
        ValueError: A simulation by another integrator than BDF2, whose sweeps these are.
    """  # fmt: skip
    if trajectory.integrator != "bdf2":
        raise ValueError("sweeps are those of BDF2")
    if trajectory.refined:
        raise SimulationFailure(trajectory.refined[0] * trajectory.h, 0, "refined")
    total, count, size, joints = len(angles), len(system.parent), system.size, len(system.rows)
    loops = joints - count
    if previous is not None and previous.data[0].shape[0] == total:
        data, pivots = previous.data, previous.pivots
    else:

        def zeros(*shape: int) -> Array:
            return np.zeros((total,) + shape)

        m, border = JOINT_ROWS, UNKNOWNS * loops
        data = (
            zeros(count, size, size), zeros(count, size, size), zeros(joints, size, m), zeros(joints, size, m),
            zeros(loops, m, size), zeros(joints, m, size), zeros(joints, size, 3), zeros(joints, 3, size),
            zeros(joints, m), zeros(joints, m), zeros(joints, size), zeros(count, size + m, size + m),
            zeros(count, size + m, m), zeros(border, border), zeros(count, 3, 3), zeros(count, 4, 4),
        )  # fmt: skip
        pivots = np.zeros((total, count, size + JOINT_ROWS), np.int32)
    ws = workspace
    bad, instant = _linearize(
        system, STATIC, bdf2_scheme(trajectory.h), trajectory.h, trajectory.states, angles, rates, trajectory.world,
        ws.work, ws.blocks, ws.scratch, data, pivots,
    )  # fmt: skip
    if bad >= 0:
        raise SimulationFailure(instant * trajectory.h, bad, "singular")
    return Linearization(system, trajectory, data, pivots)
