"""Periodic motion: the loop that a lightly damped robot ends up in, found and differentiated without waiting for it.

A loop of N steps is a map of what a step remembers of the two instants before it. Instants 0 and 1 hold that memory,
instants 2..N+1 are the steps, and the motion is periodic where instants N and N+1 are 0 and 1 again. Newton's method
(shooting) finds it: with Phi the derivative of the map, delta = (I - Phi)^-1 (end - start). Phi has as many singular
values that matter as there are motions that a loop does not damp away, so that a few sweeps find an orthonormal Q with
Phi = Q B, B = Q^T Phi, to rounding (Halko, Martinsson, Tropp 2011), and

    (I - Phi)^-1 = I + Q (I - B Q)^-1 B

serves the derivatives, too (Newton-Picard: Lust, Roose, Spence, Champneys 1998, without the Picard part).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields

import numpy as np

from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.simulation import simulate_on
from calmotion.multibody.integrators.trajectory import Trajectory, copy_of_instant
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.so3 import logarithm, matrix_of, turn
from calmotion.multibody.model.system import State, System
from calmotion.multibody.sensitivity.linearization import Linearization, linearize, processors
from calmotion.multibody.sensitivity.sweeps import sweep_back, sweep_forth
from calmotion.shot.character import Array

CLOSED = 1e-12  # distance of end and start at which a loop counts as closed [m, rad]
NEARLY = 1e-8  # and where rounding keeps it from getting there
LIMIT = 30
SLOW = 0.3  # shrinking of that distance by less than this asks for a new derivative
LEAST = 1.0 / 64.0  # part of a step of Newton's method that is tried
SWAY = 30.0  # typical angular frequency, by which velocities are compared with positions [rad/s]
BLOCK, NOTHING = 8, 1e-12  # columns that are added at once to Q, and size of what is not worth another


@dataclass(frozen=True, eq=False)
class Memory:
    """What a step remembers of two instants, as perturbations (see `sweeps`), and as one vector.

    Attributes:
        shift: Translations of both in world axes, shape [2, B, 3].
        turned: Turning of the later one, body axes, shape [B, 3].
        elastic: Of both, shape [2, B, R].
        velocity: Of both, shape [2, B, N].
        turn: Of the rotation vector between them, shape [B, 3].
    """

    shift: Array
    turned: Array
    elastic: Array
    velocity: Array
    turn: Array

    @classmethod
    def of(cls, system: System, vector: Array | None = None) -> Memory:
        """From a vector, or zero."""
        count, size = len(system.parent), system.size
        shapes = (2, count, 3), (count, 3), (2, count, size - 6), (2, count, size), (count, 3)
        if vector is None:
            return cls(*[np.zeros(shape) for shape in shapes])
        ends = np.cumsum([int(np.prod(shape)) for shape in shapes])[:-1]
        return cls(*[part.reshape(shape) for part, shape in zip(np.split(vector, ends), shapes, strict=True)])

    @property
    def vector(self) -> Array:
        """All in one, shape [n]."""
        return np.concatenate([getattr(self, item.name).ravel() for item in fields(self)])

    def times(self, factor: float) -> Memory:
        """All of it times a factor."""
        return Memory(*[factor * getattr(self, item.name) for item in fields(self)])

    def scaled(self, factor: float) -> Memory:
        """Velocities times a factor [s], which makes them comparable with positions."""
        return Memory(self.shift, self.turned, self.elastic, factor * self.velocity, self.turn)


def tangent_from(
    lin: Linearization, start: Memory, d_angle: Array, d_rate: Array, efforts: bool = False
) -> tuple[Array, Array, Memory]:
    """`sweeps.tangent` from a perturbation of the first two instants.

    Returns:
        What `sweeps.tangent` does, and the perturbation of the last two instants.
    """
    total, count, size = len(d_angle), len(lin.system.parent), lin.system.size
    dX = np.zeros((total, count, size))
    dc, nu, dth = np.zeros((3, count, 3)), np.zeros((3, count, size)), np.zeros((3, count, 3))
    dc[:2], nu[:2], dth[1] = start.shift, start.velocity, start.turn
    nu[:2, np.arange(size) >= 6 + lin.system.elastic[:, None]] = 0.0  # what pads it
    dX[1, :, 3:6], dX[:2, :, 6:] = start.turned, start.elastic
    d_effort = sweep_forth(lin, d_angle, d_rate, efforts, (dc, nu, dth), dX)
    ends = [(total - 2) % 3, (total - 1) % 3]
    end = Memory(dc[ends], dX[-1, :, 3:6].copy(), dX[-2:, :, 6:].copy(), nu[ends], dth[ends[1]].copy())
    return dX, d_effort, end


def adjoint_from(
    lin: Linearization, gradient: Array, end: Memory, effort_gradient: Array | None = None
) -> tuple[Array, Array, Memory]:
    """The transpose of `tangent_from`.

    Args:
        gradient, effort_gradient: As `sweeps.adjoint` takes them; those of instants 0 and 1 do not count.
        end: Derivative by the perturbation of the last two instants.

    Returns:
        Derivatives by angles and rates, shape [T, J] each, and by the perturbation of the first two instants.
    """
    Xbar = gradient.copy()
    Xbar[:2] = 0.0
    total, count, size = Xbar.shape
    cbar, nubar, thbar = np.zeros((total, count, 3)), np.zeros((total, count, size)), np.zeros((total, count, 3))
    cbar[-2:], nubar[-2:], thbar[-1] = end.shift, end.velocity, end.turn
    Xbar[-1, :, 3:6] += end.turned
    Xbar[-2:, :, 6:] += end.elastic
    g_angle, g_rate = sweep_back(lin, Xbar, effort_gradient, (cbar, nubar, thbar))
    start = Memory(cbar[:2], Xbar[1, :, 3:6], Xbar[:2, :, 6:], nubar[:2], thbar[1])
    return g_angle, g_rate, start


@dataclass(frozen=True, eq=False)
class Monodromy:
    """The derivative of a loop's end by its start, as Q B of low rank, velocities divided by `SWAY`.

    Attributes:
        Q: Orthonormal, shape [n, k].
        B: Shape [k, n].
    """

    Q: Array
    B: Array

    @classmethod
    def of(cls, lin: Linearization) -> Monodromy:
        """By sweeps over the loop, forwards for Q and backwards for B."""
        system = lin.system
        zero = np.zeros((2, *lin.angles.shape))
        nothing = np.zeros((len(lin.angles), len(system.parent), system.size))
        length = len(Memory.of(system).vector)
        rng = np.random.default_rng(0)

        def forth(vector: Array) -> Array:
            return tangent_from(lin, Memory.of(system, vector).scaled(SWAY), *zero)[2].scaled(1.0 / SWAY).vector

        def back(vector: Array) -> Array:
            return adjoint_from(lin, nothing, Memory.of(system, vector).scaled(1.0 / SWAY))[2].scaled(SWAY).vector

        Q, largest = np.zeros((length, 0)), 0.0
        # sweeps do not depend on each other, and run without the interpreter's lock
        with ThreadPoolExecutor(processors() if len(lin.windows()) == 1 else 1) as pool:
            while Q.shape[1] < length:
                found = np.stack(list(pool.map(forth, rng.normal(size=(BLOCK, length)))), axis=1)
                largest = max(largest, float(np.linalg.norm(found, axis=0).max()))
                for _ in range(2):  # twice is enough
                    found -= Q @ (Q.T @ found)
                more, sizes, _ = np.linalg.svd(found, full_matrices=False)
                more = more[:, sizes > NOTHING * largest]
                Q = np.concatenate([Q, more], axis=1)
                if more.shape[1] < BLOCK:
                    break
            rows = list(pool.map(back, Q.T))
        return cls(Q, np.stack(rows) if rows else np.zeros((0, length)))

    @property
    def growth(self) -> float:
        """Largest factor by which a perturbation grows from one loop to the next."""
        return float(np.max(np.abs(np.linalg.eigvals(self.B @ self.Q)), initial=0.0))

    def solve(self, memory: Memory, system: System) -> Memory:
        """(I - Phi)^-1 of a perturbation."""
        b = memory.scaled(1.0 / SWAY).vector
        inner = np.linalg.solve(np.eye(self.Q.shape[1]) - self.B @ self.Q, self.B @ b)
        return Memory.of(system, b + self.Q @ inner).scaled(SWAY)

    def solve_transposed(self, memory: Memory, system: System) -> Memory:
        """(I - Phi^T)^-1 of a derivative by a perturbation."""
        b = memory.scaled(SWAY).vector
        inner = np.linalg.solve(np.eye(self.Q.shape[1]) - (self.B @ self.Q).T, self.Q.T @ b)
        return Memory.of(system, b + self.B.T @ inner).scaled(1.0 / SWAY)


@dataclass(frozen=True, eq=False)
class Loop:
    """A loop of a simulation.

    Attributes:
        trajectory: Instants 0 and 1, and the steps.
        apart: What leads from its start to its end.
        gap: Its largest entry, velocities divided by `SWAY` [m, rad].
    """

    trajectory: Trajectory
    apart: Memory
    gap: float


def opening(system: System, states: State) -> Memory:
    """What leads from the first two instants of a trajectory to its last two."""
    R0, R1, apart = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((len(system.parent), 3))
    for b in range(len(system.parent)):
        matrix_of(states.q[1, b], R0)
        matrix_of(states.q[-1, b], R1)
        logarithm(R0.T @ R1, apart[b])
    return Memory(
        states.c[-2:] - states.c[:2], apart, states.u[-2:] - states.u[:2], states.V[-2:] - states.V[:2],
        states.turn[-1] - states.turn[1],
    )  # fmt: skip


def moved(system: System, before2: State, before: State, change: Memory) -> tuple[State, State]:
    """Two instants after a perturbation of what a step remembers of them."""
    first, second = State(*[part.copy() for part in before2]), State(*[part.copy() for part in before])
    for k, state in enumerate((first, second)):
        state.c[:] += change.shift[k]
        state.u[:] += change.elastic[k]
        state.V[:] += change.velocity[k]
    second.turn[:] += change.turn
    for b in range(len(system.parent)):
        turn(before.q[b], change.turned[b], second.q[b])
        turn(second.q[b], -second.turn[b], first.q[b])
    return first, second


def find_loop(
    system: System, start: tuple[State, State], angles: Array, rates: Array, h: float, ws: Workspace,
    world: Array | None = None, known: Monodromy | None = None,
) -> tuple[Loop, Monodromy | None]:  # fmt: skip
    """The periodic motion near a start.

    Args:
        start: States of instants 0 and 1.
        angles, rates: Of each joint's motor, shape [N + 2, J]: those of instants N, N+1 are those of 0, 1.
        known: The derivative of a loop nearby.

    Returns:
        The loop, and the derivative that was used last.

    Raises:
        SimulationFailure: A step that cannot be solved, or no periodic motion was found ("does not settle").
    """

    def play(first: State, second: State) -> Loop:
        trajectory = simulate_on(system, first, second, angles, rates, h, ws, world)
        apart = opening(system, trajectory.states)
        return Loop(trajectory, apart, float(np.max(np.abs(apart.scaled(1.0 / SWAY).vector))))

    loop = play(*start)
    lin: Linearization | None = None
    fresh, last = False, np.inf
    for _ in range(LIMIT):
        if loop.gap < CLOSED:
            return loop, known
        if known is None or loop.gap > SLOW * last:
            lin = linearize(system, loop.trajectory, angles, rates, ws, lin, begin=2)
            known, fresh = Monodromy.of(lin), True
        found = _step(system, loop, known.solve(loop.apart, system), play, LEAST if fresh else 1.0)
        if found is not None:
            last, loop, fresh = loop.gap, found, False
        elif loop.gap < NEARLY:
            return loop, known
        elif fresh:
            break
        else:
            known = None
    raise SimulationFailure(0.0, 0, "does not settle")


def _step(
    system: System, loop: Loop, change: Memory, play: Callable[[State, State], Loop], least: float
) -> Loop | None:
    """The loop after as much of a change of its start as brings its ends nearer; None where `least` of it does not."""
    states, part = loop.trajectory.states, 1.0
    while part >= least:
        try:
            found = play(*moved(system, copy_of_instant(states, 0), copy_of_instant(states, 1), change.times(part)))
        except SimulationFailure:
            found = None
        if found is not None and found.gap < (1.0 - 0.25 * part) * loop.gap:
            return found
        part *= 0.5
    return None


def periodic_tangent(
    lin: Linearization, monodromy: Monodromy, d_angle: Array, d_rate: Array, efforts: bool = False
) -> tuple[Array, Array]:
    """`sweeps.tangent` of a loop: how the periodic motion follows the motors."""
    _, _, end = tangent_from(lin, Memory.of(lin.system), d_angle, d_rate)
    start = monodromy.solve(end, lin.system)
    return tangent_from(lin, start, d_angle, d_rate, efforts)[:2]


def periodic_adjoint(
    lin: Linearization, monodromy: Monodromy, gradient: Array, effort_gradient: Array | None = None
) -> tuple[Array, Array]:
    """The transpose of `periodic_tangent`."""
    by_angle, by_rate, start = adjoint_from(lin, gradient, Memory.of(lin.system), effort_gradient)
    end = monodromy.solve_transposed(start, lin.system)
    nothing = np.zeros_like(gradient)
    more_by_angle, more_by_rate, _ = adjoint_from(lin, nothing, end)
    return by_angle + more_by_angle, by_rate + more_by_rate
