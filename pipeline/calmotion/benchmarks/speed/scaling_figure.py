"""The figure of `scaling`: laws of growth, and run time against error beside Exudyn and MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calmotion.benchmarks.common.drawing import mark_measured, plain, save

if TYPE_CHECKING:
    from calmotion.benchmarks.scenes.exudyn_arm import Run
    from calmotion.benchmarks.speed.growth import Growth

BLUE = "#0072b2"
COLORS = {"exudyn": "#d55e00", "mujoco": "#009e73", "ours, bdf2": BLUE, "ours, generalized-alpha": "#e69f00"}


def draw(folder: str, measured: Sequence[Growth], peers: Sequence[Run]) -> str:
    """Draw to `<folder>/scaling.png` and return the path."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    count = len(measured) + bool(peers)
    figure = Figure(figsize=(3.6 * count, 3.4), layout="constrained")
    axes = figure.subplots(1, count, squeeze=False)[0]
    for panel, growth in zip(axes, measured, strict=False):
        panel.loglog(growth.values, [1e3 * seconds for seconds in growth.seconds], "o-", color=BLUE, lw=1.2, ms=4)
        panel.set_title(f"exponent {growth.exponent:.2f}", loc="left", fontsize=10)
        panel.set_xlabel(growth.name)
        mark_measured(panel, growth.values, [f"{value:,}" for value in growth.values])
        panel.yaxis.set_minor_formatter(NullFormatter())
        panel.set_ylabel("whole simulation [ms]" if growth.name == "steps" else "step [ms]")
    for code in dict.fromkeys(run.code for run in peers):
        selected = [run for run in peers if run.code == code]
        times, errors = [run.wall_s for run in selected], [run.error for run in selected]
        axes[-1].loglog(times, errors, "o-", color=COLORS[code], lw=1.2, ms=4, label=code)
    if peers:
        axes[-1].set_title("the swung arm, 14 coordinates", loc="left", fontsize=10)
        axes[-1].set_xlabel("run time [s]")
        axes[-1].set_ylabel("largest error of the tip [m]")
        axes[-1].legend(frameon=False, fontsize=8)
    plain(axes)
    return save(figure, folder, "scaling")
