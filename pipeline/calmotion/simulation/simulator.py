"""The motions of a robot for motor curves, from rest or in a loop, and their derivatives."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.analysis.kinematics import target_frames
from calmotion.multibody.integrators.simulation import simulate_from
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model
from calmotion.multibody.model.phases import has_contacts
from calmotion.multibody.sensitivity.adjoint import adjoint
from calmotion.multibody.sensitivity.block_tangent import block_tangent, can_be_blocked
from calmotion.multibody.sensitivity.continuous_adjoint import continuous_adjoint
from calmotion.multibody.sensitivity.linearization import Linearization, linearize
from calmotion.multibody.sensitivity.periodic import Monodromy, periodic_adjoint, periodic_tangent
from calmotion.multibody.sensitivity.tangent import tangent
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.forward import ForwardRun, followed, run_forward
from calmotion.simulation.inputs.delays import CommandDelay


def compile_kernels(
    model: Model, workspace: Workspace, angles: Array, rates: Array, h: float, world: Array | None = None
) -> None:
    """Run every kernel once on three instants, so that compiling them is not counted as simulating."""
    run = run_forward(model, workspace, angles[:3], rates[:3], h, None if world is None else world[:3])
    lin = linearize(model.system, run.trajectory, run.joint_angles, run.joint_rates, workspace)
    adjoint(lin, *tangent(lin, run.joint_angles, run.joint_rates, efforts=True))


class Simulator:
    """One robot over one time grid.

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
        self._linearization: Linearization | None = None
        self._for_continuous: Linearization | None = None
        self._monodromy: Monodromy | None = None
        self._first: int | None = None
        self._known: ForwardRun | None = None  # the last motion, where simulations go on from it

    def hold(self, first: int) -> None:
        """From now on motor curves stay as they are before an instant.

        Simulations then go on from the first instant at which they differ from the one before, and derivatives by what
        acts before the instant are not worked out: they are zero. Loops have no beginning that could stay, and
        with contacts all is simulated from its start.
        """
        if self._steady is None and not has_contacts(self.model.system):
            self._first = first

    def forget(self) -> None:
        """The next motion is simulated from its start, also where its beginning is known."""
        self._known = None

    def of(self, model: Model) -> Simulator:
        """The same of another model of the same character; its loops begin near those of this one."""
        other = Simulator(model, self.h, self.world, False)
        if self._steady is not None:
            other._steady = self._steady.for_model(model)
        other._first = self._first
        return other

    def run(self, angles: Array, rates: Array) -> ForwardRun:
        """Simulate motor curves of shape [T, M].

        Raises:
            SimulationFailure: They cannot be simulated.
        """
        known = self._known
        if known is None:
            run = run_forward(self.model, self._workspace, angles, rates, self.h, self.world, steady=self._steady)
        else:
            run = self._gone_on(known, angles, rates)
        if self._first is not None:
            self._known = run
        return run

    def _gone_on(self, known: ForwardRun, angles: Array, rates: Array) -> ForwardRun:
        """The motion that goes on from a known one; that one itself where nothing is different."""
        joint_angles, joint_rates = followed(self.model, angles, rates, self.h, False)
        same = np.all(joint_angles == known.joint_angles, axis=1) & np.all(joint_rates == known.joint_rates, axis=1)
        if np.all(same):
            return known
        first = int(np.argmin(same))
        if first < 2 or {first - 1, first - 2} & set(known.trajectory.refined):
            return run_forward(self.model, self._workspace, angles, rates, self.h, self.world)
        return self._from(known, first, angles, (joint_angles, joint_rates))

    def _from(
        self, known: ForwardRun, first: int, angles: Array, followed_by_joints: tuple[Array, Array]
    ) -> ForwardRun:
        """The motion whose instants before `first` are those of a known one."""
        joint_angles, joint_rates = followed_by_joints
        trajectory = simulate_from(
            self.model.system, known.trajectory, first, joint_angles, joint_rates, self._workspace
        )  # fmt: skip
        states = trajectory.states
        positions, rotations = target_frames(self.model, states.c[first:], states.q[first:], states.u[first:])
        return ForwardRun(
            trajectory, joint_angles, joint_rates, np.concatenate([known.target_positions[:first], positions]),
            np.concatenate([known.target_rotations[:first], rotations]), angles,
        )  # fmt: skip

    def linearize(self, run: ForwardRun) -> None:
        """Linearise about a run, for `tangent` and `adjoint`."""
        begin = 2 if self._steady is not None else self._first or 0
        previous, self._linearization = self._linearization, None  # whose memory is used again, also where this fails
        if previous is not None and self._known is run and previous.is_of(run.trajectory, begin):
            self._linearization = previous
            return
        self._linearization = self._linearized(run, previous, begin)
        if self._steady is not None:
            self._monodromy = self._steady.known = Monodromy.of(self._linearization)

    def _linearized(
        self, run: ForwardRun, previous: Linearization | None, begin: int, continuous: bool = False
    ) -> Linearization:
        return linearize(
            self.model.system, run.trajectory, run.joint_angles, run.joint_rates, self._workspace, previous,
            continuous=continuous, begin=begin,
        )  # fmt: skip

    def tangent(self, values: Array, rates: Array, efforts: bool, d_load: Array | None = None) -> tuple[Array, Array]:
        """Change of the components' coordinates, shape [T, B, N], and where wanted of the motors' efforts, [T, M], with
        the motors' values and rates, shape [T, M].

        Args:
            d_load: Filled with the change of the joints' multipliers, shape [T, J, 6], of a shot that plays once.
        """
        assert self._linearization is not None
        given = *followed(self.model, values, rates, self.h, self._steady is not None), efforts
        if self._monodromy is None:
            motion, effort = tangent(self._linearization, *given, d_load)
        else:
            motion, effort = periodic_tangent(self._linearization, self._monodromy, *given)
        return motion, self.model.motor_values(effort)

    def adjoint(self, gradient: Array, effort: Array | None, load: Array | None = None) -> tuple[Array, Array]:
        """The transpose of `tangent`: derivatives by the motors' values and rates, shape [T, M] each."""
        assert self._linearization is not None
        given = gradient, None if effort is None else self.model.joint_angles(effort)
        if self._monodromy is None:
            found = adjoint(self._linearization, *given, load)
        else:
            found = periodic_adjoint(self._linearization, self._monodromy, *given)
        return self._on_curves(*found)

    def can_be_blocked(self) -> bool:
        """Whether it is linearised so that `responses` works."""
        return self._linearization is not None and self._monodromy is None and can_be_blocked(self._linearization)

    def responses(
        self, values: Array, rates: Array, begin: int, coupling: Array, component: IntArray, jacobian: Array
    ) -> tuple[int, Array]:
        """Changes of quantities by many curves at once.

        Args:
            values, rates: Curves over n instants, before which they are zero, shape [n, F].
            begin: The first of these instants; from 1 on the curves are still zero there.
            coupling: Of each motor with each of m unknowns, shape [M, m]: each curve is tried with each of these.
            component, jacobian: The quantities, as of `block_tangent`.

        Returns:
            The first instant at which anything changes, and the changes from there to the last of these instants, shape
            [begin + n - first, r, F m].
        """
        assert self._linearization is not None
        columns = [self._joint_columns(*curve, coupling) for curve in zip(values.T, rates.T, strict=True)]
        angles, speeds = (np.concatenate([column[k] for column in columns], axis=2) for k in (0, 1))
        acts = np.any(angles, axis=(1, 2)) | np.any(speeds, axis=(1, 2))
        first = max(self._linearization.windows()[0][0], begin + int(np.argmax(acts)))
        given = angles[first - begin :], speeds[first - begin :]
        return first, block_tangent(self._linearization, first, *given, component, jacobian)

    def _joint_columns(self, values: Array, rates: Array, coupling: Array) -> tuple[Array, Array]:
        """What the joints follow by one curve of shape [n] with each unknown, shape [n, J, m]."""
        motors = np.ones((1, len(coupling)))
        late = CommandDelay(self.model.delays, self.h, False).apply(values[:, None] * motors, rates[:, None] * motors)
        angles, speeds = (self.model.joint_angles(part[:, None] * coupling.T) for part in late)
        return angles.transpose(0, 2, 1), speeds.transpose(0, 2, 1)

    def continuous_adjoint(self, run: ForwardRun, gradient: Array) -> tuple[Array, Array]:
        """The same by the continuous adjoint, with a linearisation of its own, of a shot that plays once."""
        self._for_continuous = self._linearized(run, self._for_continuous, 0, continuous=True)
        return self._on_curves(*continuous_adjoint(self._for_continuous, gradient))

    def _on_curves(self, by_angle: Array, by_rate: Array) -> tuple[Array, Array]:
        """Derivatives by the motors' curves, shape [T, M], from those by what the joints follow, [T, J]."""
        by_value, by_change = self.model.motor_values(by_angle), self.model.motor_values(by_rate)
        delay = CommandDelay(self.model.delays, self.h, self._steady is not None)
        return delay.transposed(by_value, by_change)
