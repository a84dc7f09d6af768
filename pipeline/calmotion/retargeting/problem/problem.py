"""The retargeting problem of a shot: motor curves in, errors at the targets out, with exact derivatives.

A problem does not change. `problem.at(x)` is what was computed at a point, `problem.at(x).linearized()` the derivatives
there; derivatives about another point take over the memory of a robot's last ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.model.model import Model
from calmotion.multibody.parallel import in_parallel
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.linear_problem import LinearProblem
from calmotion.retargeting.problem.offset_basis import OffsetBasis
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.rigid_robot import RigidRobot
from calmotion.retargeting.problem.robot import EFFORT, Robot, RobotRun, of_robot
from calmotion.retargeting.problem.sweeps import Sweeps
from calmotion.retargeting.solver.norm import Norm, SumOfSquares
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.inputs.curves import Curves
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.simulator import Simulator
from calmotion.simulation.target_errors import Objective


@dataclass(frozen=True, eq=False)
class RetargetProblem:
    """`gauss_newton.LeastSquares` over the spline coefficients of the offsets, ordered by basis function, then motor.

    Attributes:
        grid: Time grid of the shot.
        curves: The animator's curves.
        space: The unknowns: splines, motors that may change, regularisation.
        robots: Which perform the same curves, the nominal one first.
        rigid: The nominal one without flexibility.
        limits: Limits of the motors, with their multipliers; None where there are none.
        norm: What is minimised of the residuals.
        continuous: Whether gradients are those of the continuous adjoint, which are not exact.
        first: Instant before which motor curves do not change.
        damping: Of the steps of a search under limits, see `offset_space.DampedRegulariser`.
        by_responses: Whether it is linearised by the responses to all unknowns, where that is possible.
    """

    grid: TimeGrid
    curves: Curves
    space: OffsetSpace
    robots: tuple[Robot, ...]
    rigid: RigidRobot
    limits: LimitTerms | None = None
    norm: Norm = SumOfSquares()
    continuous: bool = False
    first: int = 0
    damping: float = 0.0
    by_responses: bool = False

    @classmethod
    def of_model(
        cls, model: Model, grid: TimeGrid, curves: Curves, objective: Objective, space: OffsetSpace,
        world: Array | None = None, limits: LimitTerms | None = None, continuous: bool = False,
    ) -> RetargetProblem:  # fmt: skip
        """The problem of one robot.

        Args:
            objective: Errors at its targets.
            world: Moving roots.
            grid, curves, space, limits, continuous: As of the class.
        """
        robot = Robot(Simulator(model, grid.h, world, grid.cyclic), objective)
        rigid = RigidRobot(model, grid, curves, world, space.coupling)
        return cls(grid, curves, space, (robot,), rigid, limits, continuous=continuous)

    def at(self, x: Array, near: Evaluation | None = None) -> Evaluation:
        """What the robots do at a point of shape [n].

        Args:
            near: From which simulations go on where the curves begin to differ, of the same robots.

        Raises:
            SimulationFailure: The curves cannot be simulated.
        """
        values, rates = self.space.offsets(x)
        angles, rates = self.curves.angles + values, self.curves.rates + rates
        known = dict(enumerate(near.runs)) if near is not None else {}
        runs = in_parallel(lambda k: self.robots[k].perform(angles, rates, known.get(k)), range(len(self.robots)))
        return Evaluation(self, x.copy(), tuple(runs))

    def tried(self, x: Array, near: Evaluation | None = None) -> Evaluation | None:
        """As `at`; None where the curves cannot be simulated, or only with smaller steps, which have no derivatives."""
        try:
            found = self.at(x, near)
        except SimulationFailure:
            return None
        return None if any(run.is_refined for run in found.runs) else found

    def for_robots(self, robots: Sequence[Robot]) -> RetargetProblem:
        """The same problem for several robots that perform the same curves, the nominal one first: the sum of their
        weighted objectives, and limits of effort that each of them keeps."""
        limits = self.limits
        if limits is not None:
            bounds = dict(limits.bounds)
            if EFFORT in bounds:
                bounds |= {of_robot(EFFORT, k): bounds[EFFORT] for k in range(len(robots))}
            limits = LimitTerms(bounds, limits.judged, limits.h, limits.rho)
        return replace(self, robots=tuple(robots), limits=limits)

    def on_basis(self, basis: OffsetBasis) -> RetargetProblem:
        """The same problem over other splines."""
        return replace(self, space=self.space.on_basis(basis))

    def over_motors(self, motors: IntArray, coupling: Array) -> RetargetProblem:
        """The same problem without limits over offsets of other motors.

        Args:
            motors, coupling: As of `OffsetSpace`.
        """
        rigid = RigidRobot(self.model, self.grid, self.curves, self.world, coupling)
        return replace(self, space=replace(self.space, motors=motors, coupling=coupling), limits=None, rigid=rigid)

    def damped(self, ratio: float, frequency: float) -> RetargetProblem:
        """The same problem without limits on robots with more damping, see `model.with_damping`."""
        return replace(self, robots=tuple(robot.damped(ratio, frequency) for robot in self.robots), limits=None)

    @property
    def size(self) -> int:
        """Number of unknowns n."""
        return self.space.size

    @property
    def model(self) -> Model:
        """The nominal robot."""
        return self.robots[0].model

    @property
    def objective(self) -> Objective:
        """That of the nominal robot."""
        return self.robots[0].objective

    @property
    def world(self) -> Array | None:
        """Moving roots, or None."""
        return self.rigid.world

    @cached_property
    def unit(self) -> float:
        """Twice the objective of an error of one metre at every instant."""
        targets = max(1, 3 * len(self.model.targets.component))
        return max(float(np.sum(self.objective.weights**2)) / targets, 1e-300)

    def lever(self) -> float:
        """Largest lever arm of a motor: weighted root-mean-square motion of the targets per angle [m/rad]."""
        weighted = self.rigid.response.targets * self.objective.weights[..., None]
        return float(np.sqrt(np.max(np.sum(weighted**2, axis=(0, 1, 2))) / self.unit))


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What was computed at a point of a problem.

    Attributes:
        problem: The problem.
        x: The point, shape [n].
        runs: What each robot does there.
    """

    problem: RetargetProblem
    x: Array
    runs: tuple[RobotRun, ...]

    @property
    def run(self) -> ForwardRun:
        """Of the nominal robot."""
        return self.runs[0].run

    @cached_property
    def curves(self) -> Curves:
        """Of the motors."""
        return self.problem.space.changed(self.problem.curves, self.x)

    @cached_property
    def residuals(self) -> Array:
        """Weighted residuals, robot after robot, shape [S T, R]."""
        own = [run.residuals for run in self.runs]
        return own[0] if len(own) == 1 else np.concatenate(own)

    @cached_property
    def limited(self) -> dict[str, Array]:
        """Values of the limited quantities, shape [T, R] each."""
        bounds = {} if self.problem.limits is None else self.problem.limits.bounds
        orders = self.problem.space.orders
        found = {name: self.curves.derivatives[order] for name, order in orders.items() if name in bounds}
        for k, run in enumerate(self.runs):
            named = {name: of_robot(name, k) for name in run.robot.limited}
            found |= {key: run.robot.limited[name].values(run.run) for name, key in named.items() if key in bounds}
        return found

    @cached_property
    def error(self) -> float:
        """Root-mean-square error, weighted [m]."""
        squared = sum(float(np.sum(run.errors**2)) for run in self.runs)
        return float(np.sqrt(squared / self.problem.unit))

    @cached_property
    def objective_value(self) -> float:
        """The objective, without the terms of the limits."""
        return self.problem.norm.value(self.residuals) + self.problem.space.penalty_value(self.x)

    @property
    def acting(self) -> LimitTerms | None:
        """The limits where they are part of the merit."""
        return self.problem.limits if self.problem.limits is not None and self.problem.limits.on else None

    @property
    def limits_act(self) -> bool:
        """Whether limits are part of the merit."""
        return self.acting is not None

    @property
    def is_stiff(self) -> bool:
        """Whether limits act that are far stiffer than all else."""
        kinds = (kind for run in self.runs for kind in run.robot.limited.values())
        return self.limits_act and any(kind.is_stiff for kind in kinds)

    @cached_property
    def merit(self) -> float:
        """The objective and the terms of the limits that act."""
        return self.objective_value + (0.0 if self.acting is None else self.acting.value(self.limited))

    def of(self, problem: RetargetProblem) -> Evaluation:
        """The same runs as a point of another problem of the same robots and unknowns: with other limits or norm."""
        return Evaluation(problem, self.x, self.runs)

    def with_robots(self, problem: RetargetProblem) -> Evaluation:
        """The same motions of the robots of another problem, of which other quantities count."""
        runs = (RobotRun(robot, run.run) for robot, run in zip(problem.robots, self.runs, strict=True))
        return Evaluation(problem, self.x, tuple(runs))

    def with_limits(self, limits: LimitTerms | None) -> Evaluation:
        """The same runs under other limits."""
        return self.of(replace(self.problem, limits=limits))

    def tightened(self) -> Evaluation | None:
        """With limits switched on if they are violated, or their multipliers updated; None if that changes nothing."""
        limits = self.problem.limits
        tightened = None if limits is None else limits.tightened(self.limited, self.objective_value)
        return None if tightened is None else self.with_limits(tightened)

    def gain(self, decrease: float) -> float:
        """Decrease of the root-mean-square error that corresponds to a decrease of the merit [m].

        One of the terms of limits may be larger than the objective, and the merit with them below zero.
        """
        value = max(self.objective_value, decrease)
        return float(np.sqrt(2.0 * value / self.problem.unit) - np.sqrt(2.0 * (value - decrease) / self.problem.unit))

    def merit_of_gain(self, gain: float) -> float:
        """Decrease of the merit that reduces the root-mean-square error by `gain` [m], from here."""
        return float(self.problem.unit * gain * max(self.error, gain))

    def linearized(self) -> LinearProblem:
        """The derivatives here.

        Raises:
            SimulationFailure: A singular step.
        """
        problem = self.problem
        robots = in_parallel(lambda run: run.linearized(problem.first), self.runs)
        linear = LinearProblem(
            problem.space, problem.norm, problem.rigid, Sweeps(robots, problem.space), self.x, self.residuals,
            self.acting, self.limited if self.limits_act else {}, problem.continuous, problem.damping,
        )  # fmt: skip
        return (linear.by_responses() or linear) if problem.by_responses else linear


def with_first_penalty(at: Evaluation, tolerance: float) -> Evaluation:
    """The input in a problem whose limits have the penalty with which a search begins.

    Args:
        at: At the curves of the input.
        tolerance: Acceptable error [m].
    """
    limits = at.problem.limits
    if limits is None:
        return at
    # limits may cost far more than a robot errs before: one on stiff links by nothing
    value = max(at.objective_value, at.merit_of_gain(tolerance))
    return at.with_limits(replace(limits, rho=limits.penalty_beside(value)))
