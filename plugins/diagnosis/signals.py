"""Joints, sensors and drives, and signals between their samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from calmotion.arrays import Array
from calmotion.recordings import ACCELEROMETER, ANGLE

HEALTHY = 0.7  # ratio of critical damping of a loop that does not ring
STRIBECK = 0.05  # speed over which the excess of friction at rest is gone [rad/s or m/s]


@dataclass(frozen=True, eq=False)
class Joint:
    """A motor's joint along the motion.

    Attributes:
        path: Of the joint.
        inertia: That its motor turns, its own included [kg m^2 or kg], shape [T]; 1 without a model.
        load: Torque without that of the inertia [N m or N], shape [T].
        torque: All of it, which its gear transmits, shape [T].
        slope: Change of the load with its value, shape [T].
        gain, damping: Of its loop [N m/rad], [N m s/rad]; a gain of 0: not known.
        share: Of the command's rate that the damping multiplies.
        delay: After which the command acts, as the shot has it [s].
        guessed: Whether the gain is that which the recording shows.
    """

    path: str
    inertia: Array
    load: Array
    torque: Array
    slope: Array
    gain: float = 0.0
    damping: float = 0.0
    share: float = 0.0
    delay: float = 0.0
    guessed: bool = False

    @cached_property
    def middle(self) -> float:
        """Median of its inertia."""
        return float(np.median(self.inertia))

    def critical(self, gain: float) -> float:
        """The critical damping of a loop of this gain."""
        return 2.0 * float(np.sqrt(gain * self.middle))


@dataclass(frozen=True, eq=False)
class Sensor:
    """A channel on the robot's clock, with samples that are all there.

    Attributes:
        kind, path: As of `Channel`.
        index: Of the motor or the target; -1 where the robot does not have it.
        times: [s], shape [n].
        values: Shape [n, c].
        noise: Standard deviation [unit].
        unit: Of its values.
        components: Which of x, y and z the columns of the values are, of markers and accelerometers.
    """

    kind: str
    path: str
    index: int
    times: Array
    values: Array
    noise: float
    unit: str
    components: tuple[int, ...] = (0, 1, 2)

    @property
    def name(self) -> str:
        """Kind and path."""
        return f"{self.kind} {self.path}"

    @property
    def error_unit(self) -> str:
        """Unit of its errors: accelerations are integrated."""
        return "m/s" if self.kind == ACCELEROMETER else self.unit


@dataclass(frozen=True, eq=False)
class Drive:
    """How the joints are driven: a value for each motor, shape [M]; an infinite gain: the joint follows exactly."""

    gain: Array
    damping: Array
    share: Array
    friction: Array
    excess: Array
    delay: Array

    def with_joint(self, m: int, values: Mapping[str, float]) -> Drive:
        """With other values of one motor."""
        changed = {}
        for name, value in values.items():
            column = getattr(self, name).copy()
            column[m] = value
            changed[name] = column
        return replace(self, **changed)


def on_grid(times: Array, coarse: Array, values: Array) -> Array:
    """Values of shape [n, ...] at coarse times, linearly interpolated, shape [T, ...]."""
    return at_places(np.interp(times, coarse, np.arange(len(coarse))), values)


def at_places(place: Array, values: Array) -> Array:
    """Values of shape [n, ...] at places between them, such as 1.5, linearly interpolated, shape [T, ...]."""
    if len(values) == 1:
        return np.repeat(values, len(place), axis=0)
    place = np.clip(place, 0.0, len(values) - 1.0)
    first = np.minimum(place.astype(int), len(values) - 2)
    share = (place - first).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1.0 - share) * values[first] + share * values[first + 1])


def noise_of(kind: str, values: Array) -> float:
    """Standard deviation of a sensor's noise from its samples, shape [n, c]: of its steps, or of what is rough."""
    rough = np.diff(values, 3, axis=0) / np.sqrt(20.0)
    estimate = 1.4826 * float(np.median(np.abs(rough))) if len(rough) else 0.0
    levels = np.unique(np.round(values[:, 0], 12))
    if kind != ANGLE or len(levels) < 3:
        return estimate
    step = float(np.diff(levels).min())
    # a coarse encoder that hardly moves repeats its levels, which differences would take for no noise
    repeats = len(levels) < 0.5 * len(values) or step > 1e-5
    return max(estimate, step / np.sqrt(12.0)) if repeats and step < 0.02 else estimate
