"""The figure of `gradients`: error of both adjoints against run time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calmotion.benchmarks.common.drawing import mark_measured, plain, save

if TYPE_CHECKING:
    from calmotion.benchmarks.integrators.gradient_error import GradientError

COLORS = {"discrete": "#0072b2", "continuous": "#d55e00"}


def draw(folder: str, measured: Sequence[GradientError]) -> str:
    """Draw to `<folder>/gradients.png` and return the path."""
    from matplotlib.figure import Figure

    shots = list(dict.fromkeys(row.shot for row in measured))
    figure = Figure(figsize=(0.8 + 4.2 * len(shots), 3.8), layout="constrained")
    axes = figure.subplots(1, len(shots), squeeze=False, sharey=True)[0]
    for panel, shot in zip(axes, shots, strict=True):
        for name, color in COLORS.items():
            rows = [row for row in measured if (row.shot, row.adjoint) == (shot, name)]
            times = [row.forward_s + row.gradient_s for row in rows]
            same, fine = [row.same_step for row in rows], [row.fine for row in rows]
            panel.loglog(times, same, "o-", color=color, lw=1.2, ms=4, label=f"{name}, of what is simulated")
            panel.loglog(times, fine, "s--", color=color, lw=1.2, ms=4, mfc="white", label=f"{name}, of the fine limit")
        rows = [row for row in measured if (row.shot, row.adjoint) == (shot, "discrete")]
        times = [row.forward_s + row.gradient_s for row in rows]
        panel.loglog(times, [row.floor for row in rows], ":", color="#777777", lw=1.2, label="floor of the differences")
        panel.set_title(f"{shot}, steps of 1/{1.0 / rows[0].step_s:.0f} to 1/{1.0 / rows[-1].step_s:.0f} s", fontsize=9)
        mark_measured(panel, times, [f"{seconds:.2g}" for seconds in times])
        panel.set_xlabel("simulation and gradient [s]")
    plain(axes)
    axes[0].set_ylabel("error of directional derivatives, relative")
    axes[-1].legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return save(figure, folder, "gradients")
