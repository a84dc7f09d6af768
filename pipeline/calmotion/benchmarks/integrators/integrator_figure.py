"""The figure of `integrators`: errors against steps, the stiff scene, and the damping of BDF2."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from calmotion.benchmarks.common.drawing import plain, save
from calmotion.shot.character import Array

if TYPE_CHECKING:
    from calmotion.benchmarks.integrators.integrator_errors import Measured

COLORS = {
    "bdf2": "#0072b2", "newmark": "#d55e00", "generalized-alpha": "#e69f00", "rk4": "#999999", "radau": "#009e73",
}  # fmt: skip


def draw(
    folder: str,
    measured: dict[str, list[Measured]],
    heights: dict[str, tuple[Array, Array]],
    damped: list[tuple[int, float, float]],
) -> str:
    """Draw to `<folder>/integrators.png` and return the path."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.5, 7.5), layout="constrained")
    axes = figure.subplots(2, 2).ravel()
    for panel, (name, rows) in zip(axes[:2], measured.items(), strict=True):
        _errors(panel, name, rows)
    for name, (times, values) in heights.items():
        axes[2].plot(times, values, color=COLORS[name], lw=1.2, label=name)
        if name != "bdf2":
            axes[2].plot(times[-1], values[-1], "x", color=COLORS[name], ms=9, mew=2)
    axes[2].set_title("Two thin steel links, steps of 1/240 s (x: fails)", loc="left", fontsize=10)
    axes[2].set_xlabel("time [s]")
    axes[2].set_ylabel("height of the load [m]")
    axes[2].legend(frameon=False, fontsize=8)
    counts, ratios, expected = zip(*damped, strict=True)
    axes[3].loglog(counts, ratios, "o", color=COLORS["bdf2"], label="measured")
    axes[3].loglog(counts, expected, "-", color=COLORS["bdf2"], lw=1, label="root of the integrator")
    axes[3].set_title("Damping ratio that BDF2 adds", loc="left", fontsize=10)
    axes[3].set_xlabel("steps in a period")
    axes[3].legend(frameon=False, fontsize=8)
    plain(axes)
    return save(figure, folder, "integrators")


def _errors(panel: Any, name: str, rows: list[Measured]) -> None:
    for integrator in dict.fromkeys(row.integrator for row in rows):
        selected = [row for row in rows if row.integrator == integrator]
        times, errors = [row.wall_s for row in selected], [row.position_error for row in selected]
        panel.loglog(times, errors, "o-", color=COLORS[integrator], lw=1.2, ms=4, label=integrator)
    panel.set_title(f"{name}: error against run time", loc="left", fontsize=10)
    panel.set_xlabel("run time [s]")
    panel.set_ylabel("largest error of the target [m]")
    panel.legend(frameon=False, fontsize=8)
