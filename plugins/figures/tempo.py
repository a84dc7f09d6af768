"""The tempo of a performance over time, and what makes it slower."""

from __future__ import annotations

import numpy as np
from calmotion.model import Character, Retimed
from calmotion.views import AFTER, BEFORE, LIMIT, SMALL, new_figure, tidy, titles
from matplotlib.figure import Figure

WIDTH, HEIGHT = 9.0, 3.6
POINTS = 2000
MOST_REASONS = 2  # that are named at a stretch


def plot_tempo(character: Character, retimed: Retimed) -> Figure:
    """Tempo [% of the animation's] over the performance; stretches with what they are for, and pinned times."""
    tempo, names = retimed.animation.tempo, titles([motor.path for motor in character.motors])
    assert tempo is not None
    figure = new_figure(WIDTH, HEIGHT)
    axes = figure.subplots()
    times = np.linspace(0.0, float(tempo.animation[-1]), POINTS)
    shown = tempo.performed(times)
    axes.plot(shown, 100.0 / tempo.stretch(times), color=AFTER, linewidth=1.5)
    axes.axhline(100.0, color=BEFORE, linewidth=0.8, linestyle="--")
    for part in retimed.report.stretches:
        start, end = tempo.performed(np.array([part.start, part.end]))
        axes.axvspan(start, end, color=LIMIT, alpha=0.12, linewidth=0.0)
        because = [f"{name} of {names[character.motors[motor].path]}" for motor, name in part.because[:MOST_REASONS]]
        axes.text(
            0.5 * (start + end), 0.03, "\n".join(because), fontsize=SMALL - 2, rotation=90, ha="center", va="bottom",
            transform=axes.get_xaxis_transform(),
        )  # fmt: skip
    for time, late in retimed.report.pins:
        axes.axvline(time + late, color=LIMIT, linewidth=1.0)
    tidy(
        axes,
        "tempo [%]",
        f"{tempo.added:.2f} s longer; nowhere faster, rigid links need {retimed.report.lower_bound:.2f} s",
    )
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.0)
    axes.set_xlabel("time of the performance [s]", fontsize=SMALL)
    return figure
