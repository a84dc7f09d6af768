"""Where each integrator is stable: the swung arm over stiffness, speed or load, and step.

`calmotion bench stability [--csv FILE] [--only TEXT]` simulates every cell of the maps by each integrator. A cell runs
to its end or is refused with a reason, without NaN. Explicit and expensive integrators run at the steps that they can
afford; a cell that takes longer than a minute has failed. The table has, for each value, the largest step from which on
all smaller ones run. It ends with exit status 1 when a cell fails.
"""

import json
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from calmotion import ShotError
from calmotion.model import RunSettings
from calmotion.simulation import BodyReduction, CompiledShot, compile_shot, simulate_shot
from calmotion.testing import beam_arm, quintic, shot_of

from ..common.reporting import bench_parser, keep, show

RUNS, REFUSED, FAILED = "runs", "refused", "failed"
NORM = 1e-9  # how far a quaternion's norm may be from 1
REACH = 1.5  # times the arm's length: a target beyond it has flown away
IMPLICIT = (1 / 24, 1 / 48, 1 / 120, 1 / 240, 1 / 480, 1 / 2400)
STEPS: dict[str, tuple[float, ...]] = {
    "bdf2": IMPLICIT,
    "newmark": IMPLICIT,
    "generalized-alpha": IMPLICIT,
    "rk4": (1 / 24, 1 / 240, 1 / 2400, 1 / 24000, 1 / 72000, 1 / 240000, 1 / 720000, 1 / 2400000, 1 / 7200000),
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
        integrator: One of `calmotion.model.run.INTEGRATORS`.
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


def cells_of(name: str, rows: Rows, steps: Mapping[str, Sequence[float]] | None = None) -> list[Cell]:
    """The cells of one map; a row's bodies are reduced once."""
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
                outcome, why, error = judged(shot, options)
                wall = time.perf_counter() - begin
                if wall > PATIENCE:
                    outcome, why, error = FAILED, f"took longer than {PATIENCE:g} s", None
                found.append(Cell(name, value, step, integrator, outcome, why, None if brief else error, wall))
    return found


def judged(shot: CompiledShot, options: RunSettings) -> tuple[str, str, float | None]:
    """Simulate a shot: the outcome, its reason, and the largest error of the tip [m] where it came to its end."""
    try:
        simulation = simulate_shot(shot, options, lambda fraction, message: None).before
    except ShotError as error:
        return REFUSED, str(error), None
    except Exception as error:  # whatever it is, it is what this looks for
        return FAILED, f"{type(error).__name__}: {error}", None
    motion = simulation.motion
    parts = (motion.positions, motion.rotations, motion.target_positions, motion.motor_efforts, *motion.elastic)
    reach = sum(float(np.linalg.norm(joint.frame0.position)) for joint in shot.character.joints if joint.body0 >= 0)
    wrong = ""
    if not all(np.all(np.isfinite(part)) for part in parts):
        wrong = "not a number"
    elif np.linalg.norm(motion.target_positions, axis=2).max() > REACH * reach:
        wrong = "the target flew away"
    elif simulation.max_joint_gap > CLOSED:
        wrong = f"a joint came apart by {simulation.max_joint_gap:.1e} m"
    elif np.abs(np.linalg.norm(motion.rotations, axis=2) - 1.0).max() > NORM:
        wrong = "a quaternion lost its length"
    return (FAILED, wrong, None) if wrong else (RUNS, "", float(simulation.position_errors.max()))


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
        show(f"Largest stable step [s] over {name}", [name, *lines], rows)
    counts = Counter(cell.outcome for cell in cells)
    print(f"{counts[RUNS]} cells run, {counts[REFUSED]} are refused, {counts[FAILED]} fail")
    for cell in cells:
        if cell.outcome == FAILED:
            print(f"{cell.map} {cell.value:g}, {step_name(cell.step_s)} s, {cell.integrator}: {cell.why}")


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when a cell fails."""
    parser = bench_parser("stability", __doc__)
    parser.add_argument("--only", metavar="TEXT", default="", help="only maps (`load`) so named")
    options = parser.parse_args(arguments)
    begin = time.perf_counter()
    wanted = [name for name in MAPS if options.only.lower() in name]
    cells = [cell for name in wanted for cell in cells_of(name, MAPS[name])]
    keep(options, Cell, cells)
    if options.json:
        print(json.dumps({"cells": [asdict(cell) for cell in cells], "total_wall_s": time.perf_counter() - begin}))
    else:
        print_cells(cells)
    return int(FAILED in [cell.outcome for cell in cells])
