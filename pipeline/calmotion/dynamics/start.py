"""Starting in motion: consistent accelerations at the first instant, and the instant before it.

BDF2 needs two earlier instants. From rest in equilibrium the one before the start is the start itself. Otherwise it is
continued backwards to second order, x(-h) = x - h V + h^2/2 a, V(-h) = V - h a, which keeps the scheme's order; a
follows from the equations of motion with the constraints differentiated once more.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..shot.character import Array
from .assembly import assemble
from .elimination import factor
from .failure import SimulationFailure
from .least_multipliers import least_multipliers
from .loops import factor_loops, solve_system
from .sliders import LENGTH, slides_freely
from .so3 import turn
from .system import Scheme, State, System

if TYPE_CHECKING:
    from .simulation import Workspace

VELOCITY_ONLY = Scheme(velocity=0.0, acceleration=0.0, gamma=1.0, alpha=0.0)


def initial_acceleration(
    system: System, state: State, angle: Array, rate: Array, acceleration: Array, ws: Workspace
) -> tuple[Array, Array]:
    """Accelerations (c'', alpha in body axes, u'') and multipliers that the equations ask for at a state.

    Args:
        state: Positions and velocities that satisfy the constraints; its multipliers are not used.
        angle, rate, acceleration: Of each joint's motor, shape [J].

    Returns:
        Accelerations, shape [B, N], and multipliers, shape [J, 6].

    Raises:
        SimulationFailure: A singular system.
    """
    blocks, factors, scratch = ws.blocks, ws.factors, ws.scratch
    x, lam, block, border = scratch.x, scratch.lam, scratch.block, scratch.border
    count = len(system.parent)
    Hv, Vd, none = np.zeros_like(scratch.Hv), np.zeros_like(state.V), np.zeros_like(state.lam)
    assemble(
        system, VELOCITY_ONLY, state.c, state.q, state.u, state.V, Vd, none, angle, rate, Hv, True, ws.work, blocks
    )  # fmt: skip
    # motion of the coordinates (R^T dc, dphi, du) by the velocities
    moving = state.V.copy()
    moving[:, :3] = np.einsum("bik,bi->bk", ws.work.R, state.V[:, :3])
    x[:] = -blocks.res
    for joint, (p, b) in enumerate(system.side):
        n = 6 + system.elastic[b]
        if slides_freely(system, joint):
            # at the level of accelerations its length is no unknown
            blocks.Lp[joint, :, LENGTH] = 0.0
            blocks.Hc[joint, LENGTH], blocks.Hp[joint, LENGTH] = 0.0, 0.0
        drift = blocks.Hc[joint, :, :n] @ moving[b, :n]
        drift += blocks.by_angle[joint] * rate[joint] + blocks.by_rate[joint] * acceleration[joint]
        blocks.Hc[joint, :, :n] = -blocks.Lc[joint, :n].T
        if p >= 0:
            m = 6 + system.elastic[p]
            drift += blocks.Hp[joint, :, :m] @ moving[p, :m]
            blocks.Hp[joint, :, :m] = -blocks.Lp[joint, :m].T
        lam[joint] = -drift
    blocks.Nc[:], blocks.Jp[:] = 0.0, 0.0
    blocks.K[:] = blocks.D
    bad = factor(system, blocks, factors.lu, factors.pivots, factors.Z)
    if bad >= 0:
        raise SimulationFailure(0.0, bad, "singular")
    closing, tree = blocks.Hc[count:], (factors.lu, factors.pivots, factors.Z)
    shared = (blocks.Lc, blocks.Lp, closing, blocks.Hp, blocks.Nc, blocks.Jp, *tree)
    if len(system.rows) > count:
        factor_loops(system, *shared, border, block)
    solve_system(system, *shared, border.inverse, x, lam, border.X, border.lam, border.y, border.x, block)
    if len(system.rows) > count:
        least_multipliers(system, border, lam)
    result = x.copy()
    result[:, :3] = np.einsum("bik,bk->bi", ws.work.R, x[:, :3])
    return result, lam.copy()


def instant_before(system: System, state: State, acceleration: Array, h: float) -> tuple[State, Array]:
    """The state a step earlier, to second order, and the turn from it to the given one, shape [B, 3]."""
    before = State(*[part.copy() for part in state])
    back = h * state.V - 0.5 * h * h * acceleration
    before.c[:] = state.c - back[:, :3]
    before.u[:] = state.u - back[:, 6:]
    before.V[:] = state.V - h * acceleration
    for b in range(len(system.parent)):
        turn(state.q[b], -back[b, 3:6], before.q[b])
    return before, back[:, 3:6]
