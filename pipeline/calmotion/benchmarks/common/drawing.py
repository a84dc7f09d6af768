"""Common elements of the figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any


def plain(panels: Iterable[Any]) -> None:
    """A light grid and no frame above and to the right."""
    for panel in panels:
        panel.grid(True, which="major", lw=0.3, alpha=0.6)
        for side in ("top", "right"):
            panel.spines[side].set_visible(False)


def mark_measured(panel: Any, values: Sequence[float], labels: Sequence[str]) -> None:
    """Ticks at the measured values: labels of a logarithmic axis run into each other over a short range."""
    from matplotlib.ticker import NullFormatter

    panel.set_xticks(values, labels)
    panel.xaxis.set_minor_formatter(NullFormatter())


def save(figure: Any, folder: str, name: str) -> str:
    """Write a figure to `<folder>/<name>.png` and return the path."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    path = target / f"{name}.png"
    figure.savefig(path, dpi=150)
    return str(path)
