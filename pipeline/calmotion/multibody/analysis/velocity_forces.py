"""Centrifugal and Coriolis forces, and Coulomb friction, of a robot that follows its inputs without vibration."""

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.analysis.kinematics import rigid_poses, set_rotors
from calmotion.multibody.integrators.coefficients import IMPLICIT
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.kernels.so3 import turns_between
from calmotion.multibody.model.model import Model, moves_freely
from calmotion.multibody.model.system import BACK_EMF, VELOCITY_GAIN, State, allocate_state


class VelocityForces:
    """What a robot needs besides the terms that are linear in its inputs' rates and accelerations (`PoseModel`).

    Bodies move rigidly, as a tree whose joints are all driven; with free joints or closed chains the forces are
    taken as zero, and `known` is False.

    Args:
        world: Moving roots where they stand, shape [W, 18].
    """

    DISTANCE_S = 1e-3  # of the poses from whose differences velocities follow

    def __init__(self, model: Model, world: Array | None = None):
        system, self._model = model.system, model
        self.known = len(system.rows) == len(system.parent) and not np.any(moves_freely(model))
        servo = system.servo.copy()
        servo[:, [VELOCITY_GAIN, BACK_EMF]] = 0.0
        self._system = system._replace(damping=np.zeros_like(system.damping), servo=servo)
        self._workspace, self._world = Workspace.for_system(system), world
        if world is not None:
            self._workspace.work.world[:] = world
        self._sizes = 6 + system.elastic

    def at(self, values: Array, rates: Array) -> Array:
        """The forces, shape [N], in the coordinates of `PoseModel`.

        Args:
            values, rates: Of the motors' inputs [rad or m], shape [M] each.
        """
        moving, rest = self.both(values, rates)
        return moving - rest

    def with_weight(self, values: Array, rates: Array) -> Array:
        """The forces of `at` and, against it, the weight of the undeformed robot, shape [N]."""
        return self.both(values, rates)[0]

    def both(self, values: Array, rates: Array) -> tuple[Array, Array]:
        """`with_weight` of the moving robot, and at rest: their difference is `at`."""
        if not self.known:
            return (np.zeros(int(self._sizes.sum())),) * 2
        model, h = self._model, self.DISTANCE_S
        joints = model.joint_angles(values + h * np.array([-1.0, 0.0, 1.0])[:, None] * rates)
        world = None if self._world is None else np.repeat(self._world[None], 3, axis=0)
        c, q = rigid_poses(model, joints, world)
        state, speeds = allocate_state(model.system), model.joint_angles(rates)
        state.c[:], state.q[:] = c[1], q[1]
        set_rotors(model.system, state, joints[1])
        rest = self._residual(state, np.zeros_like(state.V), joints[1], np.zeros_like(speeds))
        back, ahead = np.zeros((2, len(c[1]), 3))
        turns_between(q[1], q[0], back)
        turns_between(q[1], q[2], ahead)
        accelerations = np.zeros_like(state.V)
        state.V[:, :3], state.V[:, 3:6] = (c[2] - c[0]) / (2.0 * h), (ahead - back) / (2.0 * h)
        accelerations[:, :3], accelerations[:, 3:6] = (c[2] - 2.0 * c[1] + c[0]) / h**2, (ahead + back) / h**2
        for joint in model.system.servos:
            state.V[model.system.side[joint, 1], 6 + model.system.rotor[joint]] = speeds[joint]
        return self._residual(state, accelerations, joints[1], speeds), rest

    def _residual(self, state: State, accelerations: Array, angles: Array, rates: Array) -> Array:
        ws, moving = self._workspace, IMPLICIT["bdf2"](1.0)
        ws.scratch.Hv[:] = 0.0
        assemble(self._system, moving, state, accelerations, angles, rates, ws.scratch.Hv, False, ws.work, ws.blocks)
        residual = zip(np.array(ws.blocks.res), self._sizes, strict=True)
        return np.concatenate([part[:size] for part, size in residual])
