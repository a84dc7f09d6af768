"""The figure of `work_precision`: error against run time, the Pareto front, and the choices of the program."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .reference_bench import Point, front

COLORS = {
    "bdf2": "#0072b2", "newmark": "#d55e00", "generalized-alpha": "#e69f00", "rk4": "#999999",
}  # fmt: skip
STYLES = {
    **{name: (color, "o-") for name, color in COLORS.items()},
    "reduction": ("0.35", "x--"),
    "pairs": ("#882255", "p"),
    "directions": ("#f0e442", "P--"),
    "modes": ("#56b4e9", "s--"),
    "law": ("#cc79a7", "^:"),
}


def draw_work_precision(folder: str, points: Sequence[Point], bar: float) -> str:
    """Draw one shot to `<folder>/work_precision_<shot>.png` and return the path.

    Args:
        points: All of one shot.
        bar: Error of the reference [m].
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.6), layout="constrained")
    axes = figure.add_subplot()
    best = front(points)
    axes.step(
        [p.wall_s for p in best], [1e3 * p.error_m for p in best], where="post", color="0.8", lw=5, zorder=0,
        label="Pareto front",
    )  # fmt: skip
    for series, (color, style) in STYLES.items():
        in_series = [p for p in points if p.series == series and np.isfinite(p.error_m)]
        if not in_series:
            continue
        sizes = [0] if series not in COLORS else sorted({p.coordinates for p in in_series})
        for size in sizes:  # a line for each number of coordinates
            line = [p for p in in_series if p.coordinates == size] if size else in_series
            axes.loglog(
                [p.wall_s for p in line], [1e3 * p.error_m for p in line], style, color=color, ms=4, lw=1,
                label=series if size == sizes[0] else None,
            )  # fmt: skip
    chosen = [p for p in points if p.series == "tolerance"]
    axes.loglog(
        [p.wall_s for p in chosen], [1e3 * p.error_m for p in chosen], "D", color="black", ms=6, label="--tolerance"
    )
    for p in chosen:
        axes.annotate(p.setting, (p.wall_s, 1e3 * p.error_m), (6, -10), textcoords="offset points", fontsize=8)
    for p in points:
        if p.series == "default":
            axes.loglog(p.wall_s, 1e3 * p.error_m, "*", color="black", ms=14, label="default")
    low = min(axes.get_ylim()[0], 0.5e3 * bar)
    axes.axhspan(low, 1e3 * bar, color="0.93", zorder=-1)
    axes.set_ylim(bottom=low)
    axes.annotate("error of the reference", (0.01, 1e3 * bar), xycoords=("axes fraction", "data"), fontsize=7, va="top")
    axes.set_xlabel("run time of the simulation [s]")
    axes.set_ylabel("largest error of any target [mm]")
    axes.set_title(f"{points[0].shot}, simulated as animated", loc="left", fontsize=10)
    figure.legend(frameon=False, fontsize=8, loc="outside right upper")  # over the points it would hide some
    axes.grid(True, which="major", lw=0.3, alpha=0.6)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    Path(folder).mkdir(parents=True, exist_ok=True)
    path = Path(folder) / f"work_precision_{points[0].shot}.png"
    figure.savefig(path, dpi=150)
    return str(path)
