"""Load envelopes: the largest loads on a body over a shot, from a simulation of the rigid robot."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array


@dataclass(frozen=True, eq=False)
class LoadEnvelope:
    """Largest absolute values of the loads on a body over a shot, body axes, from a simulation of the rigid robot.

    Attributes:
        acceleration: Of the origin of the body frame, minus gravity [m/s^2], shape [3]; gravity alone at rest.
        angular_acceleration: [rad/s^2], shape [3].
        angular_velocity: [rad/s], shape [3].
        force: On each interface, by the next body [N], shape [j, 3]; after `patch_load_envelope` one row for each
            moving patch.
        moment: Likewise, about the attachment frame [N m], shape [j, 3].
        frequency: Highest frequency with noticeable power in the motion [Hz]; 0 when it is not known.
        target_distance: Largest distance from each interface to a target beyond it [m], shape [j]; None: rotations of
            the interfaces do not matter.
        closed_chain: Whether the body is part of a closed chain. The other bodies of the chain may constrain any motion
            of its interfaces. The simulation of the rigid robot does not give these loads, so the body needs a
            coordinate for each motion of its interfaces.
        directed: Whether the directions are those of loads on the flexible robot. A rigid robot that swings in a plane
            does not twist its links. A flexible one may, because deflections move the loads out of the plane.
    """

    acceleration: Array
    angular_acceleration: Array
    angular_velocity: Array
    force: Array
    moment: Array
    frequency: float = 0.0
    target_distance: Array | None = None
    closed_chain: bool = False
    directed: bool = False

    @property
    def lever_arm(self) -> Array:
        """Displacement of the farthest target by a unit rotation of each interface [m], shape [j]; zero where rotations
        do not matter."""
        return np.zeros(len(self.force)) if self.target_distance is None else self.target_distance


def load_direction_envelope(load_envelope: LoadEnvelope, angle: float, size: float) -> LoadEnvelope:
    """The envelope over all directions that the loads may take when deflections rotate the robot by up to an angle.

    Args:
        angle: Largest rotation about any axis [rad].
        size: Of the body, the lever arm of forces [m].
    """
    share = min(angle, 1.0)

    def in_all_directions(load: Array) -> Array:
        return np.asarray(np.maximum(np.abs(load), share * np.linalg.norm(load, axis=-1, keepdims=True)))

    moment_of_force = share * size * np.linalg.norm(load_envelope.force, axis=-1, keepdims=True)
    return replace(
        load_envelope,
        acceleration=in_all_directions(load_envelope.acceleration),
        angular_acceleration=in_all_directions(load_envelope.angular_acceleration),
        angular_velocity=in_all_directions(load_envelope.angular_velocity),
        force=in_all_directions(load_envelope.force),
        moment=np.maximum(in_all_directions(load_envelope.moment), moment_of_force),
    )


def directed_load_envelope(rigid: LoadEnvelope, flexible: LoadEnvelope, overshoot: float) -> LoadEnvelope:
    """The envelope of a rigid robot's loads with the directions of those on the flexible one.

    Args:
        overshoot: Loads on the flexible robot over those on the rigid one; who uses an envelope multiplies it by this.
    """

    def largest(by_rigid: Array, by_flexible: Array) -> Array:
        return np.asarray(np.maximum(by_rigid, by_flexible / overshoot))

    return replace(
        rigid,
        acceleration=largest(rigid.acceleration, flexible.acceleration),
        angular_acceleration=largest(rigid.angular_acceleration, flexible.angular_acceleration),
        angular_velocity=largest(rigid.angular_velocity, flexible.angular_velocity),
        force=largest(rigid.force, flexible.force),
        moment=largest(rigid.moment, flexible.moment),
        directed=True,
    )


def patch_load_envelope(
    load_envelope: LoadEnvelope, attachments: Sequence[Sequence[int]], positions: Array, centers: Sequence[Array]
) -> LoadEnvelope:
    """The load envelope with one row for each moving patch instead of one for each interface.

    Args:
        load_envelope: Of a body with j interfaces.
        attachments: For each of the p patches the indices of its interfaces.
        positions: Origins of the attachment frames, body frame [m], shape [j, 3] (more rows are ignored).
        centers: Point of each patch that its wrench is about [m], shape [3].

    Returns:
        Sums of the forces, as if all peaks coincided, and of the moments about the center of the patch.
    """
    count = len(attachments)
    force, moment, target_distance = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
    for k, (group, center) in enumerate(zip(attachments, centers, strict=True)):
        for i in group:
            arm, f = np.abs(positions[i] - center), load_envelope.force[i]
            moment_of_force = np.roll(arm, -1) * np.roll(f, -2) + np.roll(arm, -2) * np.roll(f, -1)
            force[k] += f
            moment[k] += load_envelope.moment[i] + moment_of_force
            target_distance[k] = max(target_distance[k], float(load_envelope.lever_arm[i]))
    return replace(load_envelope, force=force, moment=moment, target_distance=target_distance)
