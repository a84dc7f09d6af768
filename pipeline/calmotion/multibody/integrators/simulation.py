"""A forward simulation: static equilibrium at the start, then an implicit scheme over given joint angles."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators import bdf2, newton
from calmotion.multibody.integrators.refinement import refined_step
from calmotion.multibody.integrators.schemes import SCHEMES
from calmotion.multibody.integrators.trajectory import Trajectory, copy_of_instant, instant_of
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.joints import joint_kinematics
from calmotion.multibody.kernels.moving_frames import rooted
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.linear_solver.closed_chains import copy_rows
from calmotion.multibody.model.system import State, System
from calmotion.multibody.statics.consistent_start import initial_acceleration, instant_before
from calmotion.multibody.statics.equilibrium import equilibrium
from calmotion.shot.character import Array
from calmotion.support.compilation import NO, kernel


@kernel
def _largest_gap(system, angle, rate, now, work):
    gap = 0.0
    for b in range(len(system.parent)):
        matrix_of(now.q[b], work.R[b])
    for joint in range(len(system.rows)):
        if system.rows[joint] == 0:
            continue
        joint_kinematics(system, joint, angle[joint], rate[joint], now.c, now.u, now.V, work)
        d = 0.0
        for i in range(3):
            d += (work.j.p[i] - work.i.p[i]) ** 2
        gap = max(gap, np.sqrt(d))
    return gap


@kernel
def largest_gap(system, angles, rates, states, world, work):
    """Largest position gap of a joint over a trajectory [m]."""
    gap = 0.0
    for n in range(len(angles)):
        copy_rows(world[n], work.world)
        gap = max(gap, _largest_gap(system, angles[n], rates[n], instant_of(states, n), work))
    return gap


@kernel
def _advance(
    system, scheme, h, first, last, earlier, states, angles, rates, world, margins, costs, work, blocks, factors,
    scratch,
):  # fmt: skip
    """Steps first..last-1 of a trajectory, with their margins and costs; returns (code, instant, component)."""
    for n in range(first, last):
        before = instant_of(states, n - 1)
        before2 = earlier if n == 1 else instant_of(states, n - 2)
        copy_rows(world[n], work.world)
        code, more, count, component = newton.step(
            system, scheme, h, before2, before, instant_of(states, n), angles[n], rates[n], NO, work, blocks,
            factors, scratch,
        )  # fmt: skip
        costs[n, 0] += count
        costs[n, 1] += more
        if code != newton.CONVERGED:
            return code, n, component
        margins[n] = scratch.border.margin[0]
        costs[n, 2] = _largest_gap(system, angles[n], rates[n], instant_of(states, n), work)
    return newton.CONVERGED, last, -1


@kernel
def _recall(system, h, states, n, scratch):
    """What a step of BDF2 remembers after instant n >= 1 of a trajectory."""
    now, before, before2 = instant_of(states, n), instant_of(states, n - 1), instant_of(states, max(n - 2, 0))
    bdf2.velocities(system, h, now, before, before2, scratch.J, scratch.Vd)
    copy_rows(scratch.Vd, scratch.memory[0])


def simulate(
    system: System, start: State, angles: Array, rates: Array, h: float, workspace: Workspace, progress=None,
    settled: bool = True, integrator: str = "bdf2", world: Array | None = None,
) -> Trajectory:  # fmt: skip
    """Simulate the system from static equilibrium, or from a state that is given.

    A step that Newton's method cannot solve is approached through smaller ones (`refinement`).

    Args:
        system: The compiled system.
        start: Where the search for the equilibrium starts (the rigid pose); not changed.
        angles, rates: Angle [rad] (or length [m]) and rate of each joint's motor, shape [T, J].
        h: Time step [s].
        workspace: Scratch of this system.
        progress: Called with a fraction in 0..1 now and then, or None.
        settled: False releases the system at `start` as it is, with its velocities, without looking for the
            equilibrium.
        integrator: A name of `schemes.SCHEMES`.
        world: Moving markers of the world, shape [T, W, 18]; needed where the system has any.

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
    first, solved = equilibrium(system, start, angles[0], ws) if settled else (start, 0)
    states = State(*[np.zeros((total,) + part.shape) for part in first])
    for part, value in zip(states, first, strict=True):
        part[0] = value
    earlier = State(*[part[0] for part in states])  # before the start the system rests
    ws.scratch.memory[:] = 0.0
    if not settled:
        motors = np.gradient(rates[:3], h, axis=0)[0] if total > 2 else np.zeros_like(rates[0])
        acceleration, states.lam[0] = initial_acceleration(system, first, angles[0], rates[0], motors, ws)
        earlier, states.turn[0] = instant_before(system, first, acceleration, h)
        ws.scratch.memory[:2] = acceleration
    margins, costs = np.zeros(total), np.zeros((total, 3))
    costs[0, 0] = solved
    return _march(
        system, integrator, 1, earlier, states, angles, rates, world, h, ws, progress, margins, costs, begin
    )  # fmt: skip


def simulate_on(
    system: System, before2: State, before: State, angles: Array, rates: Array, h: float, workspace: Workspace,
    world: Array | None = None,
) -> Trajectory:  # fmt: skip
    """Go on from two instants by BDF2.

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
    ws.scratch.memory[:] = (before.V - before2.V) / h
    return _march(
        system, "bdf2", 2, before2, states, angles, rates, rooted(world, total), h, ws, None, np.zeros(total),
        np.zeros((total, 3)), begin,
    )  # fmt: skip


def simulate_from(
    system: System, known: Trajectory, first: int, angles: Array, rates: Array, workspace: Workspace
) -> Trajectory:
    """What `simulate` finds by BDF2, where a simulation is known that begins alike.

    Args:
        known: By BDF2 from static equilibrium; not changed.
        first: Its instants before this one are kept, two or more, the last of them not a refined one.
        angles, rates: As `simulate` takes them; up to `first` those of the known simulation.

    Returns:
        The trajectory, to the last bit that of a whole simulation; the time that its beginning took is the share that
        it had in the known one.

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
    _recall(system, known.h, states, first - 1, ws.scratch)
    return _march(
        system, "bdf2", first, copy_of_instant(states, 0), states, angles, rates, known.world, known.h, ws, None,
        margins, costs, begin, [n for n in known.refined if n < first],
    )  # fmt: skip


def _march(
    system: System, integrator: str, done: int, earlier: State, states: State, angles: Array, rates: Array,
    world: Array, h: float, ws: Workspace, progress, margins: Array, costs: Array, begin: float,
    before: Sequence[int] = (),
) -> Trajectory:  # fmt: skip
    """All steps from instant `done` on, into `states`, `margins` and `costs`; `earlier` is the instant before the
    first, and `before` those before `done` that were refined."""
    total, scheme, refined = len(angles), SCHEMES[integrator](h), list(before)
    chunk = total if progress is None else max(1, total // 50)
    while done < total:
        last = min(done + chunk, total)
        code, done, component = _advance(
            system, scheme, h, done, last, earlier, states, angles, rates, world, margins, costs, ws.work, ws.blocks,
            ws.factors, ws.scratch,
        )  # fmt: skip
        if code != newton.CONVERGED:
            reason = "singular" if code == newton.SINGULAR else "diverged"
            exact = refined_step(system, integrator, h, done, earlier, states, angles, rates, world, ws)
            if exact is None:
                raise SimulationFailure(done * h, component, reason, copy_of_instant(states, done - 1))
            if not exact:
                refined.append(done)
            done += 1
        if progress is not None:
            progress(done / total)
    solved, factorisations = (int(part) for part in costs[:, :2].sum(axis=0))
    return Trajectory(
        h, states, world, solved, factorisations, float(costs[:, 2].max()), time.perf_counter() - begin, integrator,
        tuple(refined), margins, costs,
    )  # fmt: skip
