"""Quantities of which plugins make residuals and limits of their own.

As limits they are stiff: without their rows in the preconditioner, searches of a small arm under them took two to eight
times as many products, and ended at larger errors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array
from calmotion.multibody.analysis.kinematics import of_components, of_targets, target_jacobians
from calmotion.multibody.model.model import Model
from calmotion.retargeting.quantities.base import Quantity, RobotChange, Slopes
from calmotion.simulation.forward import ForwardRun


@dataclass(frozen=True, eq=False)
class TargetPositions(Quantity):
    """Positions of the targets in the world [m], x, y and z of one after the other, R = 3 K."""

    model: Model

    def values(self, run: ForwardRun) -> Array:
        """As simulated."""
        return run.target_positions.reshape(len(run.target_positions), -1)

    def slopes(self, run: ForwardRun) -> PositionSlopes:
        """By the coordinates of the targets' components."""
        states = run.trajectory.states
        jacobian = target_jacobians(self.model, states.c, states.q, states.u)
        return PositionSlopes(self.model, np.ascontiguousarray(jacobian[:, :, :3]))


@dataclass(frozen=True, eq=False)
class PositionSlopes:
    """Derivatives of positions by their component's coordinates, shape [T, K, 3, N]."""

    model: Model
    jacobian: Array

    def change(self, by: RobotChange) -> Array:
        """With the motion."""
        return of_targets(self.model, self.jacobian, by.motion).reshape(len(self.jacobian), -1)

    def pull(self, values: Array, onto: RobotChange) -> None:
        """By the motion."""
        onto.motion += of_components(self.model, self.jacobian, values.reshape(self.jacobian.shape[:3]))


@dataclass(frozen=True, eq=False)
class FilteredCommands(Quantity):
    """The motors' curves [rad or m] under a filter that is linear, such as a difference over a window, R = M.

    Attributes:
        filter: Values at all instants by those of the curve, shape [T, T].
    """

    filter: csr_matrix
    is_stiff: ClassVar[bool] = True

    def values(self, run: ForwardRun) -> Array:
        """Of the curves that were simulated."""
        return np.asarray(self.filter @ run.commands)

    def slopes(self, run: ForwardRun) -> FilteredCommands:
        """The same everywhere."""
        return self

    def change(self, by: RobotChange) -> Array:
        """With the curves."""
        return np.asarray(self.filter @ by.commands)

    def pull(self, values: Array, onto: RobotChange) -> None:
        """By the curves."""
        assert onto.commands is not None
        onto.commands += self.filter.T @ values


@dataclass(frozen=True, eq=False)
class FunctionOf(Quantity):
    """A function of the whole course of another quantity of the same run.

    Attributes:
        of: The quantity, Q numbers at each of T instants.
        function: Maps its values of shape [T, Q] to those of this one, shape [T, R], and to their derivatives as a
            sparse matrix of shape [T R, T Q], both counted row by row.
    """

    of: Quantity
    function: Callable[[Array], tuple[Array, csr_matrix]]
    is_stiff: ClassVar[bool] = True

    @property
    def by_efforts(self) -> bool:
        """As the other one."""
        return self.of.by_efforts

    @property
    def by_loads(self) -> bool:
        """As the other one."""
        return self.of.by_loads

    def values(self, run: ForwardRun) -> Array:
        """Of the function."""
        return self.function(self.of.values(run))[0]

    def slopes(self, run: ForwardRun) -> FunctionSlopes:
        """By the chain rule."""
        inner = self.of.values(run)
        values, jacobian = self.function(inner)
        if jacobian.shape != (values.size, inner.size):
            raise ValueError(f"derivatives have shape {list(jacobian.shape)} instead of [{values.size}, {inner.size}]")
        return FunctionSlopes(self.of.slopes(run), csr_matrix(jacobian))


@dataclass(frozen=True, eq=False)
class FunctionSlopes:
    """Derivatives of a function, shape [T R, T Q], after those of what it is a function of."""

    of: Slopes
    jacobian: csr_matrix

    def change(self, by: RobotChange) -> Array:
        """With what the robot does."""
        inner = self.of.change(by)
        return np.asarray(self.jacobian @ inner.ravel()).reshape(len(inner), -1)

    def pull(self, values: Array, onto: RobotChange) -> None:
        """By what the robot does."""
        self.of.pull(np.asarray(self.jacobian.T @ values.ravel()).reshape(len(values), -1), onto)
