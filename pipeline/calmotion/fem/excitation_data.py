"""What shakes a body in a shot, as far as a rigid robot tells."""

from __future__ import annotations

from dataclasses import dataclass

from ..shot.character import Array


@dataclass(frozen=True, eq=False)
class Excitation:
    """Largest loads on a body over a shot, taken from a rigid simulation; absolute values, body axes.

    Attributes:
        acceleration: Of the frame's origin, less gravity [m/s^2], shape [3].
        angular_acceleration: [rad/s^2], shape [3].
        angular_velocity: [rad/s], shape [3].
        force: On each moving interface, in the order of the anchors that name them [N], shape [p, 3].
        moment: About its anchor [N m], shape [p, 3].
        frequency: Highest frequency at which the motion pushes noticeably [Hz].
    """

    acceleration: Array
    angular_acceleration: Array
    angular_velocity: Array
    force: Array
    moment: Array
    frequency: float = 0.0
