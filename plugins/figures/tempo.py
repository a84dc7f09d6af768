"""The tempo of a performance over time, and what makes it slower; and the tempo that a robot would need."""

from pathlib import Path

import numpy as np
from calmotion.errors import file_access
from calmotion.model import Character, ExceededLimits, Retimed
from calmotion.views import AFTER, BEFORE, LIMIT, SMALL, new_figure, pace_of, save, tidy, titles
from matplotlib.axes import Axes
from matplotlib.figure import Figure

WIDTH, HEIGHT = 9.0, 3.6


def plot_tempo(character: Character, retimed: Retimed) -> Figure:
    """Tempo [% of the animation's] over the performance; stretches with what they are for, and pinned times."""
    pace = pace_of(character, retimed)
    assert pace is not None and retimed.animation.tempo is not None
    figure, axes = _empty()
    axes.plot(pace.times, pace.percent, color=AFTER, linewidth=1.5)
    axes.axhline(100.0, color=BEFORE, linewidth=0.8, linestyle="--")
    for part in pace.parts:
        axes.axvspan(part.start, part.end, color=LIMIT, alpha=0.12, linewidth=0.0)
        _tell(axes, 0.5 * (part.start + part.end), "\n".join(part.because))
    for time, late in retimed.report.pins:
        axes.axvline(time + late, color=LIMIT, linewidth=1.0)
    added, bound = retimed.animation.tempo.added, retimed.report.lower_bound
    longer = f"the performance takes {added:.2f} s more" if added >= 0.005 else "the performance takes no more time"
    _finish(axes, f"{longer} (at least {bound:.2f} s if no part may be faster)", "performance")
    return figure


def plot_needed_tempo(character: Character, exceeded: ExceededLimits) -> Figure:
    """Tempo [% of the animation's] over the animation that rigid links would allow, where only what must is slower;
    that of one tempo for the whole; and where each limit is exceeded most."""
    tempo, names = exceeded.tempo, titles([motor.path for motor in character.motors])
    assert tempo is not None and np.isfinite(tempo.uniform)
    figure, axes = _empty()
    axes.plot(tempo.times, 100.0 / tempo.stretch, color=AFTER, linewidth=1.5, label="only what must is slower")
    whole = f"one tempo: {tempo.uniform_added_s:.2f} s longer"
    axes.axhline(100.0 / tempo.uniform, color=BEFORE, linewidth=0.8, linestyle="--", label=whole)
    uses = [use for use in exceeded.uses if use.quantity != "position"]
    for use in sorted(uses, key=lambda use: use.time_s):
        axes.axvline(use.time_s, color=LIMIT, linewidth=0.8)
        text = f"{use.quantity} of {names[character.motors[use.motor].path]} +{use.excess:.0%}"
        _tell(axes, use.time_s, text, side="right")
    axes.legend(fontsize=SMALL, loc="upper right", frameon=False)
    _finish(axes, f"at least {tempo.least_added_s:.2f} s longer on rigid links", "animation")
    return figure


def write_needed_tempo(folder: str, character: Character, exceeded: ExceededLimits, dpi: int) -> str:
    """Write `tempo.png`; its path.

    Raises:
        ShotError: The folder cannot be written.
    """
    target = Path(folder)
    with file_access("the figure of the tempo cannot be written", folder, "Choose another --figures."):
        target.mkdir(parents=True, exist_ok=True)
        return save(plot_needed_tempo(character, exceeded), target / "tempo.png", dpi)


def _empty() -> tuple[Figure, Axes]:
    figure = new_figure(WIDTH, HEIGHT)
    return figure, figure.subplots()


def _tell(axes: Axes, time: float, text: str, side: str = "center") -> None:
    """A text upright, whose side is at a time."""
    axes.text(
        time, 0.03, text, fontsize=SMALL - 2, rotation=90, ha=side, va="bottom",
        transform=axes.get_xaxis_transform(),
    )  # fmt: skip


def _finish(axes: Axes, title: str, of_what: str) -> None:
    tidy(axes, "tempo [%]", title)
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.0)
    axes.set_xlabel(f"time of the {of_what} [s]", fontsize=SMALL)
