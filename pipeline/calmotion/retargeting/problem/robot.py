"""One robot of a retargeting problem: what it does with motor curves, and the derivatives of that."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.model.model import Model, with_damping
from calmotion.retargeting.quantities.base import Quantity, RobotChange, Slopes
from calmotion.retargeting.quantities.efforts import Efforts
from calmotion.retargeting.quantities.target_errors import ErrorSlopes, TargetErrors
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.simulator import LinearRun, Simulator
from calmotion.simulation.target_errors import Objective

EFFORT, GROUND = "effort", "ground"


def of_robot(name: str, robot: int) -> str:
    """The name of a limited quantity of one of the robots of a problem."""
    return f"{name} of robot {robot}" if robot else name


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot that performs the motor curves.

    Attributes:
        simulator: Of the robot.
        objective: Errors at its targets.
        weight: Of its squared residuals among those of all robots of the problem.
        residuals: Of which the squares are made small beside those of the errors.
        limited: What may have limits, by name, beside the curves; its efforts where nothing is given.
    """

    simulator: Simulator
    objective: Objective
    weight: float = 1.0
    residuals: tuple[Quantity, ...] = ()
    limited: Mapping[str, Quantity] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if EFFORT not in self.limited:
            object.__setattr__(self, "limited", {EFFORT: Efforts(self.model), **self.limited})

    @property
    def model(self) -> Model:
        """Its multibody system."""
        return self.simulator.model

    def perform(self, angles: Array, rates: Array, near: RobotRun | None = None) -> RobotRun:
        """Simulate motor curves of shape [T, M].

        Args:
            near: From which the simulation goes on where the curves begin to differ.

        Raises:
            SimulationFailure: They cannot be simulated.
        """
        known = near.run if near is not None and near.robot.simulator is self.simulator else None
        run = self.simulator.run(angles, rates, known)
        return near if near is not None and near.run is run and near.robot is self else RobotRun(self, run)

    def damped(self, ratio: float, frequency: float) -> Robot:
        """The robot with more damping, see `model.with_damping`; only its errors count."""
        return Robot(self.simulator.of(with_damping(self.model, ratio, frequency)), self.objective, self.weight)


@dataclass(frozen=True, eq=False)
class RobotRun:
    """A robot and what it does with some curves."""

    robot: Robot
    run: ForwardRun
    _linear: dict[int, LinearRobot] = field(default_factory=dict)  # the last one that was worked out, by its instant

    @property
    def is_refined(self) -> bool:
        """Whether steps had to be divided, so that there are no derivatives."""
        return bool(self.run.trajectory.refined)

    @cached_property
    def parts(self) -> tuple[Array, ...]:
        """Weighted errors, shape [T, 6 K], and further residuals."""
        quantities = (TargetErrors(self.robot.objective), *self.robot.residuals)
        return tuple(np.sqrt(self.robot.weight) * quantity.values(self.run) for quantity in quantities)

    @property
    def errors(self) -> Array:
        """Weighted errors, shape [T, 6 K]."""
        return self.parts[0]

    @cached_property
    def residuals(self) -> Array:
        """All weighted residuals, the errors first, shape [T, R]."""
        return np.concatenate(self.parts, axis=1) if len(self.parts) > 1 else self.parts[0]

    def linearized(self, first: int) -> LinearRobot:
        """The derivatives by curves that do not change before an instant.

        Raises:
            SimulationFailure: A singular step.
        """
        if first in self._linear and self._linear[first].linear.is_held:
            return self._linear[first]
        robot, run = self.robot, self.run
        linear, errors = robot.simulator.linearize(run, first), TargetErrors(robot.objective).slopes(run)
        errors = ErrorSlopes(robot.objective, np.sqrt(robot.weight) * errors.jacobian)
        at = RobotRun(robot, run)  # not this one: large arrays that refer to each other would stay in memory for long
        at.__dict__["parts"] = self.parts
        self._linear.clear()
        self._linear[first] = LinearRobot(
            at,
            linear,
            errors,
            tuple(residual.slopes(run) for residual in robot.residuals),
            {name: quantity.slopes(run) for name, quantity in robot.limited.items()},
        )
        return self._linear[first]

    def continuous_adjoint(self) -> tuple[Array, Array]:
        """Derivatives of half the squared errors by the continuous adjoint."""
        objective, root = self.robot.objective, np.sqrt(self.robot.weight)
        jacobian = TargetErrors(objective).slopes(self.run).jacobian
        pulls = objective.scatter(root * jacobian, self.errors.reshape(jacobian.shape[:3]))
        return self.robot.simulator.continuous(self.run).continuous_adjoint(pulls)


@dataclass(frozen=True, eq=False)
class LinearRobot:
    """The derivatives of what a robot does about a run.

    Attributes:
        at: The run.
        linear: Of its motion.
        errors: Of its weighted errors.
        residuals, limited: Of further residuals, not weighted, and of limited quantities.
    """

    at: RobotRun
    linear: LinearRun
    errors: ErrorSlopes
    residuals: tuple[Slopes, ...]
    limited: Mapping[str, Slopes]
    known: dict[str, Any] = field(default_factory=dict)  # `responses.Responses` keeps its rows here

    def tangent(self, values: Array, rates: Array, names: Collection[str]) -> tuple[Array, dict[str, Array]]:
        """Change of the weighted residuals, shape [T, R], and of some limited quantities, with the motor curves, shape
        [T, M] each."""
        robot = self.at.robot
        efforts, loads = self._needs(names)
        d_load = np.zeros_like(self.at.run.trajectory.states.lam) if loads else None
        motion, effort = self.linear.tangent(values, rates, efforts, d_load)
        change = RobotChange(motion, effort if efforts else None, d_load, values)
        errors = self.errors.change(change)
        others = [np.sqrt(robot.weight) * slopes.change(change) for slopes in self.residuals]
        residuals = np.concatenate([errors, *others], axis=1) if others else errors
        return residuals, {name: self.limited[name].change(change) for name in names}

    def adjoint(self, residuals: Array, limited: Mapping[str, Array]) -> tuple[Array, Array]:
        """The transpose of `tangent`: derivatives by the motors' values and rates, shape [T, M] each."""
        run, root = self.at.run, np.sqrt(self.at.robot.weight)
        efforts, loads = self._needs(limited)
        pulls = RobotChange(
            np.zeros((len(residuals), len(self.linear.model.system.parent), self.errors.jacobian.shape[3])),
            np.zeros(run.commands.shape) if efforts else None,
            np.zeros_like(run.trajectory.states.lam) if loads else None,
            commands := np.zeros(run.commands.shape),
        )
        ends = np.cumsum([part.shape[1] for part in self.at.parts])
        errors, *others = np.split(residuals, ends[:-1], axis=1)
        self.errors.pull(errors, pulls)
        for slopes, values in zip(self.residuals, others, strict=True):
            slopes.pull(root * values, pulls)
        for name, values in limited.items():
            self.limited[name].pull(values, pulls)
        by_value, by_rate = self.linear.adjoint(pulls.motion, pulls.efforts, pulls.loads)
        return by_value + commands, by_rate

    def _needs(self, names: Collection[str]) -> tuple[bool, bool]:
        """Whether the changes of efforts and of multipliers are needed for these limits and the residuals."""
        robot = self.at.robot
        used = [*robot.residuals, *(robot.limited[name] for name in names)]
        return any(q.by_efforts for q in used), any(q.by_loads for q in used)
