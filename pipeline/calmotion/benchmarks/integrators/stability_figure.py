"""Maps of stability, one panel for each integrator."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from calmotion.benchmarks.common.drawing import save
from calmotion.benchmarks.integrators.outcomes import FAILED, REFUSED, RUNS
from calmotion.benchmarks.integrators.stability_map import BEGINNING, BRIEFLY, Cell, largest_steps, step_name

# told apart by people who do not see red and green apart, and by their lightness
COLORS = {RUNS: "#a6cee3", REFUSED: "#f6dfa4", FAILED: "#a50026"}
INK, LINE = "#22313f", "#0b3c6f"
MEANINGS = {RUNS: "runs: largest error of the tip [mm]", REFUSED: "refused with a reason", FAILED: "failed"}


def draw_map(folder: str, name: str, quantity: str, cells: Sequence[Cell]) -> str:
    """Draw a map to `<folder>/stability_<name>.png`; returns the path.

    A thick line is the boundary of the panel's integrator, a dashed one that of BDF2.
    """
    from matplotlib.figure import Figure

    integrators = list(dict.fromkeys(cell.integrator for cell in cells))
    values = list(dict.fromkeys(cell.value for cell in cells))
    steps = {i: list(dict.fromkeys(cell.step_s for cell in cells if cell.integrator == i)) for i in integrators}
    widths = [len(steps[i]) for i in integrators]
    figure = Figure(
        figsize=(1.4 + 0.52 * sum(widths) + 0.2 * len(widths), 1.9 + 0.4 * len(values)), layout="constrained"
    )
    panels = figure.subplots(1, len(integrators), sharey=True, squeeze=False, width_ratios=widths)[0]
    default = [cell for cell in cells if cell.integrator == integrators[0]]
    for panel, integrator in zip(panels, integrators, strict=True):
        selected = [cell for cell in cells if cell.integrator == integrator]
        for cell in selected:
            _tile(panel, steps[integrator].index(cell.step_s), values.index(cell.value), cell)
        _boundary(panel, selected, steps[integrator], values, color=LINE, lw=2.4)
        if integrator != integrators[0]:
            _boundary(panel, default, steps[integrator], values, color=INK, lw=1.1, ls=(0, (3, 2)))
        panel.set_xlim(-0.5, len(steps[integrator]) - 0.5)
        panel.set_ylim(len(values) - 0.5, -0.5)
        panel.set_xticks(range(len(steps[integrator])), [step_name(s) for s in steps[integrator]], rotation=60)
        panel.set_yticks(range(len(values)), [f"{value:g}" for value in values])
        panel.tick_params(length=0, labelsize=8, colors=INK)
        brief = min(steps[integrator]) < 0.999 * BRIEFLY
        note = f" (below {step_name(BRIEFLY)} s: {BEGINNING} steps, before the arm moves)" if brief else ""
        panel.set_title(integrator + note, fontsize=9, color=INK)
        for side in panel.spines.values():
            side.set_visible(False)
    panels[0].set_ylabel(quantity, color=INK)
    figure.supxlabel("step [s]", fontsize=10, color=INK)
    _legend(figure)
    return save(figure, folder, f"stability_{name}")


def _tile(panel: Any, x: float, y: float, cell: Cell) -> None:
    from matplotlib.patches import Rectangle

    panel.add_patch(Rectangle((x - 0.47, y - 0.46), 0.94, 0.92, color=COLORS[cell.outcome], linewidth=0))
    if cell.outcome == RUNS and cell.error_m is not None:
        error = 1e3 * cell.error_m
        text = f"{error:.0f}" if error >= 10.0 else f"{error:.1f}" if error >= 0.1 else "<0.1"
        panel.text(x, y, text, ha="center", va="center", fontsize=7, color=INK)
    elif cell.outcome == FAILED:
        panel.text(x, y, "!", ha="center", va="center", fontsize=9, color="white", weight="bold")


def _boundary(panel: Any, cells: Sequence[Cell], steps: Sequence[float], values: Sequence[float], **style: Any) -> None:
    """A line left of the largest step from which on all smaller ones run."""
    limits = largest_steps(cells)
    points: list[tuple[float, float]] = []
    for row, value in enumerate(values):
        largest = limits.get(value)
        at = sum(step > largest * 1.001 for step in steps) if largest is not None else len(steps)
        points += [(at - 0.5, row - 0.5), (at - 0.5, row + 0.5)]
    panel.plot(*zip(*points, strict=True), solid_joinstyle="miter", clip_on=False, **style)


def _legend(figure: Any) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Any] = [Patch(color=color, label=MEANINGS[outcome]) for outcome, color in COLORS.items()]
    entries += [
        Line2D([], [], color=LINE, lw=2.4, label="boundary of this integrator"),
        Line2D([], [], color=INK, lw=1.1, ls=(0, (3, 2)), label="that of BDF2"),
    ]
    figure.legend(handles=entries, loc="outside upper left", ncols=5, fontsize=8, frameon=False, labelcolor=INK)
