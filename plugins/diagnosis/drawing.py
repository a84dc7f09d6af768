"""Figures of a diagnosis: motion and error in time, spectra of the error, and the error over speed and torque."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import file_access
from calmotion.recordings import ANGLE
from calmotion.views import AFTER, BEFORE, INTENDED, LIMIT, SMALL, new_figure, save, short, tidy
from matplotlib.figure import Figure

from .comparison import Diagnosis
from .situation import Situation

ROWS = 6  # channels that are drawn


def draw_diagnosis(folder: str, diagnosis: Diagnosis, dpi: int = 150) -> list[str]:
    """Draw the figures of a diagnosis; returns their paths.

    Raises:
        ShotError: When the folder cannot be written.
    """
    target = Path(folder)
    with file_access("the figures cannot be written", folder, "Choose another folder"):
        target.mkdir(parents=True, exist_ok=True)
        return [save(figure, target / f"{name}.png", dpi) for name, _, figure in plots_of(diagnosis)]


def plots_of(diagnosis: Diagnosis) -> Iterator[tuple[str, str, Figure]]:
    """For each figure the name of its file, a heading, and the figure; none where a spectrum was measured."""
    if diagnosis.situation is not None:
        yield "motion", "Motion and error", plot_motion(diagnosis)
        yield "spectra", "Spectra of the error", plot_spectra(diagnosis)
        yield "speed_and_torque", "Error over speed and torque", plot_speed_and_torque(diagnosis)


def plot_motion(diagnosis: Diagnosis) -> Figure:
    """Command and motion of each joint with an encoder, and the error with what the causes explain of it."""
    s = _situation(diagnosis)
    shown = list(range(len(s.sensors)))[:ROWS]
    figure = new_figure(9.0, 1.9 * len(shown) + 0.4)
    grid = figure.subplots(len(shown), 2, squeeze=False, sharex=True)
    for (left, right), k in zip(grid, shown, strict=True):
        sensor = s.sensors[k]
        if sensor.kind == ANGLE and sensor.index >= 0:
            left.plot(s.times, s.command[:, sensor.index], color=INTENDED, lw=1.0, label="command")
        left.plot(sensor.times, sensor.values, color=BEFORE, lw=0.8, label="recorded")
        block = s.blocks_of[k][int(np.argmax([np.sum(s.error[s.blocks[b]] ** 2) for b in s.blocks_of[k]]))]
        rows = s.blocks[block]
        right.plot(sensor.times, s.error[rows] / s.weights[k], color=BEFORE, lw=0.8, label="error")
        if diagnosis.fit is not None:
            explained = (s.error - diagnosis.fit.left)[rows] / s.weights[k]
            right.plot(sensor.times, explained, color=AFTER, lw=0.8, label="explained")
        tidy(left, f"{sensor.kind} [{sensor.unit}]", short(sensor.path))
        tidy(right, f"error [{sensor.error_unit}]", f"{short(sensor.path)}: error")
    for axes in grid[0]:
        axes.legend(fontsize=SMALL, loc="upper right")
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    return figure


def plot_spectra(diagnosis: Diagnosis) -> Figure:
    """Amplitude spectrum of the error of each sensor, with the frequencies of the causes."""
    s = _situation(diagnosis)
    shown = list(range(len(s.sensors)))[:ROWS]
    figure = new_figure(7.0, 1.9 * len(shown) + 0.4)
    for axes, k in zip(figure.subplots(len(shown), 1, squeeze=False, sharex=True)[:, 0], shown, strict=True):
        sensor = s.sensors[k]
        for vector, color, label in ((s.error, BEFORE, "error"), (_left(diagnosis), AFTER, "not explained")):
            frequencies, size = _spectrum(diagnosis, vector, k)
            axes.loglog(frequencies, size / s.weights[k], color=color, lw=0.8, label=label)
        for cause in diagnosis.causes:
            for row in cause.parameters:
                if row["unit"] == "Hz":
                    axes.axvline(row["value"], color=LIMIT, lw=0.8, ls=":")
                    axes.annotate(cause.cause, (row["value"], 1.0), xycoords=("data", "axes fraction"), fontsize=SMALL)
        tidy(axes, f"amplitude [{sensor.error_unit}]", f"{short(sensor.path)}: error")
    axes.legend(fontsize=SMALL)
    axes.set_xlabel("frequency [Hz]")
    return figure


def plot_speed_and_torque(diagnosis: Diagnosis) -> Figure:
    """The error of each joint over its speed, and about the reversals of its torque."""
    s = _situation(diagnosis)
    shown = list(s.encoders.items())[:ROWS] or [(-1, 0)]
    figure = new_figure(8.0, 2.0 * len(shown) + 0.4)
    for (left, right), (m, k) in zip(figure.subplots(len(shown), 2, squeeze=False), shown, strict=True):
        sensor = s.sensors[k]
        error = s.error[s.blocks[s.blocks_of[k][0]]] / s.weights[k]
        if m >= 0:
            speed = np.interp(sensor.times, s.times, s.rates[:, m])
            torque = s.joints[m].torque
            left.plot(speed, error, ".", ms=1.5, color=BEFORE)
            turns = s.times[1:][np.diff(np.sign(torque)) != 0.0]
            since = (
                sensor.times - turns[np.clip(np.searchsorted(turns, sensor.times) - 1, 0, None)] if len(turns) else None
            )
            if since is not None:
                near = (since >= 0.0) & (since < 0.5)
                right.plot(since[near], error[near], ".", ms=1.5, color=BEFORE)
        tidy(left, f"error [{sensor.error_unit}]", f"{short(sensor.path)}: error over speed")
        tidy(right, f"error [{sensor.error_unit}]", f"{short(sensor.path)}: error after reversals of torque")
    left.set_xlabel("speed of the command [rad/s or m/s]")
    right.set_xlabel("time since the torque changed its sign [s]")
    return figure


def _left(diagnosis: Diagnosis) -> Array:
    return _situation(diagnosis).error if diagnosis.fit is None else diagnosis.fit.left


def _situation(diagnosis: Diagnosis) -> Situation:
    assert diagnosis.situation is not None, "a spectrum is a figure already"
    return diagnosis.situation


def _spectrum(diagnosis: Diagnosis, vector: Array, k: int) -> tuple[Array, Array]:
    """Frequencies [Hz] and amplitudes of a sensor's largest component."""
    s = _situation(diagnosis)
    own = max((vector[s.blocks[b]] for b in s.blocks_of[k]), key=lambda part: float(part @ part))
    window = np.hanning(len(own))
    size = 2.0 * np.abs(np.fft.rfft(own * window)) / max(window.sum(), 1e-12)
    period = float(np.median(np.diff(s.sensors[k].times)))
    return np.asarray(np.fft.rfftfreq(len(own), period)[1:], float), np.asarray(size[1:] + 1e-12)
