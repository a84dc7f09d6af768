"""The histogram of random shots by error over estimate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from calmotion.benchmarks.common.drawing import plain, save

LEAST, MOST, BINS = 0.01, 10.0, 30  # of the axis; ratios beyond are counted at its ends
HONEST, LIMIT = (0.05, 1.0), 1.5  # where estimates are to be, and what no error may exceed
INK, SAFE, UNDECIDED = "#22313f", "#4a86b8", "#c9d3dc"


def draw_estimates(folder: str, ratios: Sequence[float], decide: Sequence[bool]) -> str:
    """Draw the histogram to `<folder>/estimates.png`; returns the path.

    Args:
        folder: Where it is written.
        ratios: Error over estimate of each shot.
        decide: Whether the reference of each is known well enough.
    """
    from matplotlib.figure import Figure

    within = np.clip(ratios, LEAST, MOST)
    known = np.asarray(decide, dtype=bool)
    figure = Figure(figsize=(6.4, 3.0), layout="constrained")
    panel: Any = figure.subplots()
    edges = np.geomspace(LEAST, MOST, BINS + 1)
    panel.hist(
        [within[known], within[~known]], edges, stacked=True, color=[SAFE, UNDECIDED], edgecolor="white", linewidth=0.5,
        label=[f"{known.sum()} shots", f"{(~known).sum()} whose reference decides nothing"],
    )  # fmt: skip
    panel.axvspan(*HONEST, color=SAFE, alpha=0.1, lw=0, zorder=0)
    panel.axvline(LIMIT, color=INK, lw=1.0, ls=(0, (3, 2)))
    panel.set_xscale("log")
    panel.set_xlim(LEAST, MOST)
    ticks = (0.01, 0.05, 0.1, 0.2, 0.5, 1.0, 1.5, 3.0, 10.0)
    panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks], minor=False)
    panel.set_xticks([], minor=True)
    panel.yaxis.get_major_locator().set_params(integer=True)
    panel.set_xlabel("measured error over estimated error", color=INK)
    panel.set_ylabel("random shots", color=INK)
    panel.legend(frameon=False, loc="upper left", fontsize=8)
    plain([panel])
    return save(figure, folder, "estimates")
