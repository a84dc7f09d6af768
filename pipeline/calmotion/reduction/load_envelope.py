"""What shakes a body in a shot, as far as a rigid robot tells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.shot.character import Array


@dataclass(frozen=True, eq=False)
class LoadEnvelope:
    """Largest loads on a body over a shot, taken from a rigid simulation; absolute values, body axes.

    Attributes:
        acceleration: Of the frame's origin, less gravity [m/s^2], shape [3]; a body at rest has its weight here.
        angular_acceleration: [rad/s^2], shape [3].
        angular_velocity: [rad/s], shape [3].
        force: On each interface, by the body beyond it [N], shape [j, 3]; `patch_load_envelope` makes it one row for
            each moving patch.
        moment: Likewise, about the interface's anchor [N m], shape [j, 3].
        frequency: Highest frequency at which the motion pushes noticeably [Hz]; 0 when it is not known.
        reach: Longest distance from each interface to a target beyond it [m], shape [j]: a small turn of the
            interface moves that target by the angle times this. None: turns do not matter.
        closed: Whether the body is part of a closed loop. Its other members may then hold its interfaces against any
            motion, so that it must be able to give way in all of them: a rigid robot does not tell these loads.
    """

    acceleration: Array
    angular_acceleration: Array
    angular_velocity: Array
    force: Array
    moment: Array
    frequency: float = 0.0
    reach: Array | None = None
    closed: bool = False

    @property
    def lever(self) -> Array:
        """`reach`, zero where turns do not matter."""
        return np.zeros(len(self.force)) if self.reach is None else self.reach


def load_direction_envelope(load_envelope: LoadEnvelope, angle: float, size: float) -> LoadEnvelope:
    """The loads on a body that deflection has rotated by an angle about any axis.

    A rigid robot that swings in a plane never twists a link; one that bends does, as the load beyond it moves aside.

    Args:
        angle: [rad].
        size: Of the body, for the moments of forces [m].
    """
    share = min(angle, 1.0)

    def every_way(load: Array) -> Array:
        return np.maximum(np.abs(load), share * np.linalg.norm(load, axis=-1, keepdims=True))

    lever = share * size * np.linalg.norm(load_envelope.force, axis=-1, keepdims=True)
    return replace(
        load_envelope,
        acceleration=every_way(load_envelope.acceleration),
        angular_acceleration=every_way(load_envelope.angular_acceleration),
        angular_velocity=every_way(load_envelope.angular_velocity),
        force=every_way(load_envelope.force),
        moment=np.maximum(every_way(load_envelope.moment), lever),
    )


def patch_load_envelope(
    load_envelope: LoadEnvelope, anchors: Sequence[Sequence[int]], positions: Array, centers: Sequence[Array]
) -> LoadEnvelope:
    """The load_envelope with one row for each moving patch instead of one for each interface.

    Args:
        load_envelope: Of a body with j interfaces.
        anchors: For each of the p patches the interfaces that it carries.
        positions: Anchors of the interfaces, body frame [m], shape [j, 3] (more rows are ignored).
        centers: Point of each patch that its wrench is about [m], shape [3].

    Returns:
        Forces add, as if all peaks met; so do moments, with those of the forces about the patch's center.
    """
    count = len(anchors)
    force, moment, reach = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
    for k, (group, center) in enumerate(zip(anchors, centers, strict=True)):
        for i in group:
            arm, f = np.abs(positions[i] - center), load_envelope.force[i]
            lever = np.roll(arm, -1) * np.roll(f, -2) + np.roll(arm, -2) * np.roll(f, -1)
            force[k] += f
            moment[k] += load_envelope.moment[i] + lever
            reach[k] = max(reach[k], float(load_envelope.lever[i]))
    return replace(load_envelope, force=force, moment=moment, reach=reach)
