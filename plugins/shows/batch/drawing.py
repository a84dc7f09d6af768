"""Figures of a batch: the largest error of each shot, before and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from calmotion.views import AFTER, BEFORE, SMALL, new_figure, tidy
from matplotlib.figure import Figure


def plots_of(jobs: Sequence[dict[str, Any]]) -> list[tuple[str, Figure]]:
    """Figures under their headings; none without a shot that has a result."""
    shown = [job for job in jobs if job["outcome"] in ("done", "kept") and _before(job)]
    if not shown:
        return []
    figure = new_figure(7.0, 0.35 * len(shown) + 1.0)
    axes = figure.subplots()
    rows = range(len(shown))
    axes.plot([1e3 * _before(job) for job in shown], rows, "o", color=BEFORE, label="as animated")
    after = [(1e3 * job["max_error_after_m"], row) for row, job in zip(rows, shown, strict=True) if _after(job)]
    if after:
        axes.plot(*zip(*after, strict=True), "o", color=AFTER, label="optimised")
    axes.set_xscale("log")
    axes.set_yticks(rows, [job["name"] for job in shown])
    axes.set_ylim(len(shown) - 0.4, -0.6)  # the first one on top
    tidy(axes, "", "")
    axes.set_xlabel("largest error at a target [mm]", fontsize=SMALL)
    axes.legend(fontsize=SMALL, frameon=False)
    return [("Largest error of each shot", figure)]


def _before(job: dict[str, Any]) -> float:
    return float(job.get("max_error_before_m") or job.get("max_error_m") or 0.0)


def _after(job: dict[str, Any]) -> float:
    return float(job.get("max_error_after_m") or 0.0)
