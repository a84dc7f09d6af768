"""Style and saving of figures, without changes of the global state of matplotlib."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from calmotion.support.files import replaced
from calmotion.support.naming import distinct_names

# Okabe and Ito's colors, which color-blind readers can tell apart; the line styles differ as well.
BEFORE, AFTER, INTENDED = "#d55e00", "#0072b2", "#009e73"
CHANGE = "#8e4585"  # of motors, by the optimiser
LIMIT = "#7f7f7f"
TEXT = "#222222"
SMALL, NORMAL = 8.0, 9.5
LONGEST = 40  # letters of a title that leave room for what is beside it


def new_figure(width: float, height: float) -> Figure:
    """A white figure without a window; width and height [inch]."""
    figure = Figure(figsize=(width, height), facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def tidy(axes: Axes, label: str, title: str = "") -> None:
    """Grid, thin frame, unit on the vertical axis."""
    axes.set_ylabel(label, fontsize=SMALL)
    if title:
        axes.set_title(title, fontsize=NORMAL, loc="left", color=TEXT)
    axes.tick_params(labelsize=SMALL, length=3)
    axes.grid(True, color="#e4e4e4", linewidth=0.7)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def titles(paths: Sequence[str]) -> dict[str, str]:
    """What stands above the panel of each prim path: the path, or where one is long, the ends that tell them apart."""
    return {path: path for path in paths} if max(map(len, paths), default=0) <= LONGEST else distinct_names(paths)


def save(figure: Figure, path: Path, dpi: int) -> str:
    """Write the figure atomically; the same figure always gives the same bytes."""
    with replaced(path) as temporary:
        figure.savefig(temporary, dpi=dpi, metadata={"Software": None})
    return str(path)


def short(path: str, parts: int = 1) -> str:
    """The last names of a prim path."""
    return "/".join(path.rsplit("/", parts)[-parts:])
