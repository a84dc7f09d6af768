"""Rigid kinematics: poses and target motions of the undeformed character from joint angles."""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.kernels.components import ComponentMarker
from calmotion.multibody.kernels.markers import MarkerWork, allocate_marker, marker_jacobian, marker_values
from calmotion.multibody.kernels.so3 import matrix_of, quaternion_of
from calmotion.multibody.model.model import Model
from calmotion.multibody.model.moving_markers import rooted
from calmotion.multibody.model.system import State, System, allocate_state
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import allocating_kernel, kernel


@allocating_kernel
def _rigid_poses(system: System, values: Array, world: Array, c: Array, q: Array, R: Array) -> None:
    """Poses of all components for joint angles and lengths, shape [T, B]; R is scratch, shape [B, 3, 3]."""
    A, near, x = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)
    for n in range(values.shape[0]):
        for b in range(len(system.parent)):
            p = system.parent[b]
            moving = system.moving[b]
            length = values[n, b] if system.sliding[b] else 0.0
            angle = 0.0 if system.sliding[b] else values[n, b]
            cs, sn = np.cos(angle), np.sin(angle)
            far = system.rotation[b, 1]
            for i in range(3):
                x[i] = world[n, moving, i] if moving >= 0 else system.position[b, 0, i]
                for k in range(3):
                    near[i, k] = world[n, moving, 9 + 3 * i + k] if moving >= 0 else system.rotation[b, 0, i, k]
            # R_b = R_p R_i R_z(angle) R_j^T
            for i in range(3):
                x[i] += near[i, 2] * length
                y0 = near[i, 0] * cs + near[i, 1] * sn
                y1 = near[i, 1] * cs - near[i, 0] * sn
                for k in range(3):
                    A[i, k] = y0 * far[k, 0] + y1 * far[k, 1] + near[i, 2] * far[k, 2]
            for i in range(3):
                t = x[i]
                if p >= 0:
                    t = c[n, p, i] + R[p, i, 0] * x[0] + R[p, i, 1] * x[1] + R[p, i, 2] * x[2]
                for k in range(3):
                    if p >= 0:
                        R[b, i, k] = R[p, i, 0] * A[0, k] + R[p, i, 1] * A[1, k] + R[p, i, 2] * A[2, k]
                    else:
                        R[b, i, k] = A[i, k]
                for k in range(3):
                    t -= R[b, i, k] * system.position[b, 1, k]
                c[n, b, i] = t
            quaternion_of(R[b], q[n, b])


def system_poses(system: System, joint_angles: Array, world: Array | None = None) -> tuple[Array, Array]:
    """`rigid_poses` of a system alone."""
    total, count = len(joint_angles), len(system.parent)
    c, q = np.zeros((total, count, 3)), np.zeros((total, count, 4))
    _rigid_poses(system, joint_angles, rooted(world, total), c, q, np.zeros((count, 3, 3)))
    return c, q


def rigid_poses(model: Model, joint_angles: Array, world: Array | None = None) -> tuple[Array, Array]:
    """Poses of the undeformed character.

    Args:
        joint_angles: Of `Model.joint_angles`, free joints included, or those of the components' joints alone, shape
            [T, B].
        world: Moving markers of the world, shape [T, W, 18]; needed where the system has any.

    Returns:
        Origins [m], shape [T, B, 3], and unit quaternions, shape [T, B, 4], world.
    """
    return system_poses(model.system, model.turned(joint_angles), world)


def rigid_state(model: Model, joint_angles: Array, world: Array | None = None) -> State:
    """A state at rest in the rigid pose of joint angles (or lengths) of shape [B] or [J]; `world` of shape [W, 18]."""
    state = allocate_state(model.system)
    c, q = rigid_poses(model, joint_angles[None], None if world is None else world[None])
    state.c[:], state.q[:] = c[0], q[0]
    set_rotors(model.system, state, joint_angles)
    return state


def set_rotors(system: System, state: State, joint_angles: Array) -> None:
    """Turn the rotors of servos to what they follow, shape [B] or [J]."""
    for joint in system.servos[system.servos < len(joint_angles)]:
        state.u[system.side[joint, 1], system.rotor[joint]] = joint_angles[joint]


@by_reference
class TargetWork(NamedTuple):
    """The target markers as the kernels take them, and scratch: a marker, a rotation matrix, velocities of zero."""

    component: IntArray
    position: Array
    rotation: Array
    Phi: Array
    Psi: Array
    marker: MarkerWork
    R: Array
    V: Array


def _target_work(model: Model) -> TargetWork:
    t, size = model.targets, model.system.size
    marker = allocate_marker(size)
    return TargetWork(t.component, t.position, t.rotation, t.Phi, t.Psi, marker, np.zeros((3, 3)), np.zeros(size))


@kernel
def _target_marker(system: System, targets: TargetWork, k: int) -> ComponentMarker:
    b = targets.component[k]
    return ComponentMarker(
        system.elastic[b], system.law[b], targets.position[k], targets.rotation[k], targets.Phi[k], targets.Psi[k]
    )


@kernel
def _target_frames(
    system: System, targets: TargetWork, c: Array, q: Array, u: Array, positions: Array, quaternions: Array
) -> None:
    m, R = targets.marker, targets.R
    for n in range(c.shape[0]):
        for k in range(len(targets.component)):
            b = targets.component[k]
            matrix_of(q[n, b], R)
            marker_values(_target_marker(system, targets, k), c[n, b], R, u[n, b], targets.V, m)
            for i in range(3):
                positions[n, k, i] = m.p[i]
            quaternion_of(m.R, quaternions[n, k])


def target_frames(model: Model, c: Array, q: Array, u: Array) -> tuple[Array, Array]:
    """Motion of the targets: positions [m], shape [T, K, 3], and quaternions, shape [T, K, 4], world."""
    count = len(model.targets.component)
    positions, quaternions = np.zeros((len(c), count, 3)), np.zeros((len(c), count, 4))
    _target_frames(model.system, _target_work(model), c, q, u, positions, quaternions)
    return positions, quaternions


@kernel
def _target_jacobians(system: System, targets: TargetWork, c: Array, q: Array, u: Array, J: Array) -> None:
    m, R = targets.marker, targets.R
    for n in range(c.shape[0]):
        for k in range(len(targets.component)):
            b = targets.component[k]
            marker = _target_marker(system, targets, k)
            matrix_of(q[n, b], R)
            marker_values(marker, c[n, b], R, u[n, b], targets.V, m)
            marker_jacobian(marker, m)
            for a in range(6 + marker.r):
                for i in range(3):
                    J[n, k, i, a] = R[i, 0] * m.Jp[0, a] + R[i, 1] * m.Jp[1, a] + R[i, 2] * m.Jp[2, a]
                    J[n, k, 3 + i, a] = m.Jf[i, a]


def target_jacobians(model: Model, c: Array, q: Array, u: Array) -> Array:
    """Derivative of the targets' frames by their component's coordinates (R^T dc, dphi, du), shape [T, K, 6, N]:
    rows 0-2 the position in world axes, rows 3-5 the rotation in target axes."""
    J = np.zeros((len(c), len(model.targets.component), 6, model.system.size))
    _target_jacobians(model.system, _target_work(model), c, q, u, J)
    return J


def of_targets(model: Model, J: Array, motion: Array) -> Array:
    """J times a change of the components' coordinates of shape [T, B, N], shape [T, K, 6].

    Args:
        J: By the coordinates of each target's component, such as `target_jacobians`, shape [T, K, 6, N].
    """
    return np.asarray(np.einsum("nkia,nka->nki", J, motion[:, model.targets.component]))


def of_components(model: Model, J: Array, by_target: Array) -> Array:
    """The transpose of `of_targets`: J^T times quantities of shape [T, K, 6], gathered by component, [T, B, N]."""
    out = np.zeros((len(J), len(model.system.parent), J.shape[3]))
    gathered = np.einsum("nkia,nki->nka", J, by_target)
    for k, component in enumerate(model.targets.component):
        out[:, component] += gathered[:, k]
    return out
