"""The retargeting problem of a shot: motor curves in, error at the targets out, with exact derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Self

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.multibody.analysis.rigid_response import RigidResponse
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.model.model import Model
from calmotion.multibody.parallel import in_parallel
from calmotion.retargeting.problem import several_robots
from calmotion.retargeting.problem.ground import GROUND, Place, with_ground_rows
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.offset_basis import OffsetBasis
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.response_gram import products_worth, response_preconditioner
from calmotion.retargeting.problem.rigid_approximation import (
    EFFORT,
    effort_of,
    limit_metrics,
    rigid_gradient,
    rigid_response,
)
from calmotion.retargeting.problem.robot import Robot
from calmotion.retargeting.solver.norm import Norm, SumOfSquares
from calmotion.retargeting.solver.preconditioner import Preconditioner, RigidPreconditioner
from calmotion.simulation.forward import ForwardRun, limited_values
from calmotion.simulation.inputs.curves import Curves
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.simulator import Simulator
from calmotion.simulation.target_errors import Objective


class RetargetProblem:
    """`gauss_newton.LeastSquares` over the spline coefficients of the offsets, ordered by basis function, then motor.

    Args:
        model: The flexible character.
        grid: Its time grid.
        curves: The animator's curves.
        objective: Errors at the targets.
        space: The unknowns: splines, motors that may change, regularisation.
        world: Moving roots.
        limits: Limits of the motors; None where there are none.
        continuous: Whether gradients are those of the continuous adjoint, which are not exact.
    """

    def __init__(
        self, model: Model, grid: TimeGrid, curves: Curves, objective: Objective, space: OffsetSpace,
        world: Array | None = None, limits: LimitTerms | None = None, continuous: bool = False,
    ):  # fmt: skip
        self.grid, self.objective, self.space = grid, objective, space
        self.curves, self.world, self.limits = curves, world, limits
        self.robots: tuple[Robot, ...] = (Robot(Simulator(model, grid.h, world, grid.cyclic), objective),)
        self.failure: SimulationFailure | None = None  # of the last point that could not be simulated
        self.norm: Norm = SumOfSquares()
        self._continuous = continuous
        self._limited: dict[str, Array] | None = None
        self.x = self._linearized_x = np.zeros(0)  # points evaluated and linearised last
        self.preconditioner: Preconditioner | None = None
        self._sharpened_x = np.zeros(0)  # point of the preconditioner's responses; empty for that of the rigid robot
        self._held = 0  # instant before which curves are fixed
        self._response: RigidResponse | None = None
        self._ground_rows: dict[Place, Array] = {}  # where it was linearised last
        # twice the objective of an error of one metre at every instant
        self._unit = max(float(np.sum(objective.weights**2)) / max(1, 3 * len(model.targets.component)), 1e-300)

    def for_robots(self, robots: Sequence[Robot]) -> Self:
        """The same problem for several robots that perform the same curves, the nominal one first: the sum of their
        weighted objectives, and limits of effort that each of them keeps."""
        other = copy(self)
        other.robots, other._limited = tuple(robots), None
        other.x = other._linearized_x = np.zeros(0)
        if self.limits is not None:
            limits, bounds = self.limits, self.limits.bounds
            if EFFORT in bounds:
                bounds = bounds | {effort_of(k): bounds[EFFORT] for k in range(len(robots))}
            other.limits = LimitTerms(bounds, limits.judged, limits.h, limits.rho)
        return other

    def _copy(self) -> RetargetProblem:
        """A copy whose points are evaluated without changing what is known of this one's."""
        other = copy(self)
        other.robots = tuple(copy(robot) for robot in self.robots)
        return other

    def on_basis(self, basis: OffsetBasis, x: Array) -> RetargetProblem:
        """The same problem, evaluated and linearised where this one was, over other splines.

        Args:
            x: The same point in coefficients of the new basis.
        """
        other = self._copy()
        other.space, other.preconditioner, other._sharpened_x = self.space.on_basis(basis), None, np.zeros(0)
        other.x, other._linearized_x, other._ground_rows = x, np.zeros(0), {}
        return other

    def over_motors(self, motors: IntArray, coupling: Array) -> RetargetProblem:
        """The same problem without limits, linearised where this one was, over offsets of other motors, now zero.

        Args:
            motors, coupling: As of `OffsetSpace`.
        """
        other = self._copy()
        other.space = replace(self.space, motors=motors, coupling=coupling)
        other.limits, other._response, other.preconditioner = None, None, None
        other._sharpened_x, other.x = np.zeros(0), np.zeros(other.space.size)
        return other

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.space.size

    @property
    def model(self) -> Model:
        """The nominal robot."""
        return self.robots[0].model

    @property
    def run(self) -> ForwardRun:
        """The simulation of the point evaluated last, of the nominal robot."""
        return self.robots[0].run

    @property
    def error(self) -> float:
        """Root-mean-square error of the point evaluated last, weighted [m]."""
        return float(np.sqrt(several_robots.squared_errors(self.robots) / self._unit))

    @property
    def residuals(self) -> Array:
        """Weighted residuals of the point evaluated last, robot after robot, shape [S T, R]."""
        return several_robots.joined_residuals(self.robots)

    @property
    def _acting(self) -> LimitTerms | None:
        """The limits where they are part of the merit now."""
        return self.limits if self.limits is not None and self.limits.on else None

    @property
    def limits_act(self) -> bool:
        """Whether limits are part of the merit now."""
        return self._acting is not None

    @property
    def limited(self) -> dict[str, Array]:
        """Values of the limited quantities at the point evaluated last, shape [T, M] each."""
        if self._limited is None:
            bounds = {} if self.limits is None else self.limits.bounds
            self._limited = limited_values(
                self.model, bounds.keys() & kinds_of_limits().keys(), self.changed_curves, self.run
            )
            if EFFORT in bounds:
                self._limited |= several_robots.further_efforts(self.robots, self.changed_curves)
            self._limited |= several_robots.on_ground(self.robots)
        return self._limited

    def hold(self, first: int) -> None:
        """Keep the motor curves before an instant fixed from now on: see `Simulator.hold`."""
        for robot in self.robots:
            robot.simulator.hold(first)
        if first < self._held and len(self._sharpened_x):
            # responses from a later instant on say nothing of the coefficients that are free from now on
            self.preconditioner, self._sharpened_x = None, np.zeros(0)
        self._held = first

    def forget(self) -> None:
        """The next point is simulated from the start of the shot."""
        for robot in self.robots:
            robot.simulator.forget()

    def value(self, x: Array) -> float:
        """The merit: the objective and the terms of the limits; infinite if the simulation fails."""
        values, rates = self.space.offsets(x)
        angles, rates = self.curves.angles + values, self.curves.rates + rates
        try:
            in_parallel(lambda robot: robot.perform(angles, rates), self.robots)
        except SimulationFailure as failure:
            self.failure = failure
            return np.inf
        self.x = x.copy()
        self._limited = None
        return self.merit()

    def merit(self) -> float:
        """The merit at the point evaluated last, with the current multipliers."""
        value, limits = self.objective_value(), self._acting
        return value if limits is None else value + limits.value(self.limited)

    @property
    def changed_curves(self) -> Curves:
        """The motors' curves at the point evaluated last."""
        return self.space.changed(self.curves, self.x)

    def objective_value(self) -> float:
        """The objective at the point evaluated last, without the terms of the limits."""
        return self.norm.value(self.residuals) + self.penalty_value(self.x)

    def linearize(self) -> Array:
        """Linearise at the point evaluated last, and the gradient there."""
        in_parallel(Robot.linearize, self.robots)
        self._linearized_x, self._ground_rows = self.x, {}
        return self.gradient()

    def linearized_at(self, x: Array) -> bool:
        """Whether this is the point evaluated last, and linearised."""
        return np.array_equal(x, self.x) and np.array_equal(x, self._linearized_x)

    def gradient(self) -> Array:
        """Gradient of the merit where it was linearised; the limits may have changed since."""
        if self._continuous:
            return self.continuous_gradient()
        pulled = self.vjp(self.norm.gradient(self.residuals), self._limit_pulls())
        return pulled + self.penalty_gradient(self.x)

    def continuous_gradient(self) -> Array:
        """The same by the continuous adjoint, which has its own linearisation and does not support limits of effort."""
        pulls = several_robots.continuous_adjoints(self.robots)
        return self._to_unknowns(*pulls, self._limit_pulls()) + self.penalty_gradient(self.x)

    def _limit_pulls(self) -> dict[str, Array]:
        limits = self._acting
        return {} if limits is None else {name: limits.gradient(name, v) for name, v in self.limited.items()}

    def vjp(self, residuals: Array, limited: dict[str, Array]) -> Array:
        """The transpose of `jvp`: weighted residuals and limited quantities to the unknowns."""
        return self._to_unknowns(*several_robots.adjoints(self.robots, residuals, limited), limited)

    def _to_unknowns(self, by_value: Array, by_rate: Array, limited: dict[str, Array]) -> Array:
        """Derivatives by the motors' values and rates, and by limited curves, shape [T, M], gathered by unknown."""
        space = self.space
        pulled = space.gather(space.basis.values, by_value) + space.gather(space.basis.rates, by_rate)
        for name, spline in space.splines.items():
            if name in limited:
                pulled += space.gather(spline, limited[name])
        return pulled

    def jvp(self, direction: Array) -> tuple[Array, dict[str, Array]]:
        """Change of the weighted residuals along a direction, shape [S T, R], and of the limited quantities."""
        bounds, space = {} if self._acting is None else self._acting.bounds, self.space
        residuals, efforts = several_robots.tangents(
            self.robots, *space.offsets(direction), EFFORT in bounds, GROUND in bounds
        )
        changes = {name: space.spread(spline, direction) for name, spline in space.splines.items() if name in bounds}
        return residuals, changes | efforts

    def penalty_gradient(self, x: Array) -> Array:
        """Gradient of the regulariser."""
        return self.space.penalty_gradient(x)

    def penalty_product(self, x: Array) -> Array:
        """Matrix of the regulariser times x."""
        return self.space.penalty_product(x)

    def penalty_value(self, x: Array) -> float:
        """The regulariser."""
        return self.space.penalty_value(x)

    def product(self, direction: Array) -> Array:
        """Gauss-Newton matrix times a direction: one tangent and one adjoint sweep."""
        residuals, changes = self.jvp(direction)
        if self.limits is not None:
            changes = {name: self.limits.curvature(name, self.limited[name]) * v for name, v in changes.items()}
        return self.vjp(self.norm.product(self.residuals, residuals), changes) + self.penalty_product(direction)

    def precondition(self, fixed: BoolArray, values: dict[str, Array] | None = None) -> Callable[[Array], Array]:
        """The rigid robot's Gauss-Newton matrix, or that of `sharpen`, inverted over the entries that are not fixed.

        Args:
            values: Limited quantities, which say which limits act; None: at the point evaluated last.
        """
        response, acting = self._rigid(), self._acting
        if self.preconditioner is None:
            weights = several_robots.curved_weights(self.robots, self.norm, self.objective.weights)
            self.preconditioner = RigidPreconditioner(response, weights, self.space.basis, self.space.penalty)
        curvatures = {} if acting is None else acting.curvatures(values or self.limited)
        curvatures |= several_robots.reversal_curvatures(self.robots)
        self.preconditioner.factor(fixed, limit_metrics(response.inertia, self.space, curvatures))
        of_feet = self._ground_rows, partial(self.vjp, np.zeros_like(self.residuals))
        return with_ground_rows(self.preconditioner.solve, acting, values or self.limited, fixed, *of_feet)

    @property
    def patience(self) -> int | None:
        """Number of products of one system from which `sharpen` pays; None where it is of no use here."""
        if np.array_equal(self._sharpened_x, self.x):
            return None
        return products_worth(self.robots, self.space, first=not len(self._sharpened_x))

    @property
    def sharpened_at(self) -> Array:
        """The point at which `sharpen` was called last; empty if it was not."""
        return self._sharpened_x

    def take(self, preconditioner: Preconditioner, point: Array) -> None:
        """Precondition with a matrix of `sharpen` of almost the same problem, at a point."""
        self.preconditioner, self._sharpened_x = preconditioner, point

    def sharpen(self) -> None:
        """Precondition with the Gauss-Newton matrix of the flexible robots where they are linearised, from now on."""
        self.take(response_preconditioner(self.robots, self.space), self.x)

    def damped(self, ratio: float, frequency: float) -> RetargetProblem:
        """The same problem without limits on a robot with more damping, see `model.with_damping`."""
        other = copy(self)
        other.robots = tuple(robot.damped(ratio, frequency) for robot in self.robots)
        other._limited, other.limits = None, None
        return other

    def lever(self) -> float:
        """Largest lever arm of a motor: weighted root-mean-square motion of the targets per angle [m/rad]."""
        weighted = self._rigid().targets * self.objective.weights[..., None]
        return float(np.sqrt(np.max(np.sum(weighted**2, axis=(0, 1, 2))) / self._unit))

    def rigid_gradient(self) -> Array:
        """Gradient of the errors at the point evaluated last if the robot were rigid: each is answered as it occurs."""
        residuals = sum(np.sqrt(robot.weight) * robot.residuals for robot in self.robots)
        return rigid_gradient(self._rigid(), self.space, self.objective.weights, np.asarray(residuals))

    def rigid_metric(self) -> Array:
        """Second derivatives of the rigid robot's objective by the angles of the unknowns' motors, shape [T, m, m]."""
        weighted = self._rigid().targets * self.objective.weights[..., None]
        return np.asarray(np.einsum("nkia,nkib->nab", weighted, weighted))

    def _rigid(self) -> RigidResponse:
        if self._response is None:
            self._response = rigid_response(self.model, self.grid, self.curves, self.world, self.space.coupling)
        return self._response

    def gain(self, decrease: float, value: float) -> float:
        """Decrease of the root-mean-square error that corresponds to a decrease of the merit [m]."""
        now = np.sqrt(2.0 * max(value, 0.0) / self._unit)
        return float(now - np.sqrt(2.0 * max(value - decrease, 0.0) / self._unit))

    def merit_of_gain(self, gain: float) -> float:
        """Decrease of the merit that reduces the root-mean-square error by `gain` [m], from the current point."""
        return float(self._unit * gain * max(self.error, gain))

    def tighten(self) -> bool:
        """Switch the limits on if they are violated, or update their multipliers; whether the merit changed."""
        return self.limits is not None and self.limits.tighten(self.limited)
