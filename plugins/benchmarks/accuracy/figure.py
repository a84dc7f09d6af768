"""The figure of `work_precision`: error against run time, the Pareto front, and the choices of the program."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .reference_bench import Point, front

# integrators have a line for each number of coordinates
INTEGRATORS = ("bdf2", "newmark", "generalized-alpha", "rk4")
MARKERS = {name: "o-" for name in INTEGRATORS}
MARKERS |= {"reduction": "x--", "pairs": "p", "directions": "P--", "modes": "s--", "law": "^:"}
MARKERS |= {"tolerance": "D", "default": "*"}


def draw_work_precision(folder: str, points: Sequence[Point], bar: float) -> str:
    """Draw one shot to `<folder>/work_precision_<shot>.png` and return the path.

    Args:
        points: All of one shot.
        bar: Error of the reference [m].
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.6), layout="constrained")
    axes = figure.add_subplot(xlabel="run time of the simulation [s]", ylabel="largest error of any target [mm]")
    best = front(points)
    walls, errors = [p.wall_s for p in best], [1e3 * p.error_m for p in best]
    axes.step(walls, errors, where="post", color="0.8", lw=5, zorder=0, label="Pareto front")
    for number, (series, marker) in enumerate(MARKERS.items()):
        own = [p for p in points if p.series == series and np.isfinite(p.error_m)]
        color = "black" if series in ("tolerance", "default") else f"C{number}"
        for size in sorted({p.coordinates if series in INTEGRATORS else 0 for p in own}):
            line = [p for p in own if size in (0, p.coordinates)]
            walls, errors = [p.wall_s for p in line], [1e3 * p.error_m for p in line]
            axes.loglog(walls, errors, marker, color=color, ms=5, lw=1, label=series if line[0] is own[0] else None)
        if series == "tolerance":
            for p in own:
                axes.annotate(p.setting, (p.wall_s, 1e3 * p.error_m), (6, -10), textcoords="offset points", fontsize=8)
    low = min(axes.get_ylim()[0], 0.5e3 * bar)
    axes.axhspan(low, 1e3 * bar, color="0.93", zorder=-1, label="error of the reference")
    axes.set_ylim(bottom=low)
    axes.set_title(f"{points[0].shot}, simulated as animated", loc="left", fontsize=10)
    figure.legend(frameon=False, fontsize=8, loc="outside right upper")  # over the points it would hide some
    axes.grid(True, which="major", lw=0.3, alpha=0.6)
    Path(folder).mkdir(parents=True, exist_ok=True)
    path = Path(folder) / f"work_precision_{points[0].shot}.png"
    figure.savefig(path, dpi=150)
    return str(path)
