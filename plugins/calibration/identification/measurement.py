"""Sensors of a robot and their clocks: what they measured against what a simulated robot would have shown them.

The clock of a recording reads s at the first frame of the shot, and a share d slower: t_robot = (t - s) (1 + d). An
accelerometer has a constant bias in its axes; a marker sits a little off its prim, by a distance that is constant in
the prim's axes; a strain gauge has a gain and an offset. A robot that moves already when a shot begins swings freely in
its lowest natural modes beside what the shot makes it do, by amounts of each sensor. A low-pass may have another corner
and damping than is told. These are parameters like those of the robot; derivatives are exact, and central differences
for filters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.recordings import ACCELEROMETER, MARKER, STRAIN, Channel, LowPass

from ..model import kinds
from .parameters import Parameter
from .recordings.sensors import Sensor, decay_paths, own_path
from .signals import Signals

Motions = Sequence[Signals]  # of each shot
SIDE = 1e-3  # standard deviations of a prior by which the parameters of a filter are moved, for derivatives


@dataclass(frozen=True, eq=False)
class Measurement:
    """Sensors and the parameters of their measurement.

    Attributes:
        recordings: Files of the recordings.
        sensors: The sensors.
        parameters: Of `measurement_parameters`.
    """

    recordings: tuple[str, ...]
    sensors: tuple[Sensor, ...]
    parameters: tuple[Parameter, ...]

    def _value(self, x: Array, kind: str, path: str, axis: int = -1) -> float:
        for p, v in zip(self.parameters, x, strict=True):
            if (p.kind, p.path, p.axis) == (kind, path, axis):
                return p.value(float(v))
        return 0.0

    def _vector(self, x: Array, kind: str, path: str) -> Array:
        return np.array([self._value(x, kind, path, axis) for axis in range(3)])

    def robot_times(self, sensor: Sensor, x: Array) -> Array:
        """Times of the samples on the robot's clock [s], shape [n].

        Args:
            x: Of the parameters, in standard deviations of their priors, shape [m].
        """
        file = self.recordings[sensor.recording]
        start, drift = (self._value(x, kind, file) for kind in (kinds.CLOCK_OFFSET, kinds.CLOCK_DRIFT))
        return np.asarray((sensor.channel.times - start) * (1.0 + drift))

    def low_pass(self, channel: Channel, x: Array) -> LowPass | None:
        """The filter of a channel's sensor, or None."""
        if channel.low_pass is None:
            return None
        frequency, damping = (self._value(x, kind, channel.path) for kind in kinds.FILTER)
        return LowPass(frequency or channel.low_pass.frequency, damping or channel.low_pass.damping)

    def predicted(self, motions: Motions, sensor: Sensor, x: Array) -> Array:
        """What a sensor would measure, shape [n, c].

        Args:
            motions: Signals of each shot.
        """
        times, kind, path = self.robot_times(sensor, x), sensor.channel.kind, own_path(sensor)
        signals = motions[sensor.take]
        values = signals.at(kind, sensor.index, times, low_pass=self.low_pass(sensor.channel, x))
        if kind == STRAIN:
            values = self._value(x, kinds.GAIN, path) * values + self._value(x, kinds.OFFSET, path)
        if kind == MARKER and isinstance(sensor.index, int) and np.any(place := self._vector(x, kinds.PLACE, path)):
            values = values + signals.axes_at(sensor.index, times) @ place
        if kind == ACCELEROMETER:
            values = values + self._vector(x, kinds.BIAS, path)
        free = self._free(signals, sensor, x)
        return values if free is None else values + signals.decays(times) @ free

    def _free(self, signals: Signals, sensor: Sensor, x: Array) -> Array | None:
        """Free motions in which a sensor begins, shape [2 modes, c]; None for one that rests."""
        paths = decay_paths(sensor, signals)
        if not any(p.kind == kinds.START and p.path in paths for p in self.parameters):
            return None
        count = sensor.channel.values.shape[1]
        axes = range(count) if count > 1 else (-1,)
        return np.array([[self._value(x, kinds.START, path, axis) for axis in axes] for path in paths])

    def derivatives(self, motions: Motions, sensor: Sensor, x: Array) -> Array:
        """Derivative of `predicted` by the parameters, shape [n, c, m]."""
        times, channel, path = self.robot_times(sensor, x), sensor.channel, own_path(sensor)
        signals = motions[sensor.take]
        file = self.recordings[sensor.recording]
        out = np.zeros((len(times), channel.values.shape[1], len(self.parameters)))
        low_pass = self.low_pass(channel, x)
        rate = signals.at(channel.kind, sensor.index, times, 1, low_pass)
        if channel.kind == STRAIN:
            rate = self._value(x, kinds.GAIN, path) * rate
        if (free := self._free(signals, sensor, x)) is not None:
            rate = rate + signals.decays(times, 1) @ free
        index = sensor.index if isinstance(sensor.index, int) else 0
        if channel.kind == MARKER and np.any(place := self._vector(x, kinds.PLACE, path)):
            rate = rate + signals.axes_at(index, times, 1) @ place
        start, drift = (self._value(x, kind, file) for kind in (kinds.CLOCK_OFFSET, kinds.CLOCK_DRIFT))
        for m, p in enumerate(self.parameters):
            if p.kind == kinds.CLOCK_OFFSET and p.path == file:
                out[:, :, m] = -(1.0 + drift) * p.spread * rate
            elif p.kind == kinds.CLOCK_DRIFT and p.path == file:
                out[:, :, m] = p.spread * (channel.times - start)[:, None] * rate
            elif p.kind == kinds.BIAS and channel.kind == ACCELEROMETER and p.path == path:
                out[:, p.axis, m] = p.spread
            elif p.kind in (kinds.GAIN, kinds.OFFSET) and channel.kind == STRAIN and p.path == path:
                own = signals.at(STRAIN, sensor.index, times, low_pass=low_pass) if p.kind == kinds.GAIN else 1.0
                out[:, :, m] = p.slope(float(x[m])) * own
            elif p.kind in kinds.FILTER and low_pass is not None and p.path == channel.path:
                gain = self._value(x, kinds.GAIN, path) if channel.kind == STRAIN else 1.0
                ends = [self.low_pass(channel, x + side * np.eye(len(x))[m]) for side in (SIDE, -SIDE)]
                one, other = (signals.at(channel.kind, sensor.index, times, low_pass=end) for end in ends)
                out[:, :, m] = gain * (one - other) / (2.0 * SIDE)
            elif p.kind == kinds.START and p.path in (paths := decay_paths(sensor, signals)):
                out[:, max(p.axis, 0), m] = p.spread * signals.decays(times)[:, paths.index(p.path)]
            elif p.kind == kinds.PLACE and channel.kind == MARKER and p.path == path:
                out[:, :, m] = p.spread * signals.axes_at(index, times)[:, :, p.axis]
        return out

    def residuals(self, motions: Motions, x: Array) -> Array:
        """(measured - predicted) / sigma of all values that are fitted, shape [N]."""
        parts = []
        for sensor in self.sensors:
            off = sensor.channel.values - self.predicted(motions, sensor, x)
            parts.append(off[sensor.fitted] / sensor.sigma)
        return np.concatenate(parts)

    def weighted(self, values: Sequence[Array]) -> Array:
        """Values of each sensor, shape [n, c] or [n, c, m], over its sigma, where it is fitted: shape [N] or [N, m]."""
        return np.concatenate(
            [part[sensor.fitted] / sensor.sigma for sensor, part in zip(self.sensors, values, strict=True)]
        )

    @property
    def counts(self) -> Array:
        """How many successive values of those of `residuals` count as one, shape [N]."""
        return np.concatenate([np.full(int(sensor.fitted.sum()), sensor.count) for sensor in self.sensors])

    def with_sensors(self, sensors: Sequence[Sensor]) -> Measurement:
        """The same with other noise of the sensors, or another count."""
        return replace(self, sensors=tuple(sensors))
