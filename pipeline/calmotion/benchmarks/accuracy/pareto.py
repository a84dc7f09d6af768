"""The Pareto front of error and run time, and ratios of run times to the fastest setting with the same error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from calmotion.benchmarks.accuracy.reference_bench import Point


def front(points: Sequence[Point]) -> list[Point]:
    """Those than which none is both faster and better, by run time."""
    front: list[Point] = []
    for point in sorted(points, key=lambda p: (p.wall_s, p.error_m)):
        if np.isfinite(point.error_m) and (not front or point.error_m < front[-1].error_m):
            front.append(point)
    return front


def over_fastest(points: Sequence[Point], tolerances: Sequence[float]) -> dict[float, tuple[float, Point]]:
    """How much longer the choice for each tolerance [m] takes than the fastest setting that keeps it, and that."""
    ratios = {}
    chosen = {p.setting: p for p in points if p.series == "tolerance"}
    for tolerance in tolerances:
        choice = chosen.get(setting_of(tolerance))
        if choice is not None:
            keeping = [p for p in points if p.series != "elements" and p.error_m <= tolerance]
            fastest = min(keeping, key=lambda p: p.wall_s, default=choice)
            ratios[tolerance] = choice.wall_s / fastest.wall_s, fastest
    return ratios


def setting_of(tolerance: float) -> str:
    """Name of what is chosen for a tolerance [m]."""
    return f"{1e3 * tolerance:g} mm"


def print_over_fastest(points: Sequence[Point], tolerances: Sequence[float]) -> None:
    """A line for each tolerance."""
    for tolerance, (ratio, fastest) in over_fastest(points, tolerances).items():
        print(
            f"{setting_of(tolerance)}: {ratio:.2f} times the run time of the fastest setting that keeps it "
            f"({fastest.series}, {fastest.setting}, {fastest.coordinates} coordinates)"
        )
