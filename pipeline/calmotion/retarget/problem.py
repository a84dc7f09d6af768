"""The retargeting problem of a shot: motor curves in, error at the targets out, with exact derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..dynamics.failure import SimulationFailure
from ..dynamics.integrators import integrate
from ..dynamics.kinematics import rigid_poses, rigid_state, target_frames
from ..dynamics.linearization import Linearization, linearize
from ..dynamics.model import Model, rigid_model
from ..dynamics.simulation import Trajectory, Workspace
from ..dynamics.sweeps import adjoint, tangent
from ..shot.character import Array, BoolArray, IntArray
from .curves import OffsetBasis, TimeGrid
from .objective import Objective, Reference
from .preconditioner import RigidPreconditioner, rigid_motor_jacobian


@dataclass(frozen=True, eq=False)
class ForwardRun:
    """One forward simulation and what the targets do in it."""

    trajectory: Trajectory
    joint_angles: Array
    joint_rates: Array
    target_positions: Array
    target_rotations: Array


def _moves_freely(model: Model) -> BoolArray:
    """Which joints no motor holds."""
    rows = model.system.rows
    return (rows > 0) & (rows < 6)


def start_angles(model: Model, joint_angles: Array) -> Array:
    """Angles of all joints for the first pose: motors from their tracks, free joints as the shot was authored."""
    free = _moves_freely(model)
    return np.where(free, model.rest_angles, joint_angles)


def run_forward(
    model: Model, workspace: Workspace, angles: Array, rates: Array, h: float, world: Array | None = None,
    progress=None, integrator: str = "bdf2",
) -> ForwardRun:  # fmt: skip
    """Simulate motor curves.

    Args:
        angles, rates: Of the motors, shape [T, M] [rad, rad/s].
        h: Step [s].
        world: Moving roots, see `roots.sample_roots`.
        integrator: One of `integrators.INTEGRATORS`.
    """
    joint_angles, joint_rates = model.joint_angles(angles), model.joint_angles(rates)
    start = rigid_state(model, start_angles(model, joint_angles[0]), None if world is None else world[0])
    trajectory = integrate(
        model.system, start, joint_angles, joint_rates, h, workspace, progress, integrator=integrator, world=world
    )
    states = trajectory.states
    positions, rotations = target_frames(model, states.c, states.q, states.u)
    return ForwardRun(trajectory, joint_angles, joint_rates, positions, rotations)


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """The motion of the rigid robot: body poses (by component) and targets, shapes [T, B, ...], [T, K, ...]."""

    c: Array
    q: Array
    target_positions: Array
    target_rotations: Array

    @property
    def reference(self) -> Reference:
        """The targets alone."""
        return Reference(self.target_positions, self.target_rotations)


def rigid_motion(model: Model, angles: Array, rates: Array, h: float, world: Array | None = None) -> RigidMotion:
    """The animation on a rigid robot: kinematics alone, or a rigid simulation where joints move freely."""
    rigid = rigid_model(model)
    if np.any(_moves_freely(rigid)):
        run = run_forward(rigid, Workspace.for_system(rigid.system), angles, rates, h, world)
        states = run.trajectory.states
        return RigidMotion(states.c, states.q, run.target_positions, run.target_rotations)
    c, q = rigid_poses(rigid, model.joint_angles(angles), world)
    positions, rotations = target_frames(rigid, c, q, np.zeros(c.shape[:2] + (0,)))
    return RigidMotion(c, q, positions, rotations)


def compile_kernels(
    model: Model, workspace: Workspace, angles: Array, rates: Array, h: float, world: Array | None = None
) -> None:
    """Run every kernel once on three instants, so that compiling them is not counted as simulating."""
    run = run_forward(model, workspace, angles[:3], rates[:3], h, None if world is None else world[:3])
    lin = linearize(model.system, run.trajectory, run.joint_angles, run.joint_rates, workspace)
    adjoint(lin, tangent(lin, run.joint_angles, run.joint_rates))


class RetargetProblem:
    """`gauss_newton.LeastSquares` over the spline coefficients of the offsets, ordered by basis function, then motor.

    Args:
        model: The flexible character.
        grid: Its time grid.
        angles, rates: The animator's curves, shape [T, M].
        objective: Errors at the targets.
        basis: Offset splines.
        motors: Motors that may change.
        smoothness: Weight of int |offset''|^2 / 2 for each motor.
        closeness: Weight of int |offset|^2 / 2 for each motor.
        gain: A predicted decrease of the root-mean-square error by less than this is not worth an iteration [m].
        world: Moving roots.
    """

    def __init__(
        self, model: Model, grid: TimeGrid, angles: Array, rates: Array, objective: Objective, basis: OffsetBasis,
        motors: IntArray, smoothness: float, closeness: float, gain: float, world: Array | None = None,
    ):  # fmt: skip
        self.model, self.grid, self.objective, self.basis = model, grid, objective, basis
        self.angles, self.rates, self.motors, self.world = angles, rates, motors, world
        self._penalty = smoothness * basis.bending + closeness * basis.closeness
        self._workspace = Workspace.for_system(model.system)
        self._run: ForwardRun | None = None
        self._linearization: Linearization | None = None
        self._residuals = self._inverse = self._jacobian = np.zeros(0)
        self._x = np.zeros(0)
        self._preconditioner: RigidPreconditioner | None = None
        judged = float(np.sum(objective.weights**2)) / max(1, 3 * len(model.targets.component))
        # objective of an error of `gain` everywhere: the scale of what is worth having
        self._gain = gain
        self._unit = max(judged, 1e-300)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.basis.count * len(self.motors)

    @property
    def run(self) -> ForwardRun:
        """The simulation of the point evaluated last."""
        assert self._run is not None
        return self._run

    def offsets(self, x: Array) -> tuple[Array, Array]:
        """Offsets and their rates for all motors, shape [T, M]."""
        coefficients = x.reshape(self.basis.count, len(self.motors))
        values, rates = np.zeros_like(self.angles), np.zeros_like(self.rates)
        values[:, self.motors] = self.basis.values @ coefficients
        rates[:, self.motors] = self.basis.rates @ coefficients
        return values, rates

    def _bend(self, x: Array) -> Array:
        """Matrix of the regulariser times x."""
        coefficients = x.reshape(self.basis.count, len(self.motors))
        return (self._penalty @ coefficients).ravel()

    def value(self, x: Array) -> float:
        """The objective; infinite where the simulation fails."""
        values, rates = self.offsets(x)
        try:
            self._run = run_forward(
                self.model, self._workspace, self.angles + values, self.rates + rates, self.grid.h, self.world
            )
        except SimulationFailure:
            return np.inf
        self._residuals, self._inverse = self.objective.residuals(
            self._run.target_positions, self._run.target_rotations
        )
        self._x = x.copy()
        return 0.5 * float(np.sum(self._residuals**2)) + 0.5 * float(x @ self._bend(x))

    def linearize(self) -> Array:
        """Gradient by the discrete adjoint, at the point evaluated last."""
        run = self.run
        self._linearization = linearize(
            self.model.system, run.trajectory, run.joint_angles, run.joint_rates, self._workspace, self._linearization
        )
        states = run.trajectory.states
        self._jacobian = self.objective.jacobian(states.c, states.q, states.u, self._inverse)
        return self._pull_back(self._residuals) + self._bend(self._x)

    def _pull_back(self, residuals: Array) -> Array:
        assert self._linearization is not None
        by_angle, by_rate = adjoint(self._linearization, self.objective.scatter(self._jacobian, residuals))
        g_angle, g_rate = self._by_motor(by_angle), self._by_motor(by_rate)
        return (self.basis.values.T @ g_angle + self.basis.rates.T @ g_rate).ravel()

    def _by_motor(self, by_joint: Array) -> Array:
        return self.model.motor_values(by_joint)[:, self.motors]

    def push_forward(self, direction: Array) -> Array:
        """Change of the weighted residuals along a direction, shape [T, K, 6]."""
        assert self._linearization is not None
        values, rates = self.offsets(direction)
        motion = tangent(self._linearization, self.model.joint_angles(values), self.model.joint_angles(rates))
        return self.objective.gather(self._jacobian, motion)

    def product(self, direction: Array) -> Array:
        """Gauss-Newton matrix times a direction: one tangent and one adjoint sweep."""
        return self._pull_back(self.push_forward(direction)) + self._bend(direction)

    def precondition(self, fixed: BoolArray) -> Callable[[Array], Array]:
        """The rigid robot's Gauss-Newton matrix, inverted over the entries that are not fixed."""
        if self._preconditioner is None:
            rigid = rigid_model(self.model)
            J = rigid_motor_jacobian(rigid, self.model.joint_angles(self.angles), self.motors, self.world)
            self._preconditioner = RigidPreconditioner(J, self.objective.weights, self.basis.values, self._penalty)
        self._preconditioner.factor(fixed)
        return self._preconditioner.solve

    def gain_is_small(self, gain: float, value: float) -> bool:
        """Whether a decrease of the objective changes the root-mean-square error by less than `gain`."""
        now = np.sqrt(2.0 * max(value, 0.0) / self._unit)
        then = np.sqrt(2.0 * max(value - gain, 0.0) / self._unit)
        return bool(now - then < self._gain)
