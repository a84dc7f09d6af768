"""Figures of a calibration: measured against simulated signals, spectra of the residuals, and intervals."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from calmotion.errors import file_access
from calmotion.views import AFTER, BEFORE, INTENDED, LIMIT, SMALL, new_figure, save, short, tidy
from matplotlib.figure import Figure

from .model.estimates import Calibration, ChannelCurves

CHANNELS_ON_A_PAGE = 4
COMPONENTS = "xyz"


def draw_calibration(folder: str, calibration: Calibration, dpi: int = 150) -> list[str]:
    """Draw the figures of a calibration.

    Args:
        folder: Folder of the figures; it is created where it does not exist.
        calibration: What was estimated.
        dpi: Dots per inch.

    Returns:
        Paths of the figures.

    Raises:
        ShotError: When the folder cannot be written.
    """
    target = Path(folder)
    with file_access("the figures cannot be written", folder, "Choose another folder"):
        target.mkdir(parents=True, exist_ok=True)
        written = [save(figure, target / f"{name}.png", dpi) for name, _, figure in plots_of(calibration)]
    return written


def plots_of(calibration: Calibration) -> Iterator[tuple[str, str, Figure]]:
    """For each figure the name of its file, a heading, and the figure."""
    for page, first in enumerate(range(0, len(calibration.curves), CHANNELS_ON_A_PAGE), start=1):
        some = calibration.curves[first : first + CHANNELS_ON_A_PAGE]
        name = "measured" if len(calibration.curves) <= CHANNELS_ON_A_PAGE else f"measured_{page}"
        yield name, "Measured and simulated", plot_signals(some)
    yield "residual_spectra", "Spectra of the remaining difference", plot_residual_spectra(calibration.curves)
    yield "intervals", "Parameters", plot_intervals(calibration)


def plot_signals(curves: Sequence[ChannelCurves]) -> Figure:
    """Measured signals over those of the robot before and after, a row for each channel; held-out parts in grey."""
    columns = max(curve.measured.shape[1] for curve in curves)
    figure = new_figure(3.6 * columns + 1.0, 2.3 * len(curves) + 0.4)
    grid = figure.subplots(len(curves), columns, squeeze=False, sharex=True)
    for row, curve in zip(grid, curves, strict=True):
        for c, axes in enumerate(row):
            if c >= curve.measured.shape[1]:
                axes.set_axis_off()
                continue
            for n, (begin, end) in enumerate(_ranges(curve)):
                axes.axvspan(begin, end, color="#e4e4e4", zorder=0, label="" if n else "held out")
            axes.plot(curve.times, curve.measured[:, c], ".", color=LIMIT, markersize=1.5, label="measured")
            for values, color, style, label in (
                (curve.before, BEFORE, "--", "as in the shot"),
                (curve.after, AFTER, "-", "calibrated"),
            ):
                axes.plot(curve.times, values[:, c], color=color, linewidth=0.9, linestyle=style, label=label)
            name = f" {COMPONENTS[c]}" if curve.measured.shape[1] > 1 else ""
            tidy(axes, f"[{curve.unit}]", f"{_title(curve)}{name}")
    grid[0][0].legend(fontsize=SMALL, frameon=False)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]", fontsize=SMALL)
    return figure


def plot_residual_spectra(curves: Sequence[ChannelCurves]) -> Figure:
    """Amplitude spectra of what the robot does not explain, before and after."""
    figure = new_figure(7.0, 2.2 * len(curves) + 0.4)
    for axes, curve in zip(figure.subplots(len(curves), 1, squeeze=False)[:, 0], curves, strict=True):
        for values, color, label, style in (
            (curve.before, BEFORE, "as in the shot", "--"),
            (curve.after, AFTER, "calibrated", "-"),
        ):
            frequencies, amplitudes = _spectrum(curve.times, curve.measured - values)
            axes.semilogy(frequencies, amplitudes, color=color, linewidth=0.9, linestyle=style, label=label)
        tidy(axes, f"amplitude [{curve.unit}]", _title(curve))
    first = figure.axes[0]
    first.legend(fontsize=SMALL, frameon=False)
    figure.axes[-1].set_xlabel("frequency [Hz]", fontsize=SMALL)
    return figure


def plot_intervals(calibration: Calibration) -> Figure:
    """Two standard deviations of each parameter of the robot before and after, in those of its prior."""
    items = [item for item in calibration.estimates if item.of_robot]
    figure = new_figure(6.5, 0.42 * len(items) + 1.0)
    axes = figure.subplots()
    for k, item in enumerate(items):
        prior = item.prior
        middle, half = (item.value - item.nominal) / prior, 2.0 * item.standard_deviation / prior
        axes.plot([-2.0, 2.0], [k, k], color=LIMIT, linewidth=5.0, alpha=0.3, solid_capstyle="butt")
        color = INTENDED if item.identifiable else BEFORE
        axes.errorbar(middle, k, xerr=half, fmt="o", color=color, markersize=3.5, capsize=3.0)
    names = [f"{item.kind} {short(item.path)}{item.name[len(item.kind) + len(item.path) + 1 :]}" for item in items]
    axes.set_yticks(range(len(items)), names)
    axes.set_ylim(len(items) - 0.4, -0.6)  # the first one on top
    tidy(axes, "", "95% intervals: before (grey), after (green; orange: not identifiable)")
    axes.set_xlabel("difference from the shot, in standard deviations of the prior", fontsize=SMALL)
    return figure


def _title(curve: ChannelCurves) -> str:
    kind, _, path = curve.name.partition(" ")
    return f"{kind} {short(path)}"


def _ranges(curve: ChannelCurves) -> list[tuple[float, float]]:
    """Ranges of times that were held out."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], curve.held_out.astype(int), [0]])))
    return [(float(curve.times[a]), float(curve.times[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _spectrum(times: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] and amplitudes of the components together, over even times."""
    step = float(np.median(np.diff(times)))
    even = np.arange(times[0], times[-1], step)
    total = np.zeros(len(even) // 2 + 1)
    for column in values.T:
        known = np.isfinite(column)
        if known.sum() > 1:
            samples = np.interp(even, times[known], column[known])
            window = np.hanning(len(even))
            total += np.abs(np.fft.rfft(window * (samples - samples.mean()))) ** 2 / max(window.sum(), 1.0) ** 2
    return np.fft.rfftfreq(len(even), step)[1:], 2.0 * np.sqrt(total)[1:] + 1e-300
