"""Figures of curves as data that a page draws: the same lines, labels and limits that Matplotlib would draw."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.views import AFTER, BEFORE, CHANGE, INTENDED, LIMIT
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator

from .packing import Packing

COLORS = {"before": BEFORE, "after": AFTER, "intended": INTENDED, "change": CHANGE, "limit": LIMIT}
ROLES = {color: f"var(--{name})" for name, color in COLORS.items()}  # so that the page has them in light and dark
POINTS = 1600  # of a curve, two for each part of its width
ROOM = 2_000_000  # letters of all charts; with more of them, each curve has fewer points


def charts_of(plots: Sequence[tuple[str, Figure]]) -> dict[str, Any]:
    """Groups of panels under their headings, with the numbers of the curves in `arrays`."""
    points = POINTS
    while True:
        packing = Packing()
        groups: dict[str, list[dict[str, Any]]] = {}
        for heading, figure in plots:
            groups.setdefault(heading, []).extend(_panels(figure, packing, points))
        text = packing.text()
        if len(text) <= ROOM or points < 100:
            named = [{"title": heading, "panels": panels} for heading, panels in groups.items() if panels]
            return {"groups": named, "arrays": text}
        points //= 2


def _panels(figure: Figure, packing: Packing, points: int) -> Iterator[dict[str, Any]]:
    """One for each axes that has curves; titles and labels that a figure writes once are those of all its rows."""
    drawn = [axes for axes in figure.axes if axes.axison and axes.get_lines()]
    columns: dict[float, str] = {}
    for axes in drawn:
        key = round(axes.get_position().x0, 3) if len({axes.get_xlabel() for axes in drawn} - {""}) > 1 else 0.0
        columns[key] = axes.get_xlabel() or columns.get(key, "")
    for axes in drawn:
        key = round(axes.get_position().x0, 3) if len(columns) > 1 else 0.0
        yield _panel(axes, axes.get_xlabel() or columns.get(key, ""), packing, points)


def _panel(axes: Axes, xlabel: str, packing: Packing, points: int) -> dict[str, Any]:
    curves, marks = [], []
    for line in axes.get_lines():
        along_x, along_y = line.get_transform().contains_branch_seperately(axes.transData)
        x, y = (np.asarray(values, dtype=float) for values in (line.get_xdata(orig=False), line.get_ydata(orig=False)))
        if along_x and along_y:
            curves.append(_curve(line, x, y, packing, points))
        elif len(x):
            at = {"x": float(x[0])} if along_x else {"y": float(y[0])}
            marks.append(at | {"color": _color(line.get_color()), "label": _label(line)})
    spans = [
        [low, high, "".join(text.get_text() for text in axes.texts if low <= text.get_position()[0] <= high)]
        for patch in axes.patches
        if patch.get_data_transform().contains_branch_seperately(axes.transData) == (True, False)
        for low, high in [patch.get_extents().transformed(axes.transData.inverted()).intervalx.tolist()]
    ]
    bars = [
        {"points": segment.tolist(), "color": _color(collection.get_color()[0])}
        for collection in axes.collections
        if isinstance(collection, LineCollection)
        for segment in collection.get_segments()
    ]
    named = isinstance(axes.yaxis.get_major_locator(), FixedLocator)
    labels = [label.get_text() for label in axes.get_yticklabels()] if named else []
    rows = zip(axes.get_yticks().tolist() if named else [], labels, strict=True)
    return {
        "title": axes.get_title(loc="left") or axes.get_title(),
        "more": axes.get_title(loc="right"),
        "xlabel": xlabel,
        "ylabel": axes.get_ylabel(),
        "xlog": axes.get_xscale() == "log",
        "ylog": axes.get_yscale() == "log",
        "xlim": [float(v) for v in axes.get_xlim()],
        "ylim": [float(v) for v in axes.get_ylim()],
        "curves": curves,
        "marks": marks,
        "spans": spans,
        "bars": bars,
        "rows": [[at, name] for at, name in rows],
    }


def _curve(line: Line2D, x: Array, y: Array, packing: Packing, points: int) -> dict[str, Any]:
    dots = line.get_linestyle() in ("None", "", " ")
    if not dots and len(x) > points and np.all(np.diff(x) >= 0.0):
        rows = thinned(y, points)
        x, y = x[rows], y[rows]
    return {
        "label": _label(line),
        "color": _color(line.get_color()),
        "dashed": line.get_linestyle() not in ("-", "solid"),
        "dots": dots,
        "x": packing.exact(x),
        "y": packing.exact(y),
    }


def thinned(y: Array, points: int) -> Array:
    """Rows of a curve that keep its peaks: the lowest and the highest of each of `points / 2` equal parts."""
    edges = np.linspace(0, len(y), points // 2 + 1).astype(int)
    parts = [np.arange(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True) if b > a]
    known = np.where(np.isfinite(y), y, 0.0)
    rows = [part[[np.argmin(known[part]), np.argmax(known[part])]] for part in parts]
    return np.unique(np.concatenate([*rows, [0, len(y) - 1]]).astype(int))


def _label(line: Line2D) -> str:
    label = str(line.get_label())
    return "" if label.startswith("_") else label


def _color(color: Any) -> str:
    found = to_hex(color)
    return ROLES.get(found, found)
