"""Static equilibrium under gravity at given joint angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.newton import correct, worst_component
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.linear_solver.closed_chains import factor_loops, solve_system
from calmotion.multibody.linear_solver.elimination import factor
from calmotion.multibody.linear_solver.least_multipliers import least_multipliers
from calmotion.multibody.model.system import Scheme, State, System, allocate_state
from calmotion.multibody.statics.regularized_statics import hold
from calmotion.shot.character import Array

if TYPE_CHECKING:
    from calmotion.multibody.integrators.workspace import Workspace

STATIC = Scheme(velocity=0.0, acceleration=0.0, gamma=0.0, alpha=1.0)
TOLERANCE = 1e-11
LIMIT = 400
FEW = 30  # iterations that a small part of gravity must need at most
PSEUDO_TIME = (1e2, 1e4, 1e6)  # first factors of the mass matrix, 1/time^2
FIRST_PART, SMALLEST_PART = 0.2, 1e-3  # of gravity


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

    Newton's method from the given pose. Where it does not converge at once gravity is brought up in parts; where joints
    move freely, or that fails too, the mass matrix over a growing pseudo time step squared is added, which follows the
    damped fall into a stable equilibrium. What nothing holds or moves, as a wheel, stays where it is.

    Returns:
        The state and the number of iterations.

    Raises:
        SimulationFailure: No equilibrium was found; with that under the largest part of gravity that has one.
    """
    used = 0
    reached, share, component = start, 0.0, 0
    free = bool(np.any((system.rows > 0) & (system.rows < 6)))
    for method in ("fall", "parts") if free else ("newton", "parts", "fall"):
        if method == "parts":
            reached, share, component, iterations = _in_parts(system, start, angle, ws)
            used += iterations
            if share == 1.0:
                return reached, used
            continue
        for inertia in (0.0,) if method == "newton" else PSEUDO_TIME[free:]:
            state = _at_rest(start)
            component, iterations = _iterate(system, state, angle, ws, inertia)
            used += iterations
            if component < 0:
                state.turn[:] = 0.0
                return state, used
    raise SimulationFailure(0.0, max(component, 0), "no static equilibrium", reached if share else None, share)


def _at_rest(start: State) -> State:
    state = State(*[part.copy() for part in start])
    state.turn[:] = 0.0
    state.V[:] = 0.0
    return state


def _in_parts(system: System, start: State, angle: Array, ws: Workspace) -> tuple[State, float, int, int]:
    """Gravity brought up from a little: the equilibrium reached, under which part of it, the component where it ended
    (-1 where all of it was reached), and the iterations."""
    reached, share, part, used, component = _at_rest(start), 0.0, FIRST_PART, 0, -1
    while share < 1.0 and part >= SMALLEST_PART:
        more = min(part, 1.0 - share)
        state = State(*[item.copy() for item in reached])
        lighter = system._replace(gravity=(share + more) * system.gravity)
        failed, iterations = _iterate(lighter, state, angle, ws, 0.0, FEW)
        used += iterations
        if failed < 0:
            reached, share, part, component = state, share + more, 2.0 * more, -1
            reached.turn[:] = 0.0
        else:
            part, component = 0.5 * more, failed
    return reached, share, component, used


def _iterate(
    system: System, state: State, angle: Array, ws: Workspace, inertia: float, limit: int = LIMIT
) -> tuple[int, int]:
    """Newton or pseudo-transient iteration in place; (-1, iterations), or the component where it failed."""
    x, lam, block, border, T = ws.scratch.x, ws.scratch.lam, ws.scratch.block, ws.scratch.border, ws.scratch.T
    count, loops = len(system.parent), len(system.rows) > len(system.parent)
    before = allocate_state(system)
    previous = np.inf
    for iteration in range(limit):
        linearize(system, state, angle, ws)
        blocks, factors = ws.blocks, ws.factors
        blocks.K[:] += inertia * blocks.D
        hold(system, blocks.D, blocks.K, blocks.Nc)
        component = factor(system, blocks, factors.lu, factors.pivots, factors.Z, block)
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
    return worst_component(system, x), limit
