"""Simulations of a model by motor inputs as arrays, and their derivatives: for who has no USD."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.analysis.kinematics import (
    of_components,
    of_targets,
    rigid_state,
    target_frames,
    target_jacobians,
)
from calmotion.multibody.analysis.modes import system_modes
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.integrate import integrate
from calmotion.multibody.integrators.trajectory import Trajectory
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, start_angles
from calmotion.multibody.model.system import State
from calmotion.multibody.sensitivity.adjoint import adjoint
from calmotion.multibody.sensitivity.linearization import Linearization
from calmotion.multibody.sensitivity.linearization import linearize as linearize_system
from calmotion.multibody.sensitivity.tangent import tangent


@dataclass(frozen=True, eq=False)
class ModelRun:
    """A simulation of T instants, M motors and K targets.

    Attributes:
        model: What was simulated.
        trajectory: States of all instants, costs, and the largest gap of a joint.
        joint_values, joint_rates: What the joints' motors follow, shape [T, J].
        positions: Of the targets in the world [m], shape [T, K, 3].
        rotations: Of the targets, quaternions (w, x, y, z), shape [T, K, 4].
    """

    model: Model
    trajectory: Trajectory
    joint_values: Array
    joint_rates: Array
    positions: Array
    rotations: Array

    @property
    def states(self) -> State:
        """Origins, quaternions and elastic coordinates of the bodies, their velocities, and the multipliers."""
        return self.trajectory.states

    @property
    def times(self) -> Array:
        """[s], shape [T]."""
        return np.asarray(self.trajectory.h * np.arange(len(self.joint_values)), float)

    @cached_property
    def efforts(self) -> Array:
        """Of the motors [N m or N], shape [T, M]."""
        found = reactions(self.model.system, self.trajectory, self.joint_values, self.joint_rates)
        return self.model.motor_efforts(found.efforts)


def simulate(model: Model, values: Array, rates: Array, step: float, integrator: str = "bdf2") -> ModelRun:
    """Simulate a model from its static equilibrium.

    Args:
        values, rates: Inputs of the motors [rad or m] and their rates, shape [T, M].
        step: Time between two instants [s].
        integrator: `bdf2`, `newmark`, `generalized-alpha` or `rk4`.

    Raises:
        SimulationFailure: No equilibrium, or a step that cannot be solved.
    """
    followed = model.joint_angles(values), model.joint_angles(rates)
    trajectory = from_rest(model, *followed, step, Workspace.for_system(model.system), integrator)
    return ModelRun(model, trajectory, *followed, *frames_in(model, trajectory))


def from_rest(
    model: Model, joint_values: Array, joint_rates: Array, step: float, workspace: Workspace, integrator: str = "bdf2",
    world: Array | None = None, progress: Callable[[float], None] | None = None, divides: bool = True,
    divided: IntArray | None = None,
) -> Trajectory:  # fmt: skip
    """The states of a model from its static equilibrium.

    Args:
        joint_values, joint_rates: What the joints' motors follow, shape [T, J].
        step: Time between two instants [s].
        workspace: Memory of the kernels.
        integrator: As of `simulate`.
        world: Moving roots, shape [T, W, 18], or None.
        progress: Called with the fraction that is done.
        divides: Whether a step that Newton's method cannot solve is divided into smaller ones.
        divided: Into how many parts each step is divided: see `integrators.simulation.simulate`.
    """
    start = rigid_state(model, start_angles(model, joint_values[0]), None if world is None else world[0])
    return integrate(
        model.system, start, joint_values, joint_rates, step, workspace, progress, integrator=integrator, world=world,
        divides=divides, divided=divided,
    )  # fmt: skip


def frames_in(model: Model, trajectory: Trajectory) -> tuple[Array, Array]:
    """Positions [m] and rotations of the targets, shapes [T, K, 3] and [T, K, 4]."""
    return target_frames(model, trajectory.states.c, trajectory.states.q, trajectory.states.u)


class LinearizedRun:
    """The derivative of the targets' frames by the motors' inputs, about a run; see `linearize`.

    A change of a frame has six entries: its position in world axes [m], and its rotation vector in its own axes [rad].
    """

    def __init__(self, run: ModelRun, linearization: Linearization):
        self.run = run
        self._linearization = linearization
        states = run.states
        self._by_coordinates = target_jacobians(run.model, states.c, states.q, states.u)

    def jvp(self, d_values: Array, d_rates: Array) -> Array:
        """Change of the targets' frames, shape [T, K, 6], with a change of the inputs, shape [T, M] each."""
        joints = self.run.model.joint_angles(d_values), self.run.model.joint_angles(d_rates)
        motion, _ = tangent(self._linearization, *joints)
        return of_targets(self.run.model, self._by_coordinates, motion)

    def vjp(self, gradient: Array) -> tuple[Array, Array]:
        """The transpose of `jvp`, by the discrete adjoint: the derivative of a scalar by values and rates, shape [T, M]
        each, from its derivative by the targets' frames, shape [T, K, 6]."""
        by_component = of_components(self.run.model, self._by_coordinates, gradient)
        by_value, by_rate = adjoint(self._linearization, by_component)
        return self.run.model.by_inputs(by_value), self.run.model.by_inputs(by_rate)


def linearize(run: ModelRun) -> LinearizedRun:
    """The exact derivative of the time-stepping scheme about a run by BDF2.

    Raises:
        ValueError: A run by another integrator.
        SimulationFailure: A singular step, or one that had to be refined.
    """
    workspace = Workspace.for_system(run.model.system)
    return LinearizedRun(
        run, linearize_system(run.model.system, run.trajectory, run.joint_values, run.joint_rates, workspace)
    )


def natural_modes(model: Model, values: Array) -> tuple[Array, Array]:
    """Natural frequencies [Hz], ascending, and damping ratios about the equilibrium at motor inputs of shape [M]."""
    return system_modes(model, start_angles(model, model.joint_angles(np.asarray(values, dtype=float))))
