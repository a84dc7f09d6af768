"""Static equilibrium under gravity at given joint angles."""

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators.newton import correct, largest_entry, rounding_floor, worst_component
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.assembly import assemble, joint_rows
from calmotion.multibody.linear_solver.closed_chains import factor_closed_chains, solve_system
from calmotion.multibody.linear_solver.elimination import factor
from calmotion.multibody.linear_solver.least_multipliers import least_multipliers
from calmotion.multibody.model.system import LARGEST_EFFORT, POSITION_GAIN, Integrator, State, System, allocate_state
from calmotion.multibody.statics.regularized_statics import (
    is_regularized,
    moves_nothing,
    regularize,
    without_regularization,
)

STATIC = Integrator(velocity=0.0, acceleration=0.0, gamma=0.0, alpha=1.0)
TOLERANCE = 3e-11  # of a correction, in `System.unit`
CREEP = 0.5  # of the correction before it, above which the weak springs of free joints may hold up an iteration
LIMIT = 400  # iterations
LOAD_STEP_LIMIT = 30  # of a load step
PSEUDO_TIME = (1e2, 1e4, 1e6)  # first factors of the mass matrix, 1/time^2
NEAR_LIMIT = 0.5  # of a motor's largest torque: up to there the smooth limit has its slope
OPEN = 2e-3  # joints that stay open by more do not meet: share of a length of the mechanism [rad]
FIRST_LOAD_STEP, SMALLEST_LOAD_STEP = 0.2, 1e-3  # fractions of gravity


def linearize(system: System, state: State, angle: Array, ws: Workspace) -> None:
    """Residual and blocks of the static equations at a state, into the workspace.

    Args:
        angle: Angle [rad] (or length [m]) of each joint, shape [J].
    """
    Hv, Vd = ws.scratch.Hv, ws.scratch.Vd
    Hv[:] = 0.0
    Vd[:] = 0.0
    assemble(system, STATIC, state, Vd, angle, np.zeros_like(angle), Hv, True, ws.work, ws.blocks)


def compile_joint_rows(system: System) -> None:
    """Compile the largest part of what `linearize` compiles, and its last."""
    ws = Workspace.for_system(system)
    joint_rows(system, STATIC, 0, 0.0, 0.0, allocate_state(system), ws.scratch.Hv, True, ws.work, ws.blocks)


def equilibrium(system: System, start: State, angle: Array, ws: Workspace) -> tuple[State, int]:
    """The state at rest in which gravity, elasticity and the joints are in balance.

    Newton's method from the given pose. Where it does not converge, gravity is increased in steps (load stepping);
    where joints move freely, or load stepping fails, the mass matrix over a growing pseudo time step squared is added
    (pseudo-transient continuation), which leads to a stable equilibrium. A component that no stiffness acts on, as a
    wheel, keeps its pose.

    Returns:
        The state and the number of iterations.

    Raises:
        SimulationFailure: The joints of a closed chain do not meet at these angles (`Reason.OPEN`); or no equilibrium
            was found, and the state is that of the largest fraction of gravity that has one.
    """
    used, gaps = 0, None
    start = _within_limits(system, start, angle)
    reached, share, component = start, 0.0, 0
    free = bool(np.any((system.rows > 0) & (system.rows < 6)))
    for method in ("pseudo-transient", "load stepping") if free else ("newton", "load stepping", "pseudo-transient"):
        if method == "load stepping":
            reached, share, component, iterations = _by_load_stepping(system, start, angle, ws)
            used += iterations
            if share == 1.0:
                gaps = _open_rows(system, ws)
                if gaps is None:
                    return reached, used
            continue
        for inertia in (0.0,) if method == "newton" else PSEUDO_TIME[free:]:
            state = _at_rest(start)
            component, iterations = _iterate(system, state, angle, ws, inertia)
            used += iterations
            if component < 0:
                gaps = _open_rows(system, ws)
                if gaps is None:
                    state.turn[:] = 0.0
                    return state, used
    if gaps is None and len(system.rows) > len(system.parent):  # else joints meet wherever there is an equilibrium
        gaps = open_without_gravity(system, start, angle, ws)
    if gaps is not None:
        joint = int(np.argmax(np.abs(gaps).max(axis=1)))
        raise SimulationFailure(0.0, joint, Reason.OPEN, gap=gaps[joint])
    raise SimulationFailure(0.0, max(component, 0), Reason.NO_EQUILIBRIUM, reached if share else None, share)


def _within_limits(system: System, start: State, angle: Array) -> State:
    """The start with the rotors of servos at their commands that are so far away that their motors would be at the
    limit of their torque, whatever the pose: that has no slope."""
    servos = system.servos
    place = system.side[servos, 1], system.rotor[servos]
    far = system.servo[servos, POSITION_GAIN] * np.abs(angle[servos] - start.u[place])
    u = start.u.copy()
    u[place] = np.where(far > NEAR_LIMIT * system.servo[servos, LARGEST_EFFORT], angle[servos], u[place])
    return start._replace(u=u)


def _at_rest(start: State) -> State:
    state = State(*[part.copy() for part in start])
    state.turn[:] = 0.0
    state.V[:] = 0.0
    return state


def _open_rows(system: System, ws: Workspace) -> Array | None:
    """The gaps of all joints at the state that was linearised last, shape [J, 6] [m, rad]; None where joints meet.

    Where motors contradict each other in a closed chain, the pseudo-inverse of its rows finds the pose of the smallest
    gaps, and corrections vanish there as they do in an equilibrium.
    """
    gaps = np.abs(ws.blocks.gap)
    gaps[:, :3] /= system.unit[0, 0]
    return ws.blocks.gap.copy() if gaps.max(initial=0.0) > OPEN else None


def open_without_gravity(system: System, start: State, angle: Array, ws: Workspace) -> Array | None:
    """The gaps of all joints in the equilibrium without gravity near a state, shape [J, 6] [m, rad]; None if they meet,
    or if there is none: it is not the load that has no equilibrium where they do not meet."""
    weightless = system._replace(gravity=np.zeros_like(system.gravity))
    component, iterations = _iterate(weightless, _at_rest(start), angle, ws, PSEUDO_TIME[-1])
    return _open_rows(system, ws) if component < 0 or iterations == LIMIT else None  # else its system is singular


def _by_load_stepping(system: System, start: State, angle: Array, ws: Workspace) -> tuple[State, float, int, int]:
    """Equilibrium under gravity that is increased in steps: the last one, its fraction of gravity, the component of the
    failure (-1 where all of gravity was reached), and the iterations."""
    reached, share, load_step, used, component = _at_rest(start), 0.0, FIRST_LOAD_STEP, 0, -1
    while share < 1.0 and load_step >= SMALLEST_LOAD_STEP:
        load_step = min(load_step, 1.0 - share)
        state = State(*[part.copy() for part in reached])
        lighter = system._replace(gravity=(share + load_step) * system.gravity)
        failed, iterations = _iterate(lighter, state, angle, ws, 0.0, LOAD_STEP_LIMIT)
        used += iterations
        if failed < 0:
            reached, share, load_step, component = state, share + load_step, 2.0 * load_step, -1
            reached.turn[:] = 0.0
        else:
            load_step, component = 0.5 * load_step, failed
    return reached, share, component, used


def _iterate(
    system: System, state: State, angle: Array, ws: Workspace, inertia: float, limit: int = LIMIT
) -> tuple[int, int]:
    """Newton or pseudo-transient iteration in place; (-1, iterations), or the component where it failed."""
    x, lam, solution, border = ws.scratch.x, ws.scratch.lam, ws.scratch.solution, ws.scratch.border
    chains_closed = len(system.rows) > len(system.parent)
    before = allocate_state(system)
    previous = np.inf
    for iteration in range(limit):
        linearize(system, state, angle, ws)
        blocks = ws.blocks
        blocks.K[:] += inertia * blocks.D
        regularize(system, blocks.K, blocks.Lc, blocks.Nc)
        component = factor(system, blocks, ws.matrix, solution.block)
        if component >= 0:
            return component, iteration + 1
        x[:] = -blocks.res
        lam[:] = -blocks.gap
        if chains_closed:
            factor_closed_chains(system, ws.matrix, border)
        solve_system(system, ws.matrix, x, lam, solution)
        size = float(largest_entry(system, x))
        exact = max(TOLERANCE, rounding_floor(system, state))
        settled = size < exact
        if not settled and inertia == 0.0 and size > CREEP * previous and is_regularized(system):
            settled = moves_nothing(system, ws.matrix, x, lam, solution, exact)
            if not settled:
                x[:], lam[:] = without_regularization(system, ws.matrix, x, lam, solution)
                size = float(largest_entry(system, x))
        if not np.isfinite(size):
            return worst_component(system, x), iteration + 1
        # a step keeps each component's rotation moderate, so that the linearisation is valid
        scale = min(1.0, 0.5 / max(size, 1e-300))
        x *= scale
        lam *= scale
        before.q[:] = state.q
        state.turn[:] = 0.0
        correct(system, before, state, ws.work.R, x, lam, 1.0, ws.scratch.T)
        if settled and inertia == 0.0:
            if chains_closed:
                least_multipliers(system, border, state.lam)
            return -1, iteration + 1
        if inertia > 0.0:
            # switched evolution relaxation: inertia decreases with the correction, to zero at the end
            inertia *= 0.5 if size <= previous else 1.5
            if inertia < 1e-6 or size < 1e-6:
                inertia = 0.0
        previous = size
    return worst_component(system, x), limit
