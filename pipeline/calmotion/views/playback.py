"""Playback of a computed motion: at any times, and as points of the moving surfaces."""

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.model.character import Body
from calmotion.model.result import Motion, Skin
from calmotion.support.rotations import rotation_from_quaternion


def sample_motion(motion: Motion, times: Array) -> Motion:
    """The motion at other times: linear between steps, constant before the first and after the last.

    The steps of a simulation are much shorter than the frames of a shot, so linear interpolation is smooth enough.

    Args:
        motion: T steps.
        times: [s] after the first frame of the shot, shape [f].

    Returns:
        The same motion with f rows; rotations are unit quaternions.
    """
    times = np.asarray(times, dtype=float)
    if len(motion.times) == 1:
        low, high, weight = np.zeros(len(times), int), np.zeros(len(times), int), np.zeros(len(times))
    else:
        low = np.clip(np.searchsorted(motion.times, times, side="right") - 1, 0, len(motion.times) - 2)
        high = low + 1
        weight = np.clip((times - motion.times[low]) / (motion.times[high] - motion.times[low]), 0.0, 1.0)

    def blend(values: Array) -> Array:
        share = weight.reshape(-1, *([1] * (values.ndim - 1)))
        return (1.0 - share) * values[low] + share * values[high]

    def blend_rotations(values: Array) -> Array:
        first, second = values[low], values[high]
        # q and -q are the same rotation: use the nearer of the two.
        second = np.where(np.sum(first * second, axis=-1, keepdims=True) < 0.0, -second, second)
        share = weight.reshape(-1, *([1] * (values.ndim - 1)))
        mixed = (1.0 - share) * first + share * second
        return np.asarray(mixed / np.linalg.norm(mixed, axis=-1, keepdims=True))

    return Motion(
        times=times,
        positions=blend(motion.positions),
        rotations=blend_rotations(motion.rotations),
        elastic=tuple(blend(u) for u in motion.elastic),
        motor_values=blend(motion.motor_values),
        motor_efforts=blend(motion.motor_efforts),
        target_positions=blend(motion.target_positions),
        target_rotations=blend_rotations(motion.target_rotations),
        joint_forces=None if motion.joint_forces is None else blend(motion.joint_forces),
        joint_moments=None if motion.joint_moments is None else blend(motion.joint_moments),
    )


def deformed_points(points: Array, modes: Array | None, elastic: Array) -> Array:
    """Points of a surface in body axes for each row of elastic coordinates.

    Args:
        points: Undeformed [m], shape [n, 3].
        modes: Displacement of the points [m per unit], shape [n, 3, r], or None for a rigid body.
        elastic: Elastic coordinates, shape [f, r]; r = 0 for a motion in which the body does not deform.

    Returns:
        [m], shape [f, n, 3]; [1, n, 3] where the body is rigid.
    """
    if modes is None or elastic.shape[1] == 0:
        return points[None]
    return np.asarray(points[None] + np.einsum("nik,fk->fni", modes, elastic))


def modes_of(skin: Skin | None, surface: int) -> Array | None:
    """Modes of one surface of a body, or None where it does not deform."""
    if skin is None or surface >= len(skin.modes) or skin.modes[surface].shape[2] == 0:
        return None
    return skin.modes[surface]


def carriers(bodies: Sequence[Body]) -> list[int]:
    """For each body the index of the body whose prim is its nearest ancestor, -1 for none."""
    index = {body.path: k for k, body in enumerate(bodies)}
    indices = []
    for body in bodies:
        path = body.path
        while path and path not in index or path == body.path:
            path = path.rpartition("/")[0]
        indices.append(index.get(path, -1))
    return indices


def relative_poses(motion: Motion, body: int, carrier: int) -> tuple[Array, Array]:
    """Pose of a body in another's frame, or in the world for -1.

    Returns:
        Positions [m], shape [f, 3], and unit quaternions (w, x, y, z), shape [f, 4].
    """
    positions, rotations = motion.positions[:, body], motion.rotations[:, body]
    if carrier < 0:
        return positions, rotations
    matrices = rotation_from_quaternion(motion.rotations[:, carrier])
    offset = positions - motion.positions[:, carrier]
    w, v = motion.rotations[:, carrier, :1], -motion.rotations[:, carrier, 1:]
    real = w * rotations[:, :1] - np.sum(v * rotations[:, 1:], axis=1, keepdims=True)
    imaginary = w * rotations[:, 1:] + rotations[:, :1] * v + np.cross(v, rotations[:, 1:])
    return np.einsum("fji,fj->fi", matrices, offset), np.concatenate([real, imaginary], axis=1)


def deviations(surface: Array, modes: Array | None, body: int, motion: Motion, reference: Motion) -> Array:
    """Distance of each point of a surface from its place in the reference motion.

    Args:
        surface: Undeformed points, body axes [m], shape [n, 3].
        modes: Displacement of the points [m per unit], shape [n, 3, r], or None for a rigid body.
        body: Index of the body.
        motion: f rows.
        reference: f rows at the same times.

    Returns:
        Distances [m], shape [f, n].
    """
    world = []
    for moved in (motion, reference):
        points = deformed_points(surface, modes, moved.elastic[body])
        rotated = np.einsum("fij,fnj->fni", rotation_from_quaternion(moved.rotations[:, body]), points)
        world.append(rotated + moved.positions[:, body, None])
    return np.asarray(np.linalg.norm(world[0] - world[1], axis=2))


def world_points(body: Body, index: int, skin: Skin | None, motion: Motion, row: int) -> list[Array]:
    """World positions of the points of each surface of a body at one row of a motion.

    Args:
        index: Its index in the character.
        skin: Its skin, or None.
        row: Row of the motion.

    Returns:
        For each surface [m], shape [n_s, 3].
    """
    matrix = rotation_from_quaternion(motion.rotations[row, index])
    elastic = motion.elastic[index][row : row + 1]
    return [
        deformed_points(surface.points, modes_of(skin, s), elastic)[0] @ matrix.T + motion.positions[row, index]
        for s, surface in enumerate(body.surfaces)
    ]
