"""Hostile recordings: other units, other times, no motion, cells that are no numbers."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import small_shots as shots
from commands import FAIL, words
from hostile import USAGE, Case, arm


def recorded(
    change: Callable[[float, float], tuple[float, float]], *told: str, file: str = "a.csv", options: str = "",
    statuses: tuple[int, ...] = FAIL,
) -> Case:  # fmt: skip
    """`calmotion calibrate` with a recording of the hand, of which times [s] and places along x [m] are changed."""

    def make(folder: Path) -> None:
        arm(shots.make_flexible)(folder)
        rows = [change(k / 100, 0.6 + 0.2 * float(np.cos(6.3 * k / 100))) for k in range(101)]
        text = "time_s,/Arm/fore/hand.x\n" + "".join(f"{t!r},{x!r}\n" for t, x in rows)
        (folder / "a.csv").write_text(text)

    line = f"calibrate shot.usda --recording {file} -o out.usda --step 8ms --parameters modulus --json {options}"
    return words(line, *told, statuses=statuses, make=make)


CASES: dict[str, Case] = {
    "a recording in milliseconds": recorded(lambda t, x: (1000.0 * t, x), "times in seconds"),
    "a recording in millimetres": recorded(lambda t, x: (t, 1000.0 * x), "in metres"),
    "a recording of a robot that rests": recorded(lambda t, x: (t, 0.0 * x + 0.8), "nothing moves"),
    "a recording with an infinite cell": recorded(lambda t, x: (t, np.inf if 0.4 < t < 0.42 else x), "line"),
    "a recording that goes backwards": recorded(lambda t, x: (1.0 - t, x), "must not go back"),
    "a recording whose prim is named twice": recorded(
        lambda t, x: (t, x), "names the prims of its channels itself", file="a.csv@/Arm/fore"
    ),
    "a calibration by an integrator without derivatives": recorded(
        lambda t, x: (t, x), "--integrator", options="--integrator rk4", statuses=USAGE
    ),
}
