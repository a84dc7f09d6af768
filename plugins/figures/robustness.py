"""How curves do on robots that differ from the model: distributions of the largest error."""

import numpy as np
from calmotion.model import Character, Robustness
from calmotion.views import AFTER, BEFORE, CHANGE, SMALL, new_figure, tidy, titles
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .curves import WIDTH

SHOWN = {
    "before": ("as animated", BEFORE, "--"),
    "nominal": ("optimised for the model", CHANGE, "-."),
    "robust": ("robust", AFTER, "-"),
}
MOST = 3  # targets in a figure


def plot_robustness(character: Character, found: Robustness) -> Figure:
    """For each target, the share of random robots by their largest error [mm], and dots for that of the model."""
    names = titles([target.path for target in character.targets])
    worst = np.argsort([-_largest(found.drawn["nominal"], k) for k in range(len(names))])[:MOST]
    figure = new_figure(WIDTH, 0.5 + 2.3 * len(worst))
    rows = figure.subplots(len(worst), 1, squeeze=False)[:, 0]
    for axes, k in zip(rows, worst, strict=True):
        _distributions(axes, found, k)
        tidy(axes, "share of the robots [%]", names[character.targets[k].path])
    rows[0].legend(fontsize=SMALL, loc="upper left", framealpha=0.85, edgecolor="none")
    rows[-1].set_xlabel("largest error at the target [mm]; dots: on the model", fontsize=SMALL)
    return figure


def _distributions(axes: Axes, found: Robustness, target: int) -> None:
    for name, (label, color, line) in SHOWN.items():
        errors = np.sort(found.drawn[name][:, target, 0])
        shares = 100.0 * np.arange(1, len(errors) + 1) / len(errors)
        known = np.isfinite(errors)  # robots that could not be simulated are missing above
        axes.step(1e3 * errors[known], shares[known], line, where="post", color=color, linewidth=1.5, label=label)
        axes.plot(1e3 * found.nominal[name][target, 0], 0.0, "o", color=color, markersize=6.0, clip_on=False)
    axes.set_xscale("log")
    axes.set_ylim(0.0, 102.0)


def _largest(drawn: np.ndarray, target: int) -> float:
    """The largest error of a target on robots that could be simulated [m]."""
    errors = drawn[:, target, 0]
    return float(errors[np.isfinite(errors)].max(initial=0.0))
