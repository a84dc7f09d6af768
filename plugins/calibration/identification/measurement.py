"""Sensors of a robot and their clocks: what they measured against what a simulated robot would have shown them.

The clock of a recording reads s at the first frame of the shot, and a share d slower: t_robot = (t - s) (1 + d). An
accelerometer has a constant bias in its axes; a marker sits a little off its prim, by a distance that is constant in
the prim's axes. These are parameters like those of the robot, whose derivatives are exact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.errors import ShotError, raise_all
from calmotion.model import Character
from calmotion.recordings import ACCELEROMETER, ANGLE, EFFORT, MARKER, Channel, SensorRecording
from calmotion.support import nearest

from ..model.estimates import BIAS, CLOCK_DRIFT, CLOCK_OFFSET, PLACE
from .parameters import PRIORS, Parameter
from .recordings.noise import noise_of
from .signals import Signals

Motions = Sequence[Signals]  # of each shot

REST = 0.5  # time before the first frame that counts [s]: the robot rests
BLOCKS, EVERY = 20, 5  # parts of a recording, of which every fifth is held out
LEAST = 12  # values of a channel that are worth a fit


@dataclass(frozen=True, eq=False)
class Sensor:
    """A channel, and what it has to do with the robot.

    Attributes:
        recording: Index of its recording.
        channel: The channel.
        index: Of the target, or of the motor.
        used: Samples during the shot and shortly before and after it, shape [n].
        held_out: Those of them that are not fitted, shape [n].
        sigma: Standard deviation of its noise.
        count: How many successive samples count as one: 1 for white noise.
        take: Index of the shot that was performed.
    """

    recording: int
    channel: Channel
    index: int
    used: BoolArray
    held_out: BoolArray
    sigma: float
    count: float = 1.0
    take: int = 0

    @property
    def fitted(self) -> BoolArray:
        """Which values are fitted, shape [n, c]."""
        return np.asarray((self.used & ~self.held_out)[:, None] & np.isfinite(self.channel.values))

    @property
    def validated(self) -> BoolArray:
        """Which values are compared, but not fitted, shape [n, c]."""
        return np.asarray((self.used & self.held_out)[:, None] & np.isfinite(self.channel.values))


def sensors_of(
    character: Character, recordings: Sequence[SensorRecording], clocks: Sequence[float], begin: float, end: float,
    validate: bool = True,
) -> tuple[Sensor, ...]:  # fmt: skip
    """The sensors of recordings.

    Args:
        character: With a target at each prim that has a sensor.
        recordings: The recordings.
        clocks: What the clock of each reads at the first frame of the shot [s], about.
        begin, end: What is simulated, on the robot's clock [s].
        validate: Whether a fifth of the samples is held out.

    Raises:
        ShotError: A channel names nothing on the robot, or has too few samples during the shot.
    """
    refuse_unknown_channels(character, recordings)
    targets = {target.path: k for k, target in enumerate(character.targets)}
    motors = {motor.path: k for k, motor in enumerate(character.motors)}
    found = []
    for r, recording in enumerate(recordings):
        for channel in recording.channels:
            known = motors if channel.kind in (ANGLE, EFFORT) else targets
            times = channel.times - clocks[r]
            used = (times >= max(begin, -REST)) & (times <= end)
            sensor = Sensor(r, channel, known[channel.path], used, np.zeros(len(times), bool), 1.0)
            if sensor.fitted.sum() < LEAST:
                raise ShotError(
                    "the recording has too few samples of a channel during the shot",
                    path=recording.file,
                    attribute=channel.name,
                    found=f"{int(sensor.fitted.sum())} values between {begin:.3g} and {end:.3g} s of the shot",
                    remedy="Check the times of the recording; it must hold the performance of this shot",
                )
            block = np.floor((times - begin) * BLOCKS / (end - begin)).astype(int)
            held = used & (block % EVERY == EVERY - 2) if validate else np.zeros(len(times), bool)
            sigma = channel.sigma if channel.sigma is not None else noise_of(channel.values[used])
            found.append(replace(sensor, held_out=held, sigma=sigma))
    return tuple(found)


def measurement_parameters(
    recordings: Sequence[SensorRecording], clocks: Sequence[float], priors: Mapping[str, float] | None = None,
    take: int = 0,
) -> tuple[Parameter, ...]:  # fmt: skip
    """Clocks of the recordings, biases of accelerometers and places of markers; the recordings of one shot share the
    latter two.

    Args:
        take: Index of the shot.
    """
    given = {**PRIORS, **(priors or {})}
    found = []
    for recording, clock in zip(recordings, clocks, strict=True):
        found.append(Parameter(CLOCK_OFFSET, recording.file, clock, given[CLOCK_OFFSET], "s", -1, False))
        found.append(Parameter(CLOCK_DRIFT, recording.file, 0.0, given[CLOCK_DRIFT], "", -1, False))
        for channel in recording.channels:
            kind = {MARKER: PLACE, ACCELEROMETER: BIAS}.get(channel.kind)
            if kind is not None:
                unit = "m" if kind == PLACE else "m/s^2"
                path = _of_take(channel.path, take)
                found += [Parameter(kind, path, 0.0, given[kind], unit, axis, False) for axis in range(3)]
    return tuple({p.name: p for p in found}.values())


def own_path(sensor: Sensor) -> str:
    """The path of the parameters of a sensor itself, which differ from shot to shot."""
    return _of_take(sensor.channel.path, sensor.take)


def _of_take(path: str, take: int) -> str:
    return path if take == 0 else f"{path} (shot {take + 1})"


def refuse_unknown_channels(character: Character, recordings: Sequence[SensorRecording]) -> None:
    """Refuse channels of prims that the robot does not have.

    Raises:
        ShotError: There are some.
    """
    targets, motors = [t.path for t in character.targets], [m.path for m in character.motors]
    problems = []
    for recording in recordings:
        for channel in recording.channels:
            known = motors if channel.kind in (ANGLE, EFFORT) else targets
            if channel.path not in known:
                problems.append(
                    ShotError(
                        f"the recording has a channel ({channel.kind}) of a prim that the robot does not have",
                        path=recording.file,
                        attribute=channel.path,
                        found="no such " + ("motor" if known is motors else "prim below a body"),
                        remedy=f"{nearest(channel.path, known)}Correct the column, or its row in the TOML map",
                    )
                )
    raise_all(problems)


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
        start, drift = (self._value(x, kind, file) for kind in (CLOCK_OFFSET, CLOCK_DRIFT))
        return np.asarray((sensor.channel.times - start) * (1.0 + drift))

    def predicted(self, motions: Motions, sensor: Sensor, x: Array) -> Array:
        """What a sensor would measure, shape [n, c].

        Args:
            motions: Signals of each shot.
        """
        times, kind, path = self.robot_times(sensor, x), sensor.channel.kind, own_path(sensor)
        signals = motions[sensor.take]
        values = signals.at(kind, sensor.index, times)
        if kind == MARKER and np.any(place := self._vector(x, PLACE, path)):
            values = values + signals.axes_at(sensor.index, times) @ place
        if kind == ACCELEROMETER:
            values = values + self._vector(x, BIAS, path)
        return values

    def derivatives(self, motions: Motions, sensor: Sensor, x: Array) -> Array:
        """Derivative of `predicted` by the parameters, shape [n, c, m]."""
        times, channel, path = self.robot_times(sensor, x), sensor.channel, own_path(sensor)
        signals = motions[sensor.take]
        file = self.recordings[sensor.recording]
        out = np.zeros((len(times), channel.values.shape[1], len(self.parameters)))
        rate = signals.at(channel.kind, sensor.index, times, 1)
        if channel.kind == MARKER and np.any(place := self._vector(x, PLACE, path)):
            rate = rate + signals.axes_at(sensor.index, times, 1) @ place
        start, drift = (self._value(x, kind, file) for kind in (CLOCK_OFFSET, CLOCK_DRIFT))
        for m, p in enumerate(self.parameters):
            if p.kind == CLOCK_OFFSET and p.path == file:
                out[:, :, m] = -(1.0 + drift) * p.spread * rate
            elif p.kind == CLOCK_DRIFT and p.path == file:
                out[:, :, m] = p.spread * (channel.times - start)[:, None] * rate
            elif p.kind == BIAS and channel.kind == ACCELEROMETER and p.path == path:
                out[:, p.axis, m] = p.spread
            elif p.kind == PLACE and channel.kind == MARKER and p.path == path:
                out[:, :, m] = p.spread * signals.axes_at(sensor.index, times)[:, :, p.axis]
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
