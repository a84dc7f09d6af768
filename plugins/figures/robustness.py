"""How curves do on robots that differ from the model: distributions of the largest error, and what the model pays."""

from __future__ import annotations

import numpy as np
from calmotion.model import Character, Robustness
from calmotion.views import AFTER, BEFORE, INTENDED, SMALL, new_figure, tidy, titles
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .curves import WIDTH

SHOWN = {
    "before": ("as animated", BEFORE, "--"),
    "nominal": ("optimised for the model", INTENDED, "-."),
    "robust": ("robust", AFTER, "-"),
}
MOST = 3  # targets in a figure


def plot_robustness(character: Character, found: Robustness) -> Figure:
    """For each target, the share of random robots by their largest error [mm], and the largest by that on the model."""
    names = titles([target.path for target in character.targets])
    worst = np.argsort([-_largest(found.drawn["nominal"], k) for k in range(len(names))])[:MOST]
    figure = new_figure(WIDTH, 0.5 + 2.3 * len(worst))
    rows = figure.subplots(len(worst), 2, squeeze=False)
    for axes, k in zip(rows, sorted(worst), strict=True):
        _distributions(axes[0], found, k)
        tidy(axes[0], "share of the robots [%]", names[character.targets[k].path])
        _trade_off(axes[1], found, k)
        tidy(axes[1], "largest on any robot [mm]")
    rows[0, 0].legend(fontsize=SMALL, loc="upper left", frameon=False)
    rows[-1, 0].set_xlabel("largest error at the target [mm]", fontsize=SMALL)
    rows[-1, 1].set_xlabel("largest error on the model [mm]", fontsize=SMALL)
    return figure


def _distributions(axes: Axes, found: Robustness, target: int) -> None:
    for name, (label, color, line) in SHOWN.items():
        errors = np.sort(found.drawn[name][:, target])
        shares = 100.0 * np.arange(1, len(errors) + 1) / len(errors)
        known = np.isfinite(errors)  # robots that could not be simulated are missing above
        axes.step(1e3 * errors[known], shares[known], line, where="post", color=color, linewidth=1.5, label=label)
    axes.set_xscale("log")
    axes.set_ylim(0.0, 102.0)


def _trade_off(axes: Axes, found: Robustness, target: int) -> None:
    """The curves for the model and the robust ones, joined."""
    names = ("nominal", "robust")
    points = 1e3 * np.array([(found.nominal[name][target], _largest(found.drawn[name], target)) for name in names])
    axes.plot(points[:, 0], points[:, 1], color="#bbbbbb", linewidth=1.0, zorder=1)
    for name, point in zip(names, points, strict=True):
        axes.plot(*point, "o", color=SHOWN[name][1], markersize=6.0)
    axes.set_xlim(0.0, 1.25 * float(points[:, 0].max()))
    axes.set_ylim(bottom=0.0)


def _largest(drawn: np.ndarray, target: int) -> float:
    """The largest error of a target on robots that could be simulated [m]."""
    errors = drawn[:, target]
    return float(errors[np.isfinite(errors)].max(initial=0.0))
