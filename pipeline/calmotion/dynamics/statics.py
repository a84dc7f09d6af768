"""Static equilibrium under gravity at given joint angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..shot.character import Array
from .assembly import assemble
from .elimination import factor
from .failure import SimulationFailure
from .least_multipliers import least_multipliers
from .loops import factor_loops, solve_system
from .newton import correct, worst_component
from .system import Scheme, State, System, allocate_state

if TYPE_CHECKING:
    from .simulation import Workspace

STATIC = Scheme(velocity=0.0, acceleration=0.0, gamma=0.0, alpha=1.0)
TOLERANCE = 1e-11
LIMIT = 400


def linearize(system: System, state: State, angle: Array, ws: Workspace) -> None:
    """Residual and blocks of the static equations at a state, into the workspace.

    Args:
        angle: Angle [rad] (or length [m]) of each joint, shape [J].
    """
    Hv, Vd = ws.scratch.Hv, ws.scratch.Vd
    Hv[:] = 0.0
    Vd[:] = 0.0
    assemble(
        system, STATIC, state.c, state.q, state.u, state.V, Vd, state.lam, angle, np.zeros_like(angle), Hv, True,
        ws.work, ws.blocks,
    )  # fmt: skip


def equilibrium(system: System, start: State, angle: Array, ws: Workspace) -> tuple[State, int]:
    """The state at rest in which gravity, elasticity and the joints are in balance.

    Newton's method from the given pose; where joints move freely, or it does not converge at once, the mass matrix
    over a growing pseudo time step squared is added, which follows the damped fall into a stable equilibrium.

    Returns:
        The state and the number of iterations.

    Raises:
        SimulationFailure: No equilibrium was found.
    """
    free = bool(np.any((system.rows > 0) & (system.rows < 6)))
    component = 0
    used = 0
    for inertia in (1e4, 1e6) if free else (0.0, 1e2, 1e4, 1e6):
        state = State(*[part.copy() for part in start])
        state.turn[:] = 0.0
        state.V[:] = 0.0
        component, iterations = _iterate(system, state, angle, ws, inertia)
        used += iterations
        if component < 0:
            state.turn[:] = 0.0
            return state, used
    raise SimulationFailure(0.0, component, "no static equilibrium")


def _iterate(system: System, state: State, angle: Array, ws: Workspace, inertia: float) -> tuple[int, int]:
    """Newton or pseudo-transient iteration in place; (-1, iterations), or the component where it failed."""
    x, lam, block, border, T = ws.scratch.x, ws.scratch.lam, ws.scratch.block, ws.scratch.border, ws.scratch.T
    count, loops = len(system.parent), len(system.rows) > len(system.parent)
    before = allocate_state(system)
    previous = np.inf
    for iteration in range(LIMIT):
        linearize(system, state, angle, ws)
        blocks, factors = ws.blocks, ws.factors
        blocks.K[:] += inertia * blocks.D
        component = factor(system, blocks, factors.lu, factors.pivots, factors.Z)
        if component >= 0:
            return component, iteration + 1
        x[:] = -blocks.res
        lam[:] = -blocks.gap
        closing = blocks.Hc[count:]
        tree = (factors.lu, factors.pivots, factors.Z)
        if loops:
            factor_loops(system, blocks.Lc, blocks.Lp, closing, blocks.Hp, blocks.Nc, blocks.Jp, *tree, border, block)
        solve_system(
            system, blocks.Lc, blocks.Lp, closing, blocks.Hp, blocks.Nc, blocks.Jp, *tree, border.inverse, x, lam,
            border.X, border.lam, border.y, border.x, block,
        )  # fmt: skip
        size = float(np.max(np.abs(x)))
        if not np.isfinite(size):
            return worst_component(system, x), iteration + 1
        # a step keeps each component's turn moderate, so that the linearisation means something
        scale = min(1.0, 0.5 / max(size, 1e-300))
        x *= scale
        lam *= scale
        before.q[:] = state.q
        state.turn[:] = 0.0
        correct(system, before, state, ws.work.R, x, lam, 1.0, T)
        if size < TOLERANCE and inertia == 0.0:
            if loops:
                least_multipliers(system, border, state.lam)
            return -1, iteration + 1
        if inertia > 0.0:
            # switched evolution relaxation: less inertia as the correction shrinks, none at the end
            inertia *= 0.5 if size <= previous else 1.5
            if inertia < 1e-6 or size < 1e-6:
                inertia = 0.0
        previous = size
    return worst_component(system, x), LIMIT
