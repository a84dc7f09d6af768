"""The periodic motion of a cyclic shot, by shooting, and its derivatives.

A cycle of N steps maps the data that a step reads of the two instants before it. Instants 0 and 1 contain the start,
instants 2..N+1 are the steps, and the motion is periodic where instants N and N+1 equal instants 0 and 1. Newton's
method (shooting) solves this: with Phi the derivative of the map (the monodromy matrix),
delta = (I - Phi)^-1 (end - start). Phi has as many significant singular values as there are motions that one cycle
does not damp out, so that a few sweeps determine an orthonormal Q with Phi = Q B, B = Q^T Phi, to rounding (Halko,
Martinsson, Tropp 2011), and

    (I - Phi)^-1 = I + Q (I - B Q)^-1 B

gives the derivatives of the periodic motion as well (Newton-Picard: Lust, Roose, Spence, Champneys 1998, without the
Picard part).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators.simulation import simulate_on
from calmotion.multibody.integrators.trajectory import Trajectory, copy_of_instant
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.system import State, System
from calmotion.multibody.sensitivity.linearization import Linearization, linearize, processors
from calmotion.multibody.sensitivity.perturbation import (
    Perturbation,
    adjoint_from,
    end_difference,
    perturbed,
    tangent_from,
)

CONVERGED = 1e-12  # distance of end and start of a periodic motion, in `System.unit`
ROUNDING = 1e-8  # acceptable distance where rounding prevents convergence, likewise
LIMIT = 30  # iterations
SLOW = 0.3  # ratio of successive distances above which the derivative is computed anew
SMALLEST_STEP = 1.0 / 64.0  # fraction of a Newton step that is tried
FREQUENCY = 30.0  # typical angular frequency, which scales velocities to positions [rad/s]
BLOCK, NEGLIGIBLE = 8, 1e-12  # columns that are added at once to Q, and relative size of negligible ones


@dataclass(frozen=True, eq=False)
class Monodromy:
    """The derivative of a cycle's end by its start, as Q B of low rank, velocities divided by `FREQUENCY`.

    Attributes:
        Q: Orthonormal, shape [n, k].
        B: Shape [k, n].
    """

    Q: Array
    B: Array

    @classmethod
    def of(cls, lin: Linearization) -> Monodromy:
        """By sweeps over the cycle, tangents for Q and adjoints for B."""
        system = lin.system
        zero = np.zeros((2, *lin.inputs.angles.shape))
        no_gradient = np.zeros((len(lin.inputs.angles), len(system.parent), system.size))
        length = len(Perturbation.of(system).vector)
        rng = np.random.default_rng(0)

        def tangent_of(vector: Array) -> Array:
            start = Perturbation.of(system, vector).scaled(FREQUENCY)
            return tangent_from(lin, start, *zero)[2].scaled(1.0 / FREQUENCY).vector

        def adjoint_of(vector: Array) -> Array:
            end = Perturbation.of(system, vector).scaled(1.0 / FREQUENCY)
            return adjoint_from(lin, no_gradient, end)[2].scaled(FREQUENCY).vector

        Q, largest = np.zeros((length, 0)), 0.0
        # sweeps do not depend on each other, and run without the interpreter's lock
        with ThreadPoolExecutor(processors() if len(lin.windows()) == 1 else 1) as pool:
            while Q.shape[1] < length:
                columns = np.stack(list(pool.map(tangent_of, rng.normal(size=(BLOCK, length)))), axis=1)
                largest = max(largest, float(np.linalg.norm(columns, axis=0).max()))
                for _ in range(2):  # twice is enough
                    columns -= Q @ (Q.T @ columns)
                basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
                basis = basis[:, sizes > NEGLIGIBLE * largest]
                Q = np.concatenate([Q, basis], axis=1)
                if basis.shape[1] < BLOCK:
                    break
            rows = list(pool.map(adjoint_of, Q.T))
        return cls(Q, np.stack(rows) if rows else np.zeros((0, length)))

    @property
    def floquet_multiplier(self) -> float:
        """Largest absolute value of the Floquet multipliers; a perturbation decays where it is below 1."""
        return float(np.max(np.abs(np.linalg.eigvals(self.B @ self.Q)), initial=0.0))

    def solve(self, memory: Perturbation, system: System) -> Perturbation:
        """(I - Phi)^-1 of a perturbation."""
        b = memory.scaled(1.0 / FREQUENCY).vector
        inner = np.linalg.solve(np.eye(self.Q.shape[1]) - self.B @ self.Q, self.B @ b)
        return Perturbation.of(system, b + self.Q @ inner).scaled(FREQUENCY)

    def solve_transposed(self, memory: Perturbation, system: System) -> Perturbation:
        """(I - Phi^T)^-1 of a derivative by a perturbation."""
        b = memory.scaled(FREQUENCY).vector
        inner = np.linalg.solve(np.eye(self.Q.shape[1]) - (self.B @ self.Q).T, self.Q.T @ b)
        return Perturbation.of(system, b + self.B.T @ inner).scaled(1.0 / FREQUENCY)


@dataclass(frozen=True, eq=False)
class Cycle:
    """A simulated cycle.

    Attributes:
        trajectory: Instants 0 and 1, and the steps.
        difference: Of its end and its start.
        distance: Largest entry of the difference in `System.unit`, velocities divided by `FREQUENCY`.
    """

    trajectory: Trajectory
    difference: Perturbation
    distance: float


def find_periodic_motion(
    system: System, start: tuple[State, State], angles: Array, rates: Array, h: float, ws: Workspace,
    world: Array | None = None, monodromy: Monodromy | None = None,
) -> tuple[Cycle, Monodromy | None]:  # fmt: skip
    """The periodic motion near a start.

    Args:
        start: States of instants 0 and 1.
        angles, rates: Of each joint's motor, shape [N + 2, J]: those of instants N, N+1 are those of 0, 1.
        monodromy: That of a cycle nearby.

    Returns:
        The cycle, and the derivative that was used last.

    Raises:
        SimulationFailure: A step that cannot be solved, or no periodic motion was found (`Reason.NOT_PERIODIC`).
    """

    def simulated(first: State, second: State) -> Cycle:
        trajectory = simulate_on(system, first, second, angles, rates, h, ws, world)
        difference = end_difference(system, trajectory.states)
        distance = float(np.max(np.abs(difference.scaled(1.0 / FREQUENCY).over(system.unit).vector)))
        return Cycle(trajectory, difference, distance)

    cycle = simulated(*start)
    lin: Linearization | None = None
    fresh, last = False, np.inf
    for _ in range(LIMIT):
        if cycle.distance < CONVERGED:
            return cycle, monodromy
        if monodromy is None or cycle.distance > SLOW * last:
            lin = linearize(system, cycle.trajectory, angles, rates, ws, lin, begin=2)
            monodromy, fresh = Monodromy.of(lin), True
        change = monodromy.solve(cycle.difference, system)
        improved = _newton_step(system, cycle, change, simulated, SMALLEST_STEP if fresh else 1.0)
        if improved is not None:
            last, cycle, fresh = cycle.distance, improved, False
        elif cycle.distance < ROUNDING:
            return cycle, monodromy
        elif fresh:
            break
        else:
            monodromy = None
    raise SimulationFailure(0.0, 0, Reason.NOT_PERIODIC)


def _newton_step(
    system: System, cycle: Cycle, change: Perturbation, simulated: Callable[[State, State], Cycle], smallest: float
) -> Cycle | None:
    """The cycle after the largest fraction of a change of its start that reduces the distance of its ends; None where
    even the smallest does not."""
    states, fraction = cycle.trajectory.states, 1.0
    while fraction >= smallest:
        start = perturbed(system, copy_of_instant(states, 0), copy_of_instant(states, 1), change.times(fraction))
        try:
            improved = simulated(*start)
        except SimulationFailure:
            improved = None
        if improved is not None and improved.distance < (1.0 - 0.25 * fraction) * cycle.distance:
            return improved
        fraction *= 0.5
    return None


def periodic_tangent(
    lin: Linearization, monodromy: Monodromy, d_angle: Array, d_rate: Array, efforts: bool = False
) -> tuple[Array, Array]:
    """`tangent.tangent` of a cycle: the derivative of the periodic motion by the motors."""
    _, _, end = tangent_from(lin, Perturbation.of(lin.system), d_angle, d_rate)
    start = monodromy.solve(end, lin.system)
    return tangent_from(lin, start, d_angle, d_rate, efforts)[:2]


def periodic_adjoint(
    lin: Linearization, monodromy: Monodromy, gradient: Array, effort_gradient: Array | None = None
) -> tuple[Array, Array]:
    """The transpose of `periodic_tangent`."""
    by_angle, by_rate, start = adjoint_from(lin, gradient, Perturbation.of(lin.system), effort_gradient)
    end = monodromy.solve_transposed(start, lin.system)
    by_angle_through_start, by_rate_through_start, _ = adjoint_from(lin, np.zeros_like(gradient), end)
    return by_angle + by_angle_through_start, by_rate + by_rate_through_start
