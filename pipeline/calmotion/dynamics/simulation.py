"""A forward simulation: static equilibrium at the start, then BDF2 over given joint angles."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..kernels import kernel
from ..shot.character import Array
from . import bdf2
from .assembly import Work, allocate_work
from .joints import joint_kinematics
from .loops import allocate_border
from .start import initial_acceleration, instant_before
from .statics import equilibrium
from .system import (
    JOINT_ROWS,
    Blocks,
    Factors,
    Scheme,
    State,
    System,
    allocate_blocks,
    allocate_factors,
)

NEWTON_TOLERANCE = 1e-8
NEWTON_LIMIT = 25
BAUMGARTE_STEPS = 0.01  # time constant of the Baumgarte term, in steps; see `baumgarte`


class SimulationFailure(Exception):
    """A step that could not be solved: time [s] and component, and why ("singular" or "diverged")."""

    def __init__(self, time_s: float, component: int, reason: str):
        self.time_s, self.component, self.reason = time_s, component, reason
        super().__init__(f"{reason} at t = {time_s:.4f} s, component {component}")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States of all instants; arrays of `State` with a leading time axis, and what they cost.

    Attributes:
        h: Step [s].
        states: Arrays of shape [T, B, ...].
        newton_iterations: In all.
        max_joint_gap: Largest position gap of a joint [m].
        wall_s: Time it took [s].
    """

    h: float
    states: State
    newton_iterations: int
    max_joint_gap: float
    wall_s: float


def baumgarte(h: float) -> float:
    """The coefficient alpha [1/s] for a step h.

    BDF2 leaves a position drift of about h^2/3 times the third derivative of the joint gap's nonlinear part per
    unit of time, which the term holds at that over alpha; a hundred over the step keeps gaps to nanometres; the
    term is implicit, so it limits no step and does not stiffen the motion.
    """
    return 1.0 / (BAUMGARTE_STEPS * h)


def dynamic_scheme(h: float) -> Scheme:
    """The scheme of a BDF2 step."""
    return Scheme(velocity=1.5 / h, acceleration=1.5 / h, gamma=1.0, alpha=baumgarte(h))


def allocate_scratch(system: System) -> tuple[Any, ...]:
    """(J, T, Wt, Hv, Vd, x, lam, block, border) of `bdf2.step`."""
    count, size = len(system.parent), system.size
    return (
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((count, 4, 4)),
        np.zeros((count, size)),
        np.zeros((count, size)),
        np.zeros((len(system.rows), JOINT_ROWS)),
        np.zeros(size + JOINT_ROWS),
        allocate_border(system),
    )


@kernel
def _instant(states, n):
    """Views of instant n of a trajectory."""
    return State(states.c[n], states.q[n], states.u[n], states.turn[n], states.V[n], states.lam[n])


@kernel
def _largest_gap(system, angle, rate, c, u, V, work):
    gap = 0.0
    for joint in range(len(system.rows)):
        if system.rows[joint] == 0:
            continue
        joint_kinematics(system, joint, angle[joint], rate[joint], c, u, V, work)
        d = 0.0
        for i in range(3):
            d += (work.j.p[i] - work.i.p[i]) ** 2
        gap = max(gap, np.sqrt(d))
    return gap


@kernel
def _advance(
    system, scheme, h, first, last, earlier, states, angles, rates, tolerance, limit, work, blocks, factors, scratch
):
    """Steps first..last-1 of a trajectory; returns (code, instant, component, iterations, largest joint gap)."""
    iterations = 0
    gap = 0.0
    for n in range(first, last):
        before = _instant(states, n - 1)
        before2 = earlier if n == 1 else _instant(states, n - 2)
        code, count, component = bdf2.step(
            system, scheme, h, before2, before, _instant(states, n), angles[n], rates[n], tolerance, limit, work,
            blocks, factors, scratch,
        )  # fmt: skip
        iterations += count
        if code != bdf2.CONVERGED:
            return code, n, component, iterations, gap
        gap = max(gap, _largest_gap(system, angles[n], rates[n], states.c[n], states.u[n], states.V[n], work))
    return bdf2.CONVERGED, last, -1, iterations, gap


@dataclass(frozen=True, eq=False)
class Workspace:
    """Everything a simulation writes to besides its trajectory; made once for a system, not shared by threads."""

    work: Work
    blocks: Blocks
    factors: Factors
    scratch: tuple[Any, ...]

    @classmethod
    def for_system(cls, system: System) -> Workspace:
        """Allocate for one system."""
        return cls(allocate_work(system), allocate_blocks(system), allocate_factors(system), allocate_scratch(system))


def simulate(
    system: System, start: State, angles: Array, rates: Array, h: float, workspace: Workspace, progress=None,
    settled: bool = True,
) -> Trajectory:  # fmt: skip
    """Simulate the system from static equilibrium, or from a state that is given.

    Args:
        system: The compiled system.
        start: Where the search for the equilibrium starts (the rigid pose); not changed.
        angles, rates: Angle [rad] (or length [m]) and rate of each joint's motor, shape [T, J].
        h: Time step [s].
        workspace: Scratch of this system.
        progress: Called with a fraction in 0..1 now and then, or None.
        settled: False releases the system at `start` as it is, with its velocities, without looking for the
            equilibrium.

    Returns:
        The trajectory, T instants.

    Raises:
        SimulationFailure: No equilibrium, or a step that Newton's method cannot solve.
    """
    begin = time.perf_counter()
    total = len(angles)
    first, iterations = equilibrium(system, start, angles[0], workspace) if settled else (start, 0)
    states = State(*[np.zeros((total,) + part.shape) for part in first])
    for part, value in zip(states, first, strict=True):
        part[0] = value
    ws = workspace
    earlier = State(*[part[0] for part in states])  # before the start the system rests
    if not settled:
        motors = np.gradient(rates[:3], h, axis=0)[0] if total > 2 else np.zeros_like(rates[0])
        acceleration, states.lam[0] = initial_acceleration(system, first, angles[0], rates[0], motors, ws)
        earlier, states.turn[0] = instant_before(system, first, acceleration, h)
    gap = 0.0
    done = 1
    chunk = total if progress is None else max(1, total // 50)
    while done < total:
        last = min(done + chunk, total)
        code, instant, component, count, largest = _advance(
            system, dynamic_scheme(h), h, done, last, earlier, states, angles, rates, NEWTON_TOLERANCE, NEWTON_LIMIT,
            ws.work, ws.blocks, ws.factors, ws.scratch,
        )  # fmt: skip
        iterations += count
        gap = max(gap, largest)
        if code != bdf2.CONVERGED:
            raise SimulationFailure(instant * h, component, "singular" if code == bdf2.SINGULAR else "diverged")
        done = last
        if progress is not None:
            progress(done / total)
    return Trajectory(h, states, iterations, gap, time.perf_counter() - begin)
