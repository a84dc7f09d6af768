"""Where simulations are stable: maps of the swung arm over stiffness, step, speed and load."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .beam_arm import beam_arm, quintic, shot_of
from .stability import FAILED, REFUSED, RUNS, Case, Outcome, run_case

STEPS = (1 / 24, 1 / 48, 1 / 120, 1 / 240, 1 / 480, 1 / 2400)
COLORS = {RUNS: "#4c9f70", REFUSED: "#e9c46a", FAILED: "#d1495b"}
INK = "#22313f"

# name of the row's quantity, its values, and the scene for one of them
Rows = tuple[str, tuple[float, ...], Callable[[float], Any]]


def _swung(seconds: float = 0.5, **arm: Any) -> Any:
    return beam_arm(**arm, modes=8, elasticity="stvk"), shot_of(quintic(np.pi / 2, seconds), 1.0)


MODULI = (1e12, 1e11, 1e10, 3e9, 1e9, 3e8, 1e8, 3e7, 1e7)
MAPS: dict[str, Rows] = {
    "stiffness": ("Young's modulus [Pa]", MODULI, lambda modulus: _swung(youngs_modulus=modulus)),
    "speed": ("quarter turn in [s]", (1.0, 0.5, 0.25, 0.125, 0.0625), _swung),
    "load": ("load over arm", (1e-6, 1e-3, 1.0, 3.0, 10.0, 1e3), lambda ratio: _swung(payload=0.288 * ratio)),
}


def outcomes(rows: Rows, steps: tuple[float, ...] = STEPS) -> list[list[Outcome]]:
    """One for each value and step."""
    name, values, scene = rows
    return [[run_case(Case(name, f"{value:g}", partial(scene, value), step)) for step in steps] for value in values]


def draw_maps(folder: str, maps: dict[str, Rows] | None = None, steps: tuple[float, ...] = STEPS) -> list[str]:
    """Draw each map to `<folder>/stability_<name>.png`; returns the paths.

    A tile tells the largest error of the tip [mm], or that the scene was refused.
    """
    from matplotlib.figure import Figure

    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    written = []
    for name, rows in (MAPS if maps is None else maps).items():
        found = outcomes(rows, steps)
        figure = Figure(figsize=(1.3 + 1.0 * len(steps), 1.5 + 0.42 * len(found)), layout="constrained")
        axes = figure.add_subplot()
        for i, line in enumerate(found):
            for k, outcome in enumerate(line):
                axes.add_patch(_tile(k, i, COLORS[outcome.outcome]))
                text = outcome.outcome if not outcome.steps else f"{1e3 * outcome.error_m:.3g}"
                axes.text(k, i, text, ha="center", va="center", fontsize=8, color=INK)
        axes.set_xlim(-0.5, len(steps) - 0.5)
        axes.set_ylim(len(found) - 0.5, -0.5)
        axes.set_xticks(range(len(steps)), [f"1/{round(1 / step)}" for step in steps])
        axes.set_yticks(range(len(found)), [f"{value:g}" for value in rows[1]])
        axes.set_xlabel("step [s]")
        axes.set_ylabel(rows[0])
        axes.tick_params(length=0)
        for side in axes.spines.values():
            side.set_visible(False)
        axes.set_title("Largest error of the tip [mm], or refused with a reason", loc="left", fontsize=9, color=INK)
        path = target / f"stability_{name}.png"
        figure.savefig(path, dpi=160)
        written.append(str(path))
    return written


def _tile(x: float, y: float, color: str) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.48, y - 0.46), 0.96, 0.92, color=color, alpha=0.75, linewidth=0)
