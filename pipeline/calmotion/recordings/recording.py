"""Recordings of a performance on the real robot."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array
from calmotion.model.motor import Motor

# kinds of channels
MARKER, ACCELEROMETER, ANGLE, EFFORT, STRAIN = "marker", "accelerometer", "angle", "effort", "strain"
COMPONENTS = {MARKER: 3, ACCELEROMETER: 3, ANGLE: 1, EFFORT: 1, STRAIN: 1}
UNITS = {MARKER: "m", ACCELEROMETER: "m/s^2", ANGLE: "rad or m", EFFORT: "N m or N", STRAIN: ""}


def unit_of(kind: str, path: str, motors: Iterable[Motor] = ()) -> str:
    """Unit of a channel; where the motor of its joint is not known, that of a joint that turns or that of a slider."""
    linear = next((motor.linear for motor in motors if motor.path == path), None)
    either = UNITS[kind].split(" or ")
    return UNITS[kind] if linear is None or len(either) == 1 else either[linear]


@dataclass(frozen=True)
class LowPass:
    """A filter between a sensor and its recording, with a gain of 1 for what is slow.

    Attributes:
        frequency: Of its corner [Hz].
        damping: Of the second order, as a fraction of the critical; None: a filter of first order.
    """

    frequency: float
    damping: float | None = None


@dataclass(frozen=True, eq=False)
class Channel:
    """One measured quantity, on the clock of its recording.

    Attributes:
        kind: MARKER: position of a prim [m], world; ACCELEROMETER: specific force R^T (a - g) at a prim in its axes
            [m/s^2]; ANGLE: value of a joint [rad or m]; EFFORT: of its motor [N m or N]; STRAIN: of a gauge from a
            prim to another one, in proportion to how far the link bends between them; gain and offset are not known.
        path: Prim path of the prim or of the joint.
        times: [s], strictly increasing, shape [n].
        values: Shape [n, c], c = 3 or 1; NaN where a sample is missing.
        sigma: Standard deviation of the noise; None: estimated from the samples.
        to: The other prim of STRAIN.
        low_pass: What the sensor does to its signal, or None.
    """

    kind: str
    path: str
    times: Array
    values: Array
    sigma: float | None = None
    to: str = ""
    low_pass: LowPass | None = None

    @property
    def prims(self) -> tuple[str, ...]:
        """Prims at which it sits; none for what a joint or its motor tells."""
        ends = (self.path, self.to) if self.kind == STRAIN else (self.path,)
        return ends if self.kind not in (ANGLE, EFFORT) else ()

    @property
    def name(self) -> str:
        """Kind and path."""
        return f"{self.kind} {self.path}"


@dataclass(frozen=True, eq=False)
class SensorRecording:
    """What one device recorded, on one clock.

    Attributes:
        file: Its file, as it was given.
        sha256: Of the file.
        channels: What was measured.
        notes: What the reader noticed, as sentences.
    """

    file: str
    sha256: str
    channels: tuple[Channel, ...]
    notes: tuple[str, ...] = ()

    @property
    def start(self) -> float:
        """Time of the first sample [s]."""
        return float(min(channel.times[0] for channel in self.channels))

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return float(max(channel.times[-1] for channel in self.channels))

    @property
    def samples(self) -> int:
        """Number of values that are not missing."""
        return int(sum(np.isfinite(channel.values).sum() for channel in self.channels))


@dataclass(frozen=True)
class RecordingRequest:
    """A recording that is to be read.

    Attributes:
        file: Its file.
        prim: Prim path of the sensor, for files that do not name it; empty where none was given.
    """

    file: str
    prim: str = ""


_TURN, _FASTEST = 2.0 * np.pi, 20.0  # [rad]; no joint turns faster between two samples [rad/s]


def turned_on(recording: SensorRecording) -> SensorRecording:
    """A recording whose encoders do not jump by a turn where they pass the end of their range, and a note of it."""
    channels, told = [], []
    for channel in recording.channels:
        known = np.flatnonzero(np.isfinite(channel.values[:, 0])) if channel.kind == ANGLE else np.zeros(0, int)
        steps = np.diff(channel.values[known, 0])
        turns = np.round(steps / _TURN)
        jumps = (np.abs(steps - _TURN * turns) < 0.25 * _TURN) & (
            np.abs(steps) > np.maximum(0.5 * _TURN, _FASTEST * np.diff(channel.times[known]))
        )
        if jumps.any():
            values = channel.values.copy()
            values[known[1:], 0] -= _TURN * np.cumsum(np.where(jumps, turns, 0.0))
            channel = replace(channel, values=values)
            told.append(f"{recording.file}: {channel.path} jumps by a turn {int(jumps.sum())} times, and is unwrapped")
        channels.append(channel)
    return replace(recording, channels=tuple(channels), notes=(*recording.notes, *told)) if told else recording
