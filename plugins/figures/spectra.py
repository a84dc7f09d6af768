"""Spectra of the errors before and after, with the natural frequencies of the character."""

from __future__ import annotations

import numpy as np
from calmotion.model import Character, Result, SystemModes
from calmotion.views import LIMIT, SMALL, error_spectrum, highest_frequency, new_figure, tidy, titles
from matplotlib.figure import Figure

from .curves import WIDTH, runs_of, worst_targets

DECADES = 5.0  # of the vertical axis
NEAR = 0.05  # of the width: distance below which labels are joined
LETTER = 0.0065  # of the width: that of a letter of a label
ROOM = 1.15  # end of the axis over the highest significant frequency


def plot_spectra(character: Character, result: Result, modes: SystemModes | None) -> Figure:
    """Amplitude of the position error of each target [mm] by frequency [Hz]."""
    shown = worst_targets(result)
    names = titles([target.path for target in character.targets])
    figure = new_figure(WIDTH, 0.7 + 2.1 * len(shown))
    all_axes = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    end = 1.0
    for axes, k in zip(all_axes, shown, strict=True):
        largest = 0.0
        for simulation, color, line, name in runs_of(result):
            frequencies, amplitudes = error_spectrum(simulation.motion, result.reference, k)
            axes.semilogy(frequencies[1:], 1e3 * amplitudes[1:], line, color=color, linewidth=1.5, label=name)
            largest = max(largest, 1e3 * float(amplitudes.max(initial=0.0)))
            if simulation is result.before:
                end = max(end, ROOM * highest_frequency(frequencies, amplitudes))
        tidy(axes, "amplitude [mm]", names[character.targets[k].path])
        if largest > 0.0:
            axes.set_ylim(largest * 10.0**-DECADES, 3.0 * largest)
        axes.margins(x=0.0)
    marked = [] if modes is None else [float(f) for f in modes.frequencies if f < end]
    for axes in all_axes:
        axes.set_xlim(0.0, end)
        for n, frequency in enumerate(marked):
            label = mode_label(modes) if n == 0 else None
            axes.axvline(frequency, color=LIMIT, linewidth=1.0, linestyle=":", label=label)
        for group in grouped(marked, NEAR * end, LETTER * end, end):
            inside = group[-1] + LETTER * end * len(label_of(group)) < end
            axes.annotate(
                label_of(group), (group[-1] if inside else group[0], 1.0),
                xycoords=("data", "axes fraction"), xytext=(2 if inside else -2, -2), textcoords="offset points",
                fontsize=SMALL - 1.0, color=LIMIT, va="top", ha="left" if inside else "right",
            )  # fmt: skip
    # above the axes: inside, it would cover a curve or a mode
    all_axes[0].legend(
        fontsize=SMALL, loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=3, frameon=False, borderaxespad=0.0
    )
    all_axes[-1].set_xlabel("frequency [Hz]", fontsize=SMALL)
    return figure


def mode_label(modes: SystemModes | None) -> str:
    """Which pose the frequencies are those of."""
    if modes is None or modes.time_s <= 0.0:
        return "modes in the first pose"
    return f"modes in the pose at {modes.time_s:.2f} s (largest error)"


def label_of(group: list[float]) -> str:
    """The frequencies of a group as a text: each of up to two, and of more the range and their number."""
    if len(group) > 2:
        return f"{group[0]:.1f}–{group[-1]:.1f} ({len(group)})"
    return ", ".join(f"{frequency:.1f}" for frequency in group)


def grouped(values: list[float], gap: float, letter: float = 0.0, end: float = np.inf) -> list[list[float]]:
    """Ascending values in groups, with less than `gap` between successive values of a group.

    A value that the label of a group would cover, which begins at the last of the group, joins it; `letter` is the
    width of one. The label of the last group stands before it where it would reach beyond `end`.
    """
    groups: list[list[float]] = []
    for value in values:
        if groups and value - groups[-1][-1] < max(gap, letter * (2 + len(label_of(groups[-1])))):
            groups[-1].append(value)
        else:
            groups.append([value])
    if len(groups) > 1:
        before, last = groups[-2:]
        wide = letter * len(label_of(last))
        if last[-1] + wide >= end and before[-1] + letter * (1 + len(label_of(before))) > last[0] - wide:
            groups[-2:] = [before + last]
    return groups
