"""One robot of a retargeting problem: its simulation, the errors at its targets, and their derivatives."""

from __future__ import annotations

import numpy as np

from calmotion.multibody.model.model import Model, with_damping
from calmotion.shot.character import Array
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.simulator import Simulator
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

    def linearize(self) -> None:
        """Linearise about the curves performed last."""
        self.simulator.linearize(self.run)
        self._differentiate()

    def _differentiate(self) -> None:
        states = self.run.trajectory.states
        self._jacobian = self.objective.jacobian(states.c, states.q, states.u, self._inverse)
        self._jacobian *= np.sqrt(self.weight)

    def tangent(self, values: Array, rates: Array, efforts: bool) -> tuple[Array, Array]:
        """Change of the residuals, shape [T, K, 6], and where wanted of the motors' efforts, with the motor curves,
        shape [T, M] each."""
        motion, effort = self.simulator.tangent(values, rates, efforts)
        return self.objective.gather(self._jacobian, motion), effort

    def adjoint(self, residuals: Array, effort: Array | None) -> tuple[Array, Array]:
        """The transpose of `tangent`: derivatives by the motors' values and rates, shape [T, M] each."""
        return self.simulator.adjoint(self.objective.scatter(self._jacobian, residuals), effort)

    def continuous_adjoint(self) -> tuple[Array, Array]:
        """Derivatives of half the squared residuals by the continuous adjoint."""
        self._differentiate()
        return self.simulator.continuous_adjoint(self.run, self.objective.scatter(self._jacobian, self.residuals))

    def damped(self, ratio: float, frequency: float) -> Robot:
        """The robot with more damping, see `model.with_damping`."""
        damped = with_damping(self.model, ratio, frequency)
        return Robot(self.simulator.of(damped), self.objective, self.weight)
