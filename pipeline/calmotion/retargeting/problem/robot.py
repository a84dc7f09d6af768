"""One robot of a retargeting problem: its simulation, the residuals of its targets and gears, and their derivatives."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.model.model import Model, with_damping
from calmotion.retargeting.problem.ground import GroundSlopes, ground_values
from calmotion.retargeting.problem.reversals import ReversalTerms, transmitted_by
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.simulator import Simulator
from calmotion.simulation.standing.ground_limits import GroundLimits
from calmotion.simulation.target_errors import Objective


class Robot:
    """A robot that performs the motor curves.

    Args:
        simulator: Of the robot.
        objective: Errors at its targets.
        weight: Of its squared errors among those of all robots of the problem.
    """

    def __init__(self, simulator: Simulator, objective: Objective, weight: float = 1.0):
        self.simulator, self.objective, self.weight = simulator, objective, weight
        self.residuals = self._inverse = self._jacobian = np.zeros(0)
        self.reversals: ReversalTerms | None = None  # of the play of its gears, where reversals are to be avoided
        self.ground: GroundLimits | None = None  # of what ground can do to its feet
        self._ground_slopes: GroundSlopes | None = None  # where it was linearised last
        self._efforts = np.zeros(0)  # transmitted by its gears, where they count
        self._run: ForwardRun | None = None

    @property
    def model(self) -> Model:
        """Its multibody system."""
        return self.simulator.model

    @property
    def run(self) -> ForwardRun:
        """The simulation of the curves performed last."""
        assert self._run is not None
        return self._run

    @property
    def jacobian(self) -> Array:
        """Weighted residuals by their component's coordinates where it was linearised last, shape [T, K, 6, N]."""
        return self._jacobian

    def perform(self, angles: Array, rates: Array) -> None:
        """Simulate motor curves of shape [T, M]; `residuals` are then the weighted errors, shape [T, K, 6].

        Raises:
            SimulationFailure: They cannot be simulated.
        """
        self._run = self.simulator.run(angles, rates)
        residuals, self._inverse = self.objective.residuals(self._run.target_positions, self._run.target_rotations)
        self.residuals = np.sqrt(self.weight) * residuals
        self.count(self.reversals)

    def count(self, reversals: ReversalTerms | None) -> None:
        """Count the play of its gears, where there are terms of it, for the curves performed last and from now on."""
        self.reversals = reversals
        if reversals is not None:
            self._efforts = transmitted_by(self.model, self.run)

    @property
    def stacked(self) -> Array:
        """Its R residuals at each instant, shape [T, R]: the weighted errors, and those of its gears' play."""
        errors = self.residuals.reshape(len(self.residuals), -1)
        if self.reversals is None:
            return errors
        return np.concatenate([errors, np.sqrt(self.weight) * self.reversals.residuals(self._efforts)], axis=1)

    def by_effort(self) -> Array:
        """Gauss-Newton matrix of the residuals of its gears' play by the efforts: its diagonal, shape [T, M]."""
        assert self.reversals is not None
        found = np.zeros(self._efforts.shape)
        found[:, self.reversals.motors] = self.weight * self.reversals.slopes(self._efforts) ** 2
        return found

    def on_ground(self) -> Array:
        """The limited quantities of its feet, `ground.ground_values`, for the curves performed last."""
        assert self.ground is not None
        return ground_values(self.ground, self.run, self.simulator.h)

    def linearize(self) -> None:
        """Linearise about the curves performed last."""
        self.simulator.linearize(self.run)
        self._differentiate()

    def _differentiate(self) -> None:
        states = self.run.trajectory.states
        self._jacobian = self.objective.jacobian(states.c, states.q, states.u, self._inverse)
        self._jacobian *= np.sqrt(self.weight)
        if self.ground is not None:
            self._ground_slopes = GroundSlopes.about(self.ground, self.run, self.simulator.h)

    def tangent(self, values: Array, rates: Array, efforts: bool, ground: bool = False) -> tuple[Array, Array, Array]:
        """Change of the residuals, shape [T, R], and where wanted of the motors' efforts and of the quantities of its
        feet, with the motor curves, shape [T, M] each."""
        slopes, on_ground = self._ground_slopes if ground else None, np.zeros((len(values), 0))
        loads = None if slopes is None else np.zeros_like(self.run.trajectory.states.lam)
        motion, effort = self.simulator.tangent(values, rates, efforts or self.reversals is not None, loads)
        if slopes is not None and loads is not None:
            on_ground = slopes.tangent(motion, loads)
        errors = self.objective.gather(self._jacobian, motion)
        errors = errors.reshape(len(errors), -1)
        if self.reversals is None:
            return errors, effort, on_ground
        by_effort = np.sqrt(self.weight) * self.reversals.slopes(self._efforts)
        return np.concatenate([errors, by_effort * effort[:, self.reversals.motors]], axis=1), effort, on_ground

    def adjoint(self, residuals: Array, effort: Array | None, ground: Array | None = None) -> tuple[Array, Array]:
        """The transpose of `tangent`: derivatives by the motors' values and rates, shape [T, M] each."""
        count = int(np.prod(self.residuals.shape[1:]))
        if self.reversals is not None:
            slopes = np.sqrt(self.weight) * self.reversals.slopes(self._efforts)
            effort = np.zeros(self._efforts.shape) if effort is None else effort.copy()
            effort[:, self.reversals.motors] += slopes * residuals[:, count:]
        errors = residuals[:, :count].reshape(self.residuals.shape)
        gradient, loads = self.objective.scatter(self._jacobian, errors), None
        if ground is not None and self._ground_slopes is not None:
            loads = np.zeros_like(self.run.trajectory.states.lam)
            self._ground_slopes.adjoint(ground, gradient, loads)
        return self.simulator.adjoint(gradient, effort, loads)

    def continuous_adjoint(self) -> tuple[Array, Array]:
        """Derivatives of half the squared residuals by the continuous adjoint."""
        self._differentiate()
        return self.simulator.continuous_adjoint(self.run, self.objective.scatter(self._jacobian, self.residuals))

    def damped(self, ratio: float, frequency: float) -> Robot:
        """The robot with more damping, see `model.with_damping`; the play of its gears does not count."""
        damped = with_damping(self.model, ratio, frequency)
        return Robot(self.simulator.of(damped), self.objective, self.weight)
