"""Sensors of recordings: what they have to do with the robot, and the parameters of their own."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.errors import ShotError
from calmotion.model import Character
from calmotion.recordings import (
    ACCELEROMETER,
    COMPONENTS,
    MARKER,
    STRAIN,
    UNITS,
    Channel,
    SensorRecording,
    refuse_unknown_channels,
)

from ...model import kinds
from ..parameters import Parameter
from ..signals import Place, Signals, place_of
from .clocks import fitted_gain
from .noise import noise_of

REST = 0.5  # time before the first frame that counts [s]: the robot rests
BLOCKS, EVERY = 20, 5  # parts of a recording, of which every fifth is held out
LEAST = 12  # values of a channel that are worth a fit
STILL, EVIDENT = 0.01, 0.03  # share of its motion up to which a signal stands, and from which it moves
FREE = 0.3  # of the range of a signal: standard deviation of what it swings by itself when a shot begins


@dataclass(frozen=True, eq=False)
class Sensor:
    """A channel, and what it has to do with the robot.

    Attributes:
        recording: Index of its recording.
        channel: The channel.
        index: Of the target, or of the motor; of both targets of a strain gauge.
        used: Samples during the shot and shortly before and after it, shape [n].
        held_out: Those of them that are not fitted, shape [n].
        sigma: Standard deviation of its noise.
        count: How many successive samples count as one: 1 for white noise.
        take: Index of the shot that was performed.
    """

    recording: int
    channel: Channel
    index: Place
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
    found = []
    for r, recording in enumerate(recordings):
        for channel in recording.channels:
            index = place_of(channel, character)
            assert index is not None
            times = channel.times - clocks[r]
            used = (times >= max(begin, -REST)) & (times <= end)
            sensor = Sensor(r, channel, index, used, np.zeros(len(times), bool), 1.0)
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
    recordings: Sequence[SensorRecording],
    clocks: Sequence[float],
    priors: Mapping[str, float] | None = None,
    take: int = 0,
) -> tuple[Parameter, ...]:
    """Clocks of the recordings, biases of accelerometers and places of markers, which the recordings of one shot share,
    and low-passes of sensors, which all recordings share.

    Args:
        take: Index of the shot.
    """
    given = {**kinds.PRIORS, **(priors or {})}
    found = []
    for recording, clock in zip(recordings, clocks, strict=True):
        found.append(Parameter(kinds.CLOCK_OFFSET, recording.file, clock, given[kinds.CLOCK_OFFSET], "s", -1, False))
        found.append(Parameter(kinds.CLOCK_DRIFT, recording.file, 0.0, given[kinds.CLOCK_DRIFT], "", -1, False))
        for channel in recording.channels:
            kind = {MARKER: kinds.PLACE, ACCELEROMETER: kinds.BIAS}.get(channel.kind)
            if kind is not None:
                unit = "m" if kind == kinds.PLACE else "m/s^2"
                path = _of_take(channel.path, take)
                found += [Parameter(kind, path, 0.0, given[kind], unit, axis, False) for axis in range(3)]
            if (low_pass := channel.low_pass) is not None:
                own = {kinds.FILTER_FREQUENCY: (low_pass.frequency, "Hz"), kinds.FILTER_DAMPING: (low_pass.damping, "")}
                found += [
                    Parameter(kind, channel.path, value, float(np.log1p(given[kind])), unit)
                    for kind, (value, unit) in own.items()
                    if value
                ]
    return tuple({p.name: p for p in found}.values())


def gauge_parameters(
    sensors: Sequence[Sensor], clocks: Sequence[float], nominal: Signals, priors: Mapping[str, float]
) -> tuple[Parameter, ...]:
    """Gains and offsets of strain gauges, about those by which the robot of the shot is most like its recording."""
    given, found = {**kinds.PRIORS, **priors}, []
    for sensor in sensors:
        if sensor.channel.kind == STRAIN:
            signal = _nominal(sensor, clocks, nominal)
            gain, values = fitted_gain(signal, sensor.channel.values), sensor.channel.values[sensor.used]
            offset = float(np.nanmean(values) - gain * signal[sensor.used].mean())
            path = own_path(sensor)
            found.append(Parameter(kinds.GAIN, path, gain, float(np.log1p(given[kinds.GAIN])), ""))
            spread = given[kinds.OFFSET] * float(np.nanstd(values))
            found.append(Parameter(kinds.OFFSET, path, offset, spread, "", -1, False))
    return tuple(found)


def start_parameters(
    sensors: Sequence[Sensor], clocks: Sequence[float], nominal: Signals, moves: bool
) -> tuple[Parameter, ...]:
    """How far each sensor swings freely in the lowest modes when the shot begins; none where the robot rests then.

    Args:
        moves: Whether the commands move already at the first frame; else the robot does where a sensor tells it.
    """
    if not any(moves or _moves(sensor, clocks, nominal) for sensor in sensors):
        return ()
    found = []
    for sensor in sensors:
        spread = FREE * _range(sensor.channel.values[sensor.used])
        components = COMPONENTS[sensor.channel.kind]
        found += [
            Parameter(kinds.START, path, 0.0, spread, UNITS[sensor.channel.kind], -1 if components == 1 else c, False)
            for path in decay_paths(sensor, nominal)
            for c in range(components)
        ]
    return tuple(found)


def decay_paths(sensor: Sensor, signals: Signals) -> list[str]:
    return [
        f"{own_path(sensor)}, {what} in mode {k + 1}"
        for k in range(signals.modes.shape[1])
        for what in ("deflection", "speed")
    ]


def _nominal(sensor: Sensor, clocks: Sequence[float], nominal: Signals) -> Array:
    channel = sensor.channel
    times = channel.times - clocks[sensor.recording]
    return nominal.at(channel.kind, sensor.index, times, low_pass=channel.low_pass)


def _range(values: Array) -> float:
    """Of the component of a signal that moves most, shape [n, c], NaN where a sample is missing."""
    known = values[:, np.isfinite(values).any(axis=0)]
    return float(np.max(np.nanmax(known, axis=0) - np.nanmin(known, axis=0)))


def _moves(sensor: Sensor, clocks: Sequence[float], nominal: Signals) -> bool:
    """Whether a sensor tells motion while the robot of the shot rests."""
    signal, values = _nominal(sensor, clocks, nominal)[sensor.used], sensor.channel.values[sensor.used]
    off = np.abs(signal - signal[0]).max(axis=1)
    rests = np.cumsum(off > STILL * off.max()) == 0
    before = values[rests & np.all(np.isfinite(values), axis=1)]
    if len(before) < LEAST:
        return False
    moved = float(np.ptp(before, axis=0).max())
    return moved > max(EVIDENT * _range(values), 10.0 * sensor.sigma)


def own_path(sensor: Sensor) -> str:
    """The path of the parameters of a sensor itself, which differ from shot to shot."""
    return _of_take(sensor.channel.path, sensor.take)


def _of_take(path: str, take: int) -> str:
    return path if take == 0 else f"{path} (shot {take + 1})"
