"""How well the robot that was written does what the parts, or the joints of the skeleton, do."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array
from calmotion.model import Animation, Character, Track
from calmotion.model.character import Frame
from calmotion.support.rotations import rotation_from_quaternion

Motion = tuple[Array, Array]  # rotations [n, 3, 3] and origins [n, 3] [m]


def largest_distance(
    character: Character, animation: Animation, times: Array, given: Mapping[str, Motion],
    marks: Sequence[tuple[str, Array]] = (),
) -> float:  # fmt: skip
    """The largest distance of points from where joints and tracks of the robot have them [m].

    Args:
        character, animation: As read from the written layer; tracks have a sample at each time.
        times: [s], shape [n].
        given: Motions of bodies as animated, by path; the origins are such points.
        marks: More of them: the body that has each, by what it does at the first time, and its positions [m], shape
            [n, 3].
    """
    numbers = {body.path: k for k, body in enumerate(character.bodies)}
    tracks = {motor.joint: track for motor, track in zip(character.motors, animation.tracks, strict=True)}
    carried = {frame.joint for frame in animation.moving}
    motions: dict[int, Motion] = {-1: (np.eye(3)[None], np.zeros((1, 3)))}
    known = {numbers[path]: motion for path, motion in given.items() if path in numbers}
    for index, joint in enumerate(character.joints):
        if index in carried:
            motions[joint.body1] = known[joint.body1]  # by its transform
            continue
        inwards = joint.body0 not in motions
        near, other = (joint.body1, joint.body0) if inwards else (joint.body0, joint.body1)
        frames = (joint.frame1, joint.frame0) if inwards else (joint.frame0, joint.frame1)
        values = _values(tracks.get(index), times) * (-1.0 if inwards else 1.0)
        motions[other] = _beyond(motions[near], *frames, joint.kind, values)
    points = [(k, p, np.zeros(3)) for k, (_, p) in known.items()]
    for path, positions in marks:
        if path in numbers:
            R, p = known[numbers[path]]
            points.append((numbers[path], positions, R[0].T @ (positions[0] - p[0])))
    return max(float(np.linalg.norm(motions[k][0] @ local + motions[k][1] - p, axis=1).max()) for k, p, local in points)


def _values(track: Track | None, times: Array) -> Array:
    return np.zeros(len(times)) if track is None else np.interp(times, track.times, track.values)


def _beyond(motion: Motion, near: Frame, far: Frame, kind: str, values: Array) -> Motion:
    """Motion of the body behind a joint, from that of the body before it and the frames of the joint on both."""
    R, p = motion
    p = p + R @ near.position
    R = R @ rotation_from_quaternion(near.rotation)
    if kind == "prismatic":
        p = p + values[:, None] * R[:, :, 2]
    elif kind == "revolute":
        R = R @ Rotation.from_rotvec(values[:, None] * np.array([0.0, 0.0, 1.0])).as_matrix()
    R = R @ rotation_from_quaternion(far.rotation).T
    return R, p - R @ far.position
