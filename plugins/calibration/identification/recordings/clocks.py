"""What the clock of a recording reads at the first frame of the shot, to begin with."""

from collections.abc import Sequence

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Character
from calmotion.recordings import STRAIN, Channel, SensorRecording

from ..signals import Place, Signals, place_of
from .noise import noise_of

STEP = 0.01  # between clocks that are tried first [s]
SAMPLES = 600  # of a channel that are compared, at most
COVERED = 0.5  # share of the motion that a recording must hold
UNLIKE = 0.8  # mean square of the difference over that of the recording itself, from which no clock is told


def clock_of(recording: SensorRecording, character: Character, robots: Sequence[Signals]) -> float:
    """The clock [s] at which what was recorded is most like what one of some simulated robots shows.

    All shifts at which half of the motion is recorded are tried, then finer ones about the best. Constants are taken
    off each component, so that biases do not matter. Where no robot is like the recording at any clock, it is taken to
    begin with the shot (0): in a shot without friction, a dropped arm swings on and is like its recording nowhere.

    Args:
        recording: The recording; channels that the robot does not have are not looked at.
        character: Its targets and motors.
        robots: Signals of each: a robot that shakes more than the real one may be most like its recording at a wrong
            clock, where one that hardly shakes tells the right one.
    """
    found = [_clock_by(recording, character, signals) for signals in robots]
    clock, cost = min(found, key=lambda item: item[1])
    length = float(robots[0].times[-1])
    covered = min(recording.end, length) - max(recording.start, 0.0)
    return 0.0 if UNLIKE <= cost < np.inf and covered >= COVERED * length else clock


def _clock_by(recording: SensorRecording, character: Character, signals: Signals) -> tuple[float, float]:
    """The clock by one robot, and how unlike it the recording is."""
    length = float(signals.times[-1])
    first, last = recording.start - (1.0 - COVERED) * length, recording.end - COVERED * length
    compared = _compared(recording, character)
    if not compared or last <= first:
        return recording.start, np.inf
    candidates = np.arange(first, last + STEP, STEP, dtype=np.float64)
    best = _best(candidates, compared, signals)
    for step in (STEP / 10.0, STEP / 100.0):
        best = _best(best[0] + step * np.arange(-12.0, 13.0), compared, signals)
    return best


_Compared = tuple[Channel, Place, Array, Array, float]


def _compared(recording: SensorRecording, character: Character) -> list[_Compared]:
    """Kind, index, times, values and scale of each channel, with few samples."""
    found = []
    for channel in recording.channels:
        place = place_of(channel, character)
        if place is None:
            continue
        every = max(1, len(channel.times) // SAMPLES)
        values = channel.values[::every]
        spread = np.nanstd(values) + noise_of(channel.values)
        found.append((channel, place, channel.times[::every], values, float(spread)))
    return found


def fitted_gain(signal: Array, values: Array) -> float:
    """The factor by which a signal, shape [n, 1], is most like values that may be offset; 1 where it does not move."""
    known = np.isfinite(values[:, 0])
    own, other = signal[known, 0] - signal[known, 0].mean(), values[known, 0] - values[known, 0].mean()
    return float(own @ other / (own @ own)) if own @ own > 0.0 and own @ other != 0.0 else 1.0


def _best(candidates: Array, compared: list[_Compared], signals: Signals) -> tuple[float, float]:
    costs = []
    for clock in candidates:
        cost = 0.0
        for channel, place, times, values, scale in compared:
            simulated = signals.at(channel.kind, place, times - clock, low_pass=channel.low_pass)
            if channel.kind == STRAIN:  # its gain is not known
                simulated = fitted_gain(simulated, values) * simulated
            off = (values - simulated) / scale
            # a few outliers must not decide
            off = np.clip(off - np.nanmedian(off, axis=0), -2.0, 2.0)
            cost += float(np.nanmean(off**2)) / len(compared)
        costs.append(cost)
    least = int(np.argmin(costs))
    return float(candidates[least]), float(costs[least])
