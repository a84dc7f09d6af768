"""Where each integrator is stable: the swung arm over stiffness, speed or load, and step.

Every cell runs to its end or is refused with a reason. Explicit and expensive integrators run at the steps that they
can afford (`STEPS`); a cell that takes longer than `PATIENCE` has failed.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calmotion.benchmarks.common.tables import show
from calmotion.benchmarks.integrators.outcomes import FAILED, REFUSED, RUNS, judged
from calmotion.benchmarks.scenes.beam_arm import beam_arm, quintic, shot_of

IMPLICIT = (1 / 24, 1 / 48, 1 / 120, 1 / 240, 1 / 480, 1 / 2400)
STEPS: dict[str, tuple[float, ...]] = {
    "bdf2": IMPLICIT,
    "newmark": IMPLICIT,
    "generalized-alpha": IMPLICIT,
    "rk4": (1 / 24, 1 / 240, 1 / 2400, 1 / 24000, 1 / 72000, 1 / 240000, 1 / 720000, 1 / 2400000, 1 / 7200000),
    # dense, of order 5, for references: ten times the time of the others, and exact long before their steps
    "radau": IMPLICIT[:3],
}
# below this step [s] only so many steps, before the arm moves: what blows up does so within some hundred
BRIEFLY, BEGINNING = 1 / 2400, 1000
PATIENCE = 60.0  # for one cell [s]
# what counts as closed [m]: all but BDF2 hold joints together in velocity alone, and are refused where they drift
# farther than this, a tenth of the error that does not matter (`retarget.run`)
CLOSED = 1e-4
LATER = 0.25  # when the move begins: the ringing of its spline has died out before it, and the arm starts from rest [s]

# name of the row's quantity, its values, and the scene for one of them
Rows = tuple[str, tuple[float, ...], Callable[[float], Any]]


@dataclass(frozen=True)
class Cell:
    """The outcome of one simulation of a map.

    Attributes:
        map: Name of the map.
        value: Of the row's quantity, in its unit.
        step_s: [s].
        integrator: One of `calmotion.shot.run.INTEGRATORS`.
        outcome: `runs`, `refused` or `failed`.
        why: The reason of a refusal or failure, else empty.
        error_m: Largest error of the tip against the rigid motion [m]; None where it did not come to its end, or only
            the beginning was run (`BRIEFLY`).
        wall_s: All that the cell took [s].
    """

    map: str
    value: float
    step_s: float
    integrator: str
    outcome: str
    why: str
    error_m: float | None
    wall_s: float


def _swung(seconds: float = 0.5, **arm: Any) -> Any:
    return beam_arm(**arm, modes=8, elasticity="stvk"), shot_of(quintic(np.pi / 2, seconds, LATER), 1.25)


MODULI = (1e12, 1e11, 1e10, 1e9, 3e8, 1e8, 1e7)
MAPS: dict[str, Rows] = {
    "stiffness": ("Young's modulus [Pa]", MODULI, lambda modulus: _swung(youngs_modulus=modulus)),
    "speed": ("quarter turn in [s]", (1.0, 0.5, 0.25, 0.125, 0.0625), _swung),
    "load": ("load over arm [-]", (1e-6, 1e-3, 1.0, 3.0, 10.0, 1e3), lambda ratio: _swung(payload=0.288 * ratio)),
}


class _Patience(Exception):
    """A cell took too long."""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Interrupt what takes longer, where the system can: in the main thread of a POSIX process.

    Compiled loops are interrupted as they return, which each does after a bounded number of steps.
    """
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: Any) -> None:
        raise _Patience(_late(seconds))

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _late(seconds: float) -> str:
    return f"took longer than {seconds:g} s"


def cells_of(name: str, rows: Rows, steps: Mapping[str, Sequence[float]] | None = None) -> list[Cell]:
    """The cells of one map; a row's bodies are reduced once."""
    from calmotion.shot.run import RunSettings
    from calmotion.simulation.body_reduction import BodyReduction
    from calmotion.simulation.compiled_shot import compile_shot

    found = []
    for value in rows[1]:
        (character, meshes), animation = rows[2](value)
        whole = compile_shot(character, animation, BodyReduction(character, meshes, None).bodies(None))
        for integrator, own in (STEPS if steps is None else steps).items():
            for step in own:
                begin, brief = time.perf_counter(), step < 0.999 * BRIEFLY
                shot = whole
                if brief:
                    beginning = replace(animation, frame_times=np.array([0.0, BEGINNING * step]))
                    shot = replace(whole, animation=beginning)
                options = RunSettings(step=step, integrator=integrator, pre_roll=0.0 if brief else None)
                try:
                    with within(PATIENCE):
                        item = judged(rows[0], f"{value:g}", shot, options, CLOSED)
                    outcome, why, error = item.outcome, item.why, item.error_m
                except _Patience as late:
                    outcome, why, error = FAILED, str(late), float("nan")
                if outcome == FAILED and time.perf_counter() - begin >= PATIENCE:
                    why = _late(PATIENCE)  # an interrupted library may raise an error of its own
                found.append(
                    Cell(
                        name, value, step, integrator, outcome, why, None if brief or not np.isfinite(error) else error,
                        time.perf_counter() - begin,
                    )
                )  # fmt: skip
    return found


def all_cells(maps: Mapping[str, Rows], steps: Mapping[str, Sequence[float]] | None = None) -> list[Cell]:
    """The cells of all maps."""
    return [cell for name, rows in maps.items() for cell in cells_of(name, rows, steps)]


def largest_steps(cells: Sequence[Cell]) -> dict[float, float | None]:
    """The boundary of one integrator in one map: for each value the largest step from which on all smaller ones run,
    None where the smallest does not."""
    found: dict[float, float | None] = {}
    for value in dict.fromkeys(cell.value for cell in cells):
        found[value] = None
        for cell in sorted((cell for cell in cells if cell.value == value), key=lambda cell: cell.step_s):
            if cell.outcome != RUNS:
                break
            found[value] = cell.step_s
    return found


def step_name(step: float | None) -> str:
    """A step as a fraction of a second."""
    return "none" if step is None else f"1/{round(1 / step)}"


def print_cells(cells: Sequence[Cell]) -> None:
    """The boundary of each integrator, and how many cells there are of which outcome, for a person."""
    for name in dict.fromkeys(cell.map for cell in cells):
        own = [cell for cell in cells if cell.map == name]
        lines = {
            integrator: largest_steps([cell for cell in own if cell.integrator == integrator])
            for integrator in dict.fromkeys(cell.integrator for cell in own)
        }
        values = list(dict.fromkeys(cell.value for cell in own))
        rows = [[f"{value:g}", *(step_name(line[value]) for line in lines.values())] for value in values]
        show(f"Largest stable step [s] over {name}", [name, *lines], rows, texts=0)
    for outcome in (RUNS, REFUSED, FAILED):
        count = sum(cell.outcome == outcome for cell in cells)
        print(f"{count} cells {'run' if outcome == RUNS else 'are refused' if outcome == REFUSED else 'fail'}")
    for cell in cells:
        if cell.outcome == FAILED:
            print(f"{cell.map} {cell.value:g}, {step_name(cell.step_s)} s, {cell.integrator}: {cell.why}")
