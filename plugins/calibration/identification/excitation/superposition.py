"""What a recording of any test motion would tell, from the responses to one pulse of each motor.

About its first pose a robot is nearly linear: what its sensors read, and the derivatives of that by its parameters, are
sums of responses to the pulses of which the commands consist, each delayed by some frames. Nothing but the pulses is
simulated. Friction, motors at their limits and large turns make a difference to a simulation. A pulse is smooth, so
that it excites no more than tones do: what commands have at more than a third of the frame rate is left out.
"""

from collections.abc import Callable

import numpy as np
from calmotion.arrays import Array
from numpy.lib.stride_tricks import sliding_window_view

from ...model import kinds
from ..problem import Calibrated
from .waveforms import Family

LEAD = 12  # frames before the middle of the pulse: there its spline is below 1e-5 of its height
SHAPE = np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 6.0  # of a pulse at its frames: nothing at half of the frame rate
SHARE = 0.1  # of what a motor may do, by which it leaves the pose: more is less linear, less is less exact
AROUND = 24  # frames of rest before and after a motion, in which the pulses of which it consists fade


class Superposition:
    """Derivatives of what sensors would read in any motion of a family, by sums of responses to pulses.

    Args:
        family: The motions.
        problem: The robot and its sensors with a motion of shape [f, M], simulated for some time after its end.

    Raises:
        ShotError: The robot cannot be simulated with a pulse.
        SimulationFailure: A step fails.
    """

    def __init__(self, family: Family, problem: Callable[[Array], Calibrated]):
        self._family, frame, found = family, float(family.times[1]), []
        for leader in range(len(family.leading)):
            values, height = family.pulse(leader, LEAD, SHAPE, SHARE)
            pulsed = problem(values)
            self._times: Array = frame * np.arange(
                len(family.times) + round(pulsed.takes[0].after / frame), dtype=np.float64
            )
            found.append((_readings(pulsed, self._times), height))
        self._rest = found[0][0][0]  # by how the robot sags: at the first frame nothing has begun to move
        self._responses = np.concatenate(
            [((own - self._rest) / height if height else 0.0 * own).reshape(len(own), -1) for own, height in found]
        )
        measurement, here = pulsed.measurement, pulsed.signals(np.zeros(len(pulsed.lower)))
        sensors, z = measurement.sensors, np.zeros(len(measurement.parameters))
        # derivatives by biases and places, which do not depend on the motion: those of the first sample
        self._constant = np.concatenate([measurement.derivatives(here, own, z)[0] for own in sensors])
        # by clocks: shares of the rate of a reading, and of its rate times the time
        files = np.repeat([own.recording for own in sensors], [own.channel.values.shape[1] for own in sensors])
        self._by_offset, self._by_drift = (
            np.array([
                [sign * p.spread * (p.kind == kind and p.path == measurement.recordings[file])
                 for p in measurement.parameters] for file in files
            ])
            for kind, sign in ((kinds.CLOCK_OFFSET, -1.0), (kinds.CLOCK_DRIFT, 1.0))
        )  # fmt: skip
        # as many samples as a frame has, each with its noise
        rates = [frame / (own.channel.times[1] - own.channel.times[0]) for own in sensors]
        self._weights = np.concatenate(
            [
                np.full(own.channel.values.shape[1], np.sqrt(rate) / own.sigma)
                for own, rate in zip(sensors, rates, strict=True)
            ]
        )

    def jacobian(self, values: Array) -> Array:
        """Derivatives by all parameters of what is read at the frames, over its noise, shape [N, n].

        Args:
            values: The motion, shape [f, M].
        """
        total = len(self._times)
        own = _heights((values - self._family.start)[:, self._family.leading])
        # row t has the pulses at the frames from t + LEAD backwards, those of each motor in turn
        before, behind = np.zeros((total - 1 - LEAD, own.shape[1])), np.zeros((total + LEAD, own.shape[1]))
        windows = sliding_window_view(np.concatenate([before, own, behind]), total, axis=0)[:total, :, ::-1]
        moved = (windows.reshape(total, -1) @ self._responses).reshape(total, *self._rest.shape)
        by_robot, rate = self._rest[:, :-1] + moved[..., :-1], moved[..., -1:]
        by_measurement = self._constant + rate * (self._by_offset + self._times[:, None, None] * self._by_drift)
        found = np.concatenate([by_robot, by_measurement], axis=2) * self._weights[:, None]
        return np.asarray(found.reshape(-1, found.shape[2]))


def _heights(offsets: Array) -> Array:
    """Heights of the pulses at the frames whose sum is a motion, shape [f, m]."""
    total, middle = len(offsets) + 2 * AROUND, len(SHAPE) // 2
    padded = np.zeros((total, offsets.shape[1]))
    padded[AROUND:-AROUND] = offsets
    shape = np.zeros(total)
    shape[np.arange(-middle, middle + 1)] = SHAPE
    inside = np.fft.rfftfreq(total) < 1.0 / 3.0
    spectrum = np.fft.rfft(padded, axis=0) * np.where(inside, 1.0 / np.fft.rfft(shape).real, 0.0)[:, None]
    return np.asarray(np.fft.irfft(spectrum, total, axis=0)[AROUND:-AROUND])


def _readings(problem: Calibrated, times: Array) -> Array:
    """Derivatives of the readings of all sensors by the robot's parameters, and by time, shape [T, C, n + 1]."""
    z = np.zeros(len(problem.lower))
    problem.linearized(z)
    here, differences = problem.signals(z), problem.differences
    assert differences is not None
    parts = []
    for sensor in problem.measurement.sensors:
        kind, index = sensor.channel.kind, sensor.index
        columns = differences.of(lambda motions, kind=kind, index=index: motions[0].at(kind, index, times))  # type: ignore[misc]
        parts.append(np.stack([*columns, here[0].at(kind, index, times, 1)], axis=2))
    return np.concatenate(parts, axis=1)
