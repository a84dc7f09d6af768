"""The motions of a robot for motor curves, from rest or in a loop, and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.analysis.kinematics import target_frames
from calmotion.multibody.integrators.simulation import simulate_from
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model
from calmotion.multibody.model.phases import has_phases
from calmotion.multibody.sensitivity.adjoint import adjoint
from calmotion.multibody.sensitivity.block_tangent import block_tangent, can_be_blocked
from calmotion.multibody.sensitivity.continuous_adjoint import continuous_adjoint
from calmotion.multibody.sensitivity.linearization import Linearization, linearize
from calmotion.multibody.sensitivity.periodic import Monodromy, periodic_adjoint, periodic_tangent
from calmotion.multibody.sensitivity.tangent import tangent
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.forward import ForwardRun, followed, run_forward
from calmotion.simulation.inputs.curves import CommandDelay


def compile_kernels(
    model: Model, workspace: Workspace, angles: Array, rates: Array, h: float, world: Array | None = None
) -> None:
    """Run every kernel once on three instants, so that compiling them is not counted as simulating."""
    run = run_forward(model, workspace, angles[:3], rates[:3], h, None if world is None else world[:3])
    lin = linearize(model.system, run.trajectory, run.joint_angles, run.joint_rates, workspace)
    adjoint(lin, *tangent(lin, run.joint_angles, run.joint_rates, efforts=True))


class LinearRun:
    """Derivatives about a run.

    Args:
        model: The robot.
        h: Step [s].
        linearization: About the run.
        monodromy: Of a shot that loops; else None.
    """

    def __init__(self, model: Model, h: float, linearization: Linearization, monodromy: Monodromy | None):
        self.model, self.h = model, h
        self._linearization: Linearization | None = linearization
        self._monodromy = monodromy

    @property
    def linearization(self) -> Linearization:
        """The blocks of all instants.

        Raises:
            RuntimeError: Another run was linearised in its memory since.
        """
        if self._linearization is None:
            raise RuntimeError("these derivatives were given up for those about another run")
        return self._linearization

    @property
    def is_held(self) -> bool:
        """Whether it still has its memory."""
        return self._linearization is not None

    def given_up(self) -> Linearization:
        """The blocks, whose memory another linearisation takes over."""
        found, self._linearization = self.linearization, None
        return found

    def tangent(self, values: Array, rates: Array, efforts: bool, d_load: Array | None = None) -> tuple[Array, Array]:
        """Change of the components' coordinates, shape [T, B, N], and where wanted of the motors' efforts, [T, M], with
        the motors' values and rates, shape [T, M].

        Args:
            d_load: Filled with the change of the joints' multipliers, shape [T, J, 6], of a shot that plays once.
        """
        given = *followed(self.model, values, rates, self.h, self._monodromy is not None), efforts
        if self._monodromy is None:
            motion, effort = tangent(self.linearization, *given, d_load)
        else:
            motion, effort = periodic_tangent(self.linearization, self._monodromy, *given)
        return motion, self.model.motor_efforts(effort, through_gears=True)

    def adjoint(self, gradient: Array, effort: Array | None, load: Array | None = None) -> tuple[Array, Array]:
        """The transpose of `tangent`: derivatives by the motors' values and rates, shape [T, M] each."""
        given = gradient, None if effort is None else self.model.by_efforts(effort)
        if self._monodromy is None:
            found = adjoint(self.linearization, *given, load)
        else:
            found = periodic_adjoint(self.linearization, self._monodromy, *given)
        return self._on_curves(*found)

    def continuous_adjoint(self, gradient: Array) -> tuple[Array, Array]:
        """The same by the continuous adjoint, of `Simulator.continuous`."""
        return self._on_curves(*continuous_adjoint(self.linearization, gradient))

    def can_be_blocked(self) -> bool:
        """Whether `responses` works."""
        return self._monodromy is None and can_be_blocked(self.linearization)

    def responses(
        self, values: Array, rates: Array, begin: int, coupling: Array, component: IntArray, jacobian: Array,
        motors: Sequence[int] = (),
    ) -> tuple[int, Array]:  # fmt: skip
        """Changes of quantities and of efforts by many curves at once.

        Args:
            values, rates: Curves over n instants, before which they are zero, shape [n, F].
            begin: The first of these instants; from 1 on the curves are still zero there.
            coupling: Of each motor with each of m unknowns, shape [M, m]: each curve is tried with each of these.
            component, jacobian: The quantities, as of `block_tangent`.
            motors: Whose efforts are wanted, shape [e].

        Returns:
            The first instant at which anything changes, and the changes from there to the last of these instants, shape
            [begin + n - first, r + e, F m].
        """
        columns = [self._joint_columns(*curve, coupling) for curve in zip(values.T, rates.T, strict=True)]
        angles, speeds = (np.concatenate([column[k] for column in columns], axis=2) for k in (0, 1))
        acts = np.any(angles, axis=(1, 2)) | np.any(speeds, axis=(1, 2))
        first = max(self.linearization.windows()[0][0], begin + int(np.argmax(acts)))
        given = angles[first - begin :], speeds[first - begin :]
        by_joint = self.model.motor_efforts(np.eye(len(self.model.motor)), through_gears=True).T[list(motors)]
        joints = np.flatnonzero(np.any(by_joint, axis=0)).astype(np.int32)
        found = block_tangent(self.linearization, first, *given, component, jacobian, joints)
        if not len(joints):
            return first, found
        of_motors = by_joint[:, joints] @ found[:, len(component) :]
        return first, np.concatenate([found[:, : len(component)], of_motors], axis=1)

    def _joint_columns(self, values: Array, rates: Array, coupling: Array) -> tuple[Array, Array]:
        """What the joints follow by one curve of shape [n] with each unknown, shape [n, J, m]."""
        motors = np.ones((1, len(coupling)))
        late = CommandDelay(self.model.delays, self.h, False).apply(values[:, None] * motors, rates[:, None] * motors)
        angles, speeds = (self.model.joint_angles(part[:, None] * coupling.T) for part in late)
        return angles.transpose(0, 2, 1), speeds.transpose(0, 2, 1)

    def _on_curves(self, by_angle: Array, by_rate: Array) -> tuple[Array, Array]:
        """Derivatives by the motors' curves, shape [T, M], from those by what the joints follow, [T, J]."""
        by_value, by_change = self.model.by_inputs(by_angle), self.model.by_inputs(by_rate)
        delay = CommandDelay(self.model.delays, self.h, self._monodromy is not None)
        return delay.transposed(by_value, by_change)


class Simulator:
    """One robot over one time grid. It has memory for one linearisation, which the next one takes over.

    Args:
        model: The robot.
        h: Step [s].
        world: Moving roots, shape [T, W, 18].
        cyclic: Whether the shot loops.
    """

    def __init__(self, model: Model, h: float, world: Array | None, cyclic: bool):
        self.model, self.h, self.world = model, h, world
        self._workspace = Workspace.for_system(model.system)
        self._steady = SteadyState(model, world, h, self._workspace) if cyclic else None
        self._linear: LinearRun | None = None
        self._continuous: Linearization | None = None

    @property
    def goes_on(self) -> bool:
        """Whether motions may go on from others: loops have no beginning that could stay, and with contacts all is
        simulated from its start."""
        return self._steady is None and not has_phases(self.model.system)

    def of(self, model: Model) -> Simulator:
        """The same of another model of the same character; its loops begin near those of this one."""
        other = Simulator(model, self.h, self.world, False)
        if self._steady is not None:
            other._steady = self._steady.for_model(model)
        return other

    def run(self, angles: Array, rates: Array, near: ForwardRun | None = None) -> ForwardRun:
        """Simulate motor curves of shape [T, M].

        Args:
            near: A run from which the motion goes on where the curves begin to differ; itself where they are the same.

        Raises:
            SimulationFailure: They cannot be simulated.
        """
        if near is None or not self.goes_on:
            return run_forward(self.model, self._workspace, angles, rates, self.h, self.world, steady=self._steady)
        joint_angles, joint_rates = followed(self.model, angles, rates, self.h, False)
        same = np.all(joint_angles == near.joint_angles, axis=1) & np.all(joint_rates == near.joint_rates, axis=1)
        if np.all(same):
            return near
        first = int(np.argmin(same))
        if first < 2 or {first - 1, first - 2} & set(near.trajectory.refined):
            return run_forward(self.model, self._workspace, angles, rates, self.h, self.world)
        return self._from(near, first, angles, (joint_angles, joint_rates))

    def _from(
        self, known: ForwardRun, first: int, angles: Array, followed_by_joints: tuple[Array, Array]
    ) -> ForwardRun:
        """The motion whose instants before `first` are those of a known one."""
        joint_angles, joint_rates = followed_by_joints
        trajectory = simulate_from(
            self.model.system, known.trajectory, first, joint_angles, joint_rates, self._workspace
        )
        states = trajectory.states
        positions, rotations = target_frames(self.model, states.c[first:], states.q[first:], states.u[first:])
        return ForwardRun(
            trajectory, joint_angles, joint_rates, np.concatenate([known.target_positions[:first], positions]),
            np.concatenate([known.target_rotations[:first], rotations]), angles,
        )  # fmt: skip

    def linearize(self, run: ForwardRun, first: int = 0) -> LinearRun:
        """The derivatives about a run. Those about an earlier run are of no use any more.

        Args:
            first: Instant before which motor curves do not change: derivatives by what acts before are zero.
        """
        begin = 2 if self._steady is not None else first if self.goes_on else 0
        previous, self._linear = self._linear, None  # whose memory is used again, also where this fails
        if previous is not None and previous.linearization.is_of(run.trajectory, begin):
            self._linear = previous
            return previous
        memory = None if previous is None else previous.given_up()
        found = self._linearized(run, memory, begin)
        monodromy = None
        if self._steady is not None:
            monodromy = self._steady.known = Monodromy.of(found)
        self._linear = LinearRun(self.model, self.h, found, monodromy)
        return self._linear

    def continuous(self, run: ForwardRun) -> LinearRun:
        """The same for `LinearRun.continuous_adjoint`, of a shot that plays once, in memory of its own."""
        self._continuous = self._linearized(run, self._continuous, 0, continuous=True)
        return LinearRun(self.model, self.h, self._continuous, None)

    def _linearized(
        self, run: ForwardRun, previous: Linearization | None, begin: int, continuous: bool = False
    ) -> Linearization:
        return linearize(
            self.model.system, run.trajectory, run.joint_angles, run.joint_rates, self._workspace, previous,
            continuous=continuous, begin=begin,
        )  # fmt: skip
