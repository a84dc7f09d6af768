"""Against real machines: what calibrations from some recordings predict of the others.

`calmotion bench measured FOLDER [--fit N] [--most N] [--csv FILE]` takes a folder with shots of one machine, NAME.usda,
each with what was recorded of it, NAME.csv. The machine is calibrated from every N shots (default: 2) of different
motions (names up to the last `_` tell motions apart), and the others are simulated with what was found. The table has
the mean absolute error of the others for each fit, in rad or m; below it are the median and the largest, those of the
shots as they are, and, for each parameter, how often the 95% interval of a fit contains the estimate of another fit
that shares no recording with it. `--most` takes that many fits, spread over all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from calmotion import ShotError
from calmotion.model import RunSettings
from calmotion.recordings import SensorRecording
from calmotion.simulation import CompiledShot
from calmotion_plugins.calibration import (
    Calibration,
    CalibrationSettings,
    Estimate,
    calibrate_shots,
    read_performed,
    robot_parameters,
    robot_with,
    signals_of,
)

from ..common.parsers import bench_parser, output_options
from ..common.tables import finish, say, write_rows

HEADS = ("fitted", "error of the others", "as they are", "estimates")
CLOCK = 0.02  # standard deviation of the clocks, which begin with the commands [s]
STEP = 4e-3  # of the predictions [s]
WITHIN = 1.96


@dataclass(frozen=True)
class Predicted:
    """What one fit predicts of the recordings that it has not seen.

    Attributes:
        fitted: Names of the shots.
        error: Mean absolute error over the others [rad or m].
        nominal: The same of the shots as they are.
        estimates: As text.
    """

    fitted: str
    error: float
    nominal: float
    estimates: str


@dataclass(frozen=True, eq=False)
class Machine:
    """Shots of one machine with their recordings, by name."""

    takes: dict[str, tuple[CompiledShot, tuple[SensorRecording, ...]]]

    def error(self, name: str, estimates: Sequence[Estimate] = ()) -> float:
        """Mean absolute error of the prediction of a recording [rad or m].

        Args:
            name: Of the shot.
            estimates: Of the robot; a value of the shot is scaled or moved as that of the first shot of the fit was.
        """
        shot, recordings = self.takes[name]
        values, given = {}, {item.name: item for item in estimates if item.of_robot}
        for p in robot_parameters(shot, sorted({item.kind for item in given.values()})) if given else ():
            item = given.get(p.name)
            if item is not None:
                moved = (
                    item.value / item.nominal * p.nominal if p.logarithmic else p.nominal + item.value - item.nominal
                )
                values[p.kind, p.path, p.axis] = moved
        signals = signals_of(robot_with(shot, values), RunSettings(step=STEP, integrator="bdf2"))
        targets = {target.path: k for k, target in enumerate(shot.character.targets)}
        motors = {motor.path: k for k, motor in enumerate(shot.character.motors)}
        off = []
        for recording in recordings:
            for channel in recording.channels:
                index = motors[channel.path] if channel.kind in ("angle", "effort") else targets[channel.path]
                off.append(np.abs(signals.at(channel.kind, index, channel.times) - channel.values).ravel())
        return float(np.nanmean(np.concatenate(off)))


def machine_in(folder: Path) -> Machine:
    """The shots of a folder that have a recording.

    Raises:
        ShotError: There are fewer than two, or one cannot be read.
    """
    files = [file for file in sorted(folder.glob("*.usda")) if file.with_suffix(".csv").is_file()]
    if len(files) < 2:
        raise ShotError(
            "a machine needs two recorded shots at least", path=str(folder), found=len(files),
            remedy="Put NAME.usda and NAME.csv of each into the folder",
        )  # fmt: skip
    return Machine({file.stem: read_performed(str(file), [file.with_suffix(".csv")]) for file in files})


def choices(names: Sequence[str], count: int, most: int | None) -> list[tuple[str, ...]]:
    """Which shots are fitted together: of different motions, where names tell so."""
    found = [own for own in combinations(names, count) if len({name.rpartition("_")[0] or name for name in own}) > 1]
    found = found or list(combinations(names, count))
    if most is None or len(found) <= most:
        return found
    return [found[k] for k in np.linspace(0, len(found) - 1, most).round().astype(int)]


def covered(fits: dict[tuple[str, ...], Calibration]) -> dict[str, tuple[int, int]]:
    """For each parameter of the robot, in how many 95% intervals estimates of disjoint fits lie, and of how many."""
    found: dict[str, tuple[int, int]] = {}
    for own, fit in fits.items():
        for others, other in fits.items():
            if set(own) & set(others):
                continue
            for item in fit.estimates:
                if not item.of_robot:
                    continue
                there = other.estimate(item.name)
                # gains of fits differ as those of their first shots do
                off, width = there.value - item.value, item.standard_deviation
                if item.logarithmic:
                    off = np.log(there.value / there.nominal) - np.log(item.value / item.nominal)
                    width = item.standard_deviation / item.value
                inside, count = found.get(item.name, (0, 0))
                found[item.name] = inside + int(abs(off) <= WITHIN * width), count + 1
    return found


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("measured", __doc__)
    parser.add_argument("folder", metavar="FOLDER", help="shots and recordings of one machine")
    parser.add_argument("--fit", type=int, default=2, metavar="N", help="shots that are fitted together (default: 2)")
    parser.add_argument("--most", type=int, metavar="N", help="fits, spread over all of them (default: all)")
    output_options(parser, csv="a row for each fit", markdown=True)
    options = parser.parse_args(arguments)
    machine = machine_in(Path(options.folder))
    names = list(machine.takes)
    nominal = {name: machine.error(name) for name in names}
    settings = CalibrationSettings(priors={"clock_offset": CLOCK})
    rows, fits = [], {}
    for own in choices(names, options.fit, options.most):
        fit = calibrate_shots([machine.takes[name] for name in own], settings, RunSettings())
        fits[own] = fit
        others = [name for name in names if name not in own]
        told = ", ".join(
            f"{item.name.partition(' ')[0]} {item.value:.3g} ± {item.standard_deviation:.2g}"
            for item in fit.estimates
            if item.of_robot
        )
        error = float(np.mean([machine.error(name, fit.estimates) for name in others]))
        rows.append(Predicted(", ".join(own), error, float(np.mean([nominal[name] for name in others])), told))
        say(f"{rows[-1].fitted}: {error:.4f} (as they are {rows[-1].nominal:.4f}); {told}")
        if options.csv:
            write_rows(options.csv, Predicted, rows)
    inside = covered(fits)
    errors = [row.error for row in rows]
    cells = [[row.fitted, f"{row.error:.4f}", f"{row.nominal:.4f}", row.estimates] for row in rows]
    cells.append(["median", f"{np.median(errors):.4f}", f"{np.mean(list(nominal.values())):.4f}", ""])
    cells.append(["largest", f"{max(errors):.4f}", f"{max(nominal.values()):.4f}", ""])
    cells += [[f"in the 95% interval: {name}", f"{a} of {n}", "", ""] for name, (a, n) in inside.items()]
    found = {
        "fits": [vars(row) for row in rows], "median_error": float(np.median(errors)), "largest_error": max(errors),
        "as_they_are": nominal, "in_the_95_percent_interval": inside,
    }  # fmt: skip
    finish(options, "Predictions of a real machine", HEADS, cells, found)
    return 0
