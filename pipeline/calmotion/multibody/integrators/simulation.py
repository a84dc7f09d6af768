"""A forward simulation: static equilibrium at the start, then an implicit integrator over given joint angles."""

import time
from collections.abc import Callable, Sequence

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.failure import NOWHERE, Reason, SimulationFailure
from calmotion.multibody.integrators import bdf2, newton
from calmotion.multibody.integrators.coefficients import IMPLICIT, MISSED, remember_missed
from calmotion.multibody.integrators.refinement import TURNED, parts_of_turn, refined_step, resolved_step
from calmotion.multibody.integrators.trajectory import (
    Inputs,
    Record,
    Trajectory,
    copy_of_instant,
    instant_of,
    instants_of,
)
from calmotion.multibody.integrators.workspace import Scratch, Workspace
from calmotion.multibody.kernels.joints import joint_kinematics
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.kernels.work import Work
from calmotion.multibody.linear_solver.closed_chains import copy_rows
from calmotion.multibody.model.moving_markers import rooted
from calmotion.multibody.model.phases import EULER, Phase, phases_of, still, system_held
from calmotion.multibody.model.system import Instants, Integrator, State, System
from calmotion.multibody.statics.consistent_start import initial_acceleration, instant_before
from calmotion.multibody.statics.equilibrium import equilibrium
from calmotion.support.compilation import NO, kernel


@kernel
def _largest_gap(system: System, angle: Array, rate: Array, now: State, work: Work) -> float:
    gap = 0.0
    for b in range(len(system.parent)):
        matrix_of(now.q[b], work.R[b])
    for joint in range(len(system.rows)):
        if system.rows[joint] == 0 or system.contact[joint] != 0:
            continue
        joint_kinematics(system, joint, angle[joint], rate[joint], now, work)
        d = 0.0
        for i in range(3):
            d += (work.j.p[i] - work.i.p[i]) ** 2
        gap = max(gap, np.sqrt(d))
    return gap


@kernel
def largest_gap(system: System, inputs: Inputs, states: State, work: Work) -> float:
    """Largest position gap of a joint over a trajectory [m]."""
    gap = 0.0
    for n in range(len(inputs.angles)):
        copy_rows(inputs.world[n], work.world)
        gap = max(gap, _largest_gap(system, inputs.angles[n], inputs.rates[n], instant_of(states, n), work))
    return gap


@kernel
def _advance(
    system: System, integrator: Integrator, first: int, last: int, inputs: Inputs, record: Record, ws: Workspace,
    divided: IntArray, kept: Array,
) -> tuple[int, int, int]:  # fmt: skip
    """Steps first..last-1 of a trajectory, with their margins and costs; returns (code, instant, component).

    Args:
        divided: As of `simulate`, and filled; shape [0] where no step is divided as friction turns.
        kept: Becomes the memory before the last step, shape [4, B, N]. After a step that is to be divided, the code is
            `TURNED`.
    """
    for n in range(first, last):
        if len(divided) > 0:
            for row in range(len(kept)):
                copy_rows(ws.scratch.memory[row], kept[row])
        angle, rate = inputs.angles[n], inputs.rates[n]
        instants = instants_of(record.earlier, record.states, n)
        copy_rows(inputs.world[n], ws.work.world)
        code, factorisations, solutions, component = newton.step(system, integrator, instants, angle, rate, NO, ws)
        record.costs[n, 0] += solutions
        record.costs[n, 1] += factorisations
        if code != newton.CONVERGED:
            return code, n, component
        record.margins[n] = ws.scratch.border.margin[0]
        record.costs[n, 2] = _largest_gap(system, angle, rate, instants.now, ws.work)
        if len(divided) > 0:
            if divided[n] == 0:
                divided[n] = parts_of_turn(system, instants.before, instants.now)
            if divided[n] > 1:
                return TURNED, n, -1
    return newton.CONVERGED, last, -1


@kernel
def _recall(system: System, h: float, record: Record, n: int, scratch: Scratch) -> None:
    """The memory of BDF2 after instant n >= 1 of a trajectory that began at rest; scratch.memory is zero before."""
    if n > 1:
        bdf2.velocities(system, h, instants_of(record.earlier, record.states, n - 1), scratch.J, scratch.Vd)
        copy_rows(scratch.Vd, scratch.memory[0])
    remember_missed(system, h, instant_of(record.states, n - 1), instant_of(record.states, n), scratch.memory)
    bdf2.velocities(system, h, instants_of(record.earlier, record.states, n), scratch.J, scratch.Vd)
    copy_rows(scratch.Vd, scratch.memory[0])


def simulate(
    system: System, start: State, angles: Array, rates: Array, h: float, workspace: Workspace,
    progress: Callable[[float], None] | None = None, from_equilibrium: bool = True, integrator: str = "bdf2",
    world: Array | None = None, divides: bool = True, divided: IntArray | None = None,
) -> Trajectory:  # fmt: skip  # parameters: a system, its start, its drives, its scheme
    """Simulate the system from static equilibrium, or from a state that is given.

    Args:
        start: Where the search for the equilibrium starts (the rigid pose); not changed.
        angles, rates: Angle [rad] (or length [m]) and rate of each joint's motor, shape [T, J].
        h: Time step [s].
        workspace: Scratch of this system.
        progress: Called with a fraction in 0..1 at intervals, or None.
        from_equilibrium: False starts from `start`, with its velocities, in place of the equilibrium.
        integrator: A name of `coefficients.IMPLICIT`.
        world: Moving markers of the world, shape [T, W, 18]; needed where the system has any.
        divides: Whether a step that Newton's method cannot solve is divided into smaller ones (`refinement`).
        divided: Into how many parts each step is divided, shape [T], 0: as the friction of servos needs it; None: into
            none. A simulation with the parts of another one can be compared with it where they hardly differ.

    Returns:
        The trajectory, T instants.

    Raises:
        SimulationFailure: No equilibrium, or a step that cannot be solved.
    """
    begin = time.perf_counter()
    total, ws = len(angles), workspace
    world = rooted(world, total)
    if world.shape[1:] != ws.work.world.shape:
        raise ValueError(f"world must hold the motion of {len(ws.work.world)} markers")
    ws.work.world[:] = world[0]
    held = system_held(system, world[0])
    first, solved = equilibrium(held, start, angles[0], ws) if from_equilibrium else (start, 0)
    states = State(*[np.zeros((total,) + part.shape) for part in first])
    for part, value in zip(states, first, strict=True):
        part[0] = value
    earlier = State(*[part[0] for part in states])  # before the start the system rests
    ws.scratch.memory[:] = 0.0
    if not from_equilibrium:
        motors = np.gradient(rates[:3], h, axis=0)[0] if total > 2 else np.zeros_like(rates[0])
        acceleration, states.lam[0] = initial_acceleration(held, first, angles[0], rates[0], motors, ws)
        earlier, states.turn[0] = instant_before(system, first, acceleration, h)
        ws.scratch.memory[:2] = acceleration
    margins, costs = np.zeros(total), np.zeros((total, 3))
    costs[0, 0] = solved
    inputs, record = Inputs(angles, rates, world), Record(earlier, states, margins, costs)
    return march(system, integrator, h, 1, inputs, record, ws, begin, progress, divides=divides, divided=divided)


def simulate_on(
    system: System, before2: State, before: State, angles: Array, rates: Array, h: float, workspace: Workspace,
    world: Array | None = None,
) -> Trajectory:  # fmt: skip
    """Continue from two instants by BDF2.

    Args:
        before2, before: The states of instants 0 and 1.
        angles, rates: As `simulate` takes them, instants 0 and 1 included.

    Returns:
        The trajectory, T instants, the two that were given included.

    Raises:
        SimulationFailure: A step that cannot be solved.
    """
    begin, total, ws = time.perf_counter(), len(angles), workspace
    states = State(*[np.zeros((total,) + part.shape) for part in before])
    for part, first, second in zip(states, before2, before, strict=True):
        part[0], part[1] = first, second
    ws.scratch.memory[:] = 0.0
    ws.scratch.memory[:2] = (before.V - before2.V) / h
    record = Record(before2, states, np.zeros(total), np.zeros((total, 3)))
    return march(system, "bdf2", h, 2, Inputs(angles, rates, rooted(world, total)), record, ws, begin)


def simulate_from(
    system: System, known: Trajectory, first: int, angles: Array, rates: Array, workspace: Workspace
) -> Trajectory:
    """The result of `simulate` by BDF2, continued from a known simulation with the same beginning.

    Args:
        known: Simulated by BDF2 from static equilibrium; not changed.
        first: Its instants before this one are kept, two or more, the last two of them not refined ones.
        angles, rates: As `simulate` takes them; up to `first` those of the known simulation.

    Returns:
        The trajectory, to the last bit that of a whole simulation; the time of its beginning is the share that it had
        in the known one.

    Raises:
        SimulationFailure: A step that cannot be solved.
    """
    begin, total, ws = time.perf_counter(), len(angles), workspace
    states = State(*[np.zeros_like(part) for part in known.states])
    margins, costs = np.zeros(total), np.zeros((total, 3))
    for part, value in zip((*states, margins, costs), (*known.states, known.margins, known.costs), strict=True):
        part[:first] = value[:first]
    begin -= known.wall_s * float(costs[:, 0].sum()) / max(1.0, float(known.costs[:, 0].sum()))
    ws.scratch.memory[:] = 0.0
    record = Record(copy_of_instant(states, 0), states, margins, costs)
    _recall(system, known.h, record, first - 1, ws.scratch)
    refined = [n for n in known.refined if n < first]
    return march(system, "bdf2", known.h, first, Inputs(angles, rates, known.world), record, ws, begin, refined=refined)


def march(
    system: System, integrator: str, h: float, done: int, inputs: Inputs, record: Record, ws: Workspace, begin: float,
    progress: Callable[[float], None] | None = None, refined: Sequence[int] = (), divides: bool = True,
    divided: IntArray | None = None,
) -> Trajectory:  # fmt: skip  # parameters: those of a simulation, and where it is
    """All steps from instant `done` on, into the record, with what the workspace remembers of those before.

    Args:
        begin: Time when the simulation was started [s].
        refined: Those before `done`.
        divides, divided: As of `simulate`.
    """
    total, all_refined = len(inputs.angles), list(refined)
    divided = np.zeros(0, np.int64) if divided is None else divided.copy()
    chunk = total if progress is None else max(1, total // 50)
    for phase in phases_of(system, inputs.world, done, total):
        for first in range(phase.first, phase.last, chunk):
            last = min(first + chunk, phase.last)
            if phase.restarts:
                _restart(phase._replace(first=first, last=last), h, inputs, record, ws)
            else:
                _steps(
                    phase._replace(first=first, last=last),
                    integrator,
                    h,
                    inputs,
                    record,
                    ws,
                    all_refined,
                    divides,
                    divided,
                )
            if progress is not None:
                progress(last / total)
    solved, factorisations = (int(cost) for cost in record.costs[:, :2].sum(axis=0))
    return Trajectory(
        h, record.states, inputs.world, solved, factorisations, float(record.costs[:, 2].max()),
        time.perf_counter() - begin, integrator, tuple(all_refined), record.margins, record.costs, divided,
    )  # fmt: skip


def _steps(
    phase: Phase, integrator: str, h: float, inputs: Inputs, record: Record, ws: Workspace, refined: list[int],
    divides: bool, divided: IntArray,
) -> None:  # fmt: skip
    """The steps of a phase, into the record; adds those that were refined.

    Raises:
        SimulationFailure: One that cannot be solved.
    """
    system, coefficients, done = phase.system, IMPLICIT[integrator](h), phase.first
    kept = ws.scratch.memory.copy()
    while done < phase.last:
        try:
            code, done, component = _advance(system, coefficients, done, phase.last, inputs, record, ws, divided, kept)
        except ZeroDivisionError:  # of a kernel, whose numbers have left all bounds
            # steps that are done have counted their solutions
            done += int(np.argmin(record.costs[done : phase.last, 0] > 0.0))
            code, component = newton.NOT_CONVERGED, NOWHERE
        if code == newton.CONVERGED:
            continue
        if code == TURNED:
            if resolved_step(system, integrator, h, done, int(divided[done]), inputs, record, kept, ws):
                refined.append(done)
            done += 1
            continue
        reason = Reason.SINGULAR if code == newton.SINGULAR else Reason.DIVERGED
        try:
            exact = refined_step(system, integrator, h, done, inputs, record, ws) if divides else None
        except ZeroDivisionError:
            exact = None
        if exact is None:
            raise SimulationFailure(done * h, component, reason, copy_of_instant(record.states, done - 1))
        if not exact:
            refined.append(done)
        done += 1


def _restart(phase: Phase, h: float, inputs: Inputs, record: Record, ws: Workspace) -> None:
    """The backward Euler steps after a change of contacts, into the record.

    Raises:
        SimulationFailure: One that cannot be solved.
    """
    coefficients = IMPLICIT["bdf2"](EULER * h)
    for n in range(phase.first, phase.last):
        before = still(State(*[part[n - 1] for part in record.states]))
        instants = Instants(before, before, State(*[part[n] for part in record.states]))
        ws.work.world[:] = inputs.world[n]
        ws.scratch.memory[:] = 0.0
        angle, rate = inputs.angles[n], inputs.rates[n]
        code, factorisations, solutions, component = newton.step(
            phase.system, coefficients, instants, angle, rate, False, ws
        )
        record.costs[n, :2] += solutions, factorisations
        if code != newton.CONVERGED:
            reason = Reason.SINGULAR if code == newton.SINGULAR else Reason.DIVERGED
            raise SimulationFailure(n * h, component, reason, copy_of_instant(record.states, n - 1))
        record.margins[n] = ws.scratch.border.margin[0]
        record.costs[n, 2] = _largest_gap(phase.system, angle, rate, instants.now, ws.work)
    ws.scratch.memory[MISSED] = 0.0  # of steps of another length
