"""Against real machines: what calibrations from some recordings predict of the others.

`calmotion bench measured FOLDER [--fit N] [--most N] [--parameters KIND ...] [--csv FILE]` takes a folder with shots of
one machine, NAME.usda, each with what was recorded of it, NAME.csv. The machine is calibrated from every N shots
(default: 2) of different motions (names up to the last `_` tell motions apart), and the others are simulated with what
was found. The table has the mean absolute error of the others for each fit, in rad, m or N m; below it are the median
and the largest, those of the shots as they are, and, for each parameter, how often the 95% interval of a fit contains
the estimate of another fit that shares no recording with it. `--most` takes that many fits, spread over all of them.

The error of a strain gauge, whose gain and free swing at the start are fitted, is the share of its signal's shake that
is left. A folder with `beam.toml` (the entries of `two_mode_beam.Strip`) gets the same from an independent model of its
strip too, and one with `servo.toml` (the entries of `servo_model.Bench`) the error of the model of
`better-actuator-models`, fitted to all recordings. Commands that were optimised for each fit are replayed in these
models: of the shots without a recording, else of the largest motion that the fit has not seen. Rigid arms with
ideal motors get the error of classic identification, a linear regression of efforts.
"""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from calmotion import ShotError
from calmotion.model import RunSettings
from calmotion.recordings import STRAIN, Channel, LowPass, SensorRecording
from calmotion.simulation import CompiledShot
from calmotion_plugins.calibration import (
    Calibration,
    CalibrationSettings,
    Estimate,
    Robot,
    Signals,
    calibrate_shots,
    place_of,
    read_performed,
    robot_parameters,
    robot_with,
    signals_of,
    unexplained_share,
)
from scipy.interpolate import CubicSpline

from ..common.reporting import bench_parser, finish, keep, say
from . import inverse_dynamics, servo_model, two_mode_beam
from .replays import Replayed, replayed
from .servo_model import FittedServo
from .two_mode_beam import Fitted

CLOCK = 0.02  # standard deviation of the clocks, which begin with the commands [s]
STEP = 4e-3  # of the predictions [s]
WITHIN = 1.96


@dataclass(frozen=True)
class Predicted:
    """What one fit predicts of the recordings that it has not seen.

    Attributes:
        fitted: Names of the shots.
        error: Mean absolute error over the others [rad, m, N m].
        nominal: The same of the shots as they are.
        estimates: As text, with the share of the recordings of the fit that it tells to be unexplained.
    """

    fitted: str
    error: float
    nominal: float
    estimates: str


@dataclass(frozen=True, eq=False)
class Machine:
    """Shots of one machine with their recordings, by name, and those that have none."""

    takes: dict[str, tuple[CompiledShot, tuple[SensorRecording, ...]]]
    motions: dict[str, CompiledShot]

    def error(self, name: str, estimates: Sequence[Estimate] = ()) -> float:
        """Mean absolute error of the prediction of a recording [rad, m, N m]; of a strain gauge the share of its shake.

        Args:
            name: Of the shot.
            estimates: As of `robot`.
        """
        shot, recordings = self.takes[name]
        signals = signals_of(self.robot(name, estimates), RunSettings(step=STEP, integrator="bdf2"))
        off = []
        for recording in recordings:
            for channel in recording.channels:
                place = place_of(channel, shot.character)
                assert place is not None  # the recording was read for this shot
                if channel.kind == STRAIN:
                    known = {item.kind: item.value for item in estimates if item.path == channel.path}
                    off.append(np.array([_left(signals, channel, place, known)]))
                else:
                    off.append(np.abs(signals.at(channel.kind, place, channel.times) - channel.values).ravel())
        return float(np.nanmean(np.concatenate(off)))

    def robot(self, name: str, estimates: Sequence[Estimate] = ()) -> Robot:
        """The robot of a shot with the estimates of a fit; a value of the shot is scaled or moved as that of the first
        shot of the fit was."""
        shot = self.motions[name] if name in self.motions else self.takes[name][0]
        values, given = {}, {item.name: item for item in estimates if item.of_robot}
        kinds, motors = sorted({item.kind for item in given.values()}), [motor.path for motor in shot.character.motors]
        for p in robot_parameters(shot, kinds, efforts=motors) if given else ():
            item = given.get(p.name)
            if item is not None:
                moved = (
                    item.value / item.nominal * p.nominal if p.logarithmic else p.nominal + item.value - item.nominal
                )
                values[p.kind, p.path, p.axis] = moved
        return robot_with(shot, values)


def _left(signals: Signals, channel: Channel, place: Any, known: Mapping[str, float]) -> float:
    """Share of the shake of a gauge's signal that is left, with its own free swing, offset and, if it is not known,
    gain; its filter as it is known."""
    gain, low_pass = known.get("gain"), channel.low_pass
    if low_pass is not None:
        damping = known.get("filter_damping", low_pass.damping)
        low_pass = LowPass(known.get("filter_frequency", low_pass.frequency), damping)
    inside = (channel.times >= 0.0) & (channel.times <= signals.times[-1])
    times, values = channel.times[inside], channel.values[inside, 0]
    answer = signals.at(STRAIN, place, times, low_pass=low_pass)
    free = np.concatenate(
        [signals.decays(times), np.ones((len(times), 1)), *([answer] if gain is None else [])], axis=1
    )
    off = values - (0.0 if gain is None else gain) * answer[:, 0]
    return float((off - free @ np.linalg.lstsq(free, off, rcond=None)[0]).std() / values.std())


def beams(folder: Path, machine: Machine, fits: Iterable[tuple[str, ...]]) -> dict[tuple[str, ...], Fitted]:
    """Of strips, the independent beam that fits the recordings of each fit; nothing of another machine."""
    file = folder / "beam.toml"
    if not file.is_file():
        return {}
    strip = two_mode_beam.Strip(**tomllib.loads(file.read_text(encoding="utf-8")))
    return {own: two_mode_beam.fitted(strip, [reading_of(machine, name) for name in own]) for own in fits}


def reading_of(machine: Machine, name: str) -> two_mode_beam.Reading:
    """The first channel of a recording, with the motion of the hub."""
    shot, recordings = machine.takes[name]
    (track,), channel = shot.animation.current, recordings[0].channels[0]
    hub = CubicSpline(shot.animation.frame_times, track.values)
    inside = (channel.times >= 0.0) & (channel.times <= shot.animation.frame_times[-1])
    times = channel.times[inside]
    return two_mode_beam.Reading(times, hub(times), channel.values[inside, 0])


def beam_row(machine: Machine, own: tuple[str, ...], beam: Fitted) -> Predicted:
    """What a beam predicts of the other recordings."""
    left = [two_mode_beam.predicted(beam, reading_of(machine, name)) for name in machine.takes if name not in own]
    told = f"{beam.frequencies[0]:.3g} Hz, damping {beam.damping:.3g}, {beam.modulus:.3g} of the modulus"
    return Predicted(f"beam: {', '.join(own)}", float(np.mean(left)), np.nan, told)


def regressions(machine: Machine, fits: Iterable[tuple[str, ...]]) -> list[Predicted]:
    """What classic identification predicts of the other recordings of rigid arms with ideal motors; else nothing."""
    if not all(inverse_dynamics.serves(shot.character) for shot, _ in machine.takes.values()):
        return []
    moved = {name: inverse_dynamics.moved(*take) for name, take in machine.takes.items()}
    rows = []
    for own in fits:
        first, _ = machine.takes[own[0]]
        for bodies, what in ((False, "inertia, friction and offset of each motor"), (True, "masses too")):
            x = inverse_dynamics.identified(first.character, [moved[name] for name in own], bodies)
            off = [np.abs(np.concatenate(moved[name].off(x))).mean() for name in machine.takes if name not in own]
            rows.append(Predicted(f"regression: {', '.join(own)}", float(np.mean(off)), np.nan, what))
    return rows


def servo(folder: Path, machine: Machine) -> FittedServo | None:
    """Of a servo with a weight, the other authors' model that fits all recordings; nothing of another machine."""
    file = folder / "servo.toml"
    if not file.is_file():
        return None
    bench = servo_model.Bench(**tomllib.loads(file.read_text(encoding="utf-8")))
    plays = []
    for shot, recordings in machine.takes.values():
        times, channel = shot.animation.frame_times, recordings[0].channels[0]
        inside = (channel.times >= 0.0) & (channel.times <= times[-1])
        gain = shot.character.motors[0].position_gain / bench.unit_gain
        measured = channel.times[inside], channel.values[inside, 0]
        plays.append(servo_model.Played(gain, times, np.ravel(shot.animation.current[0].values), *measured))
    return servo_model.fitted_servo(bench, plays)


def replays(
    machine: Machine, fits: Mapping[tuple[str, ...], Calibration], by: Mapping[Any, Fitted], peer: FittedServo | None
) -> list[Replayed]:  # fmt: skip
    """Commands that were optimised for each fit, in the independent model of the strip or of the servo.

    They are of the shots without a recording, or, without any, of the largest motion that the fit has not seen.
    """
    rows = []
    spans = {name: np.ptp(shot.animation.current[0].values) for name, (shot, _) in machine.takes.items()}
    channels = [c for _, found in machine.takes.values() for one in found for c in one.channels]
    sensors = {path for channel in channels for path in (channel.path, channel.to)}
    for own, fit in fits.items() if by or peer else ():
        largest = max((name for name in spans if name not in own), key=spans.__getitem__)
        for name in machine.motions or [largest]:
            robot = machine.robot(name, fit.estimates).shot
            gain = machine.robot(name).shot.character.motors[0].position_gain
            error = partial(peer.largest_error_mm, gain / peer.bench.unit_gain) if peer else by[own].largest_error_mm
            rows.append(replayed(", ".join(own), name, robot, fit, error, STEP, sensors))
            say(_sentence(rows[-1]))
    return rows


def _sentence(row: Replayed) -> str:
    return (
        f"commands of {row.shot}, optimised for the fit of {row.fitted} and replayed in the independent model: "
        f"{row.before_mm:.3g} to {row.after_mm:.3g} mm (told: {row.told_mm:.3g} mm)"
    )


def machine_in(folder: Path) -> Machine:
    """The shots of a folder; flexible links are reduced once, for the motion of the first that has a recording.

    Raises:
        ShotError: There are fewer than two recorded ones, or one cannot be read.
    """
    files = [file for file in sorted(folder.glob("*.usda")) if file.with_suffix(".csv").is_file()]
    if len(files) < 2:
        raise ShotError(
            "a machine needs two recorded shots at least",
            path=str(folder),
            found=len(files),
            remedy="Put NAME.usda and NAME.csv of each into the folder",
        )
    takes = dict[str, tuple[CompiledShot, tuple[SensorRecording, ...]]]()
    for file in files:
        first = next((shot for shot, _ in takes.values()), None)
        takes[file.stem] = read_performed(str(file), [file.with_suffix(".csv")], first)
    first = takes[files[0].stem][0]
    others = [file for file in sorted(folder.glob("*.usda")) if file not in files]
    return Machine(takes, {file.stem: read_performed(str(file), [], first)[0] for file in others})


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
    parser.add_argument(
        "--parameters", nargs="+", metavar="KIND", default=CalibrationSettings.parameters, help="as of calibrate"
    )
    options = parser.parse_args(arguments)
    machine = machine_in(Path(options.folder))
    names = list(machine.takes)
    nominal = {name: machine.error(name) for name in names}
    settings = CalibrationSettings(tuple(options.parameters), priors={"clock_offset": CLOCK})
    rows, fits = [], {}
    for own in choices(names, options.fit, options.most):
        fit = fits[own] = calibrate_shots([machine.takes[name] for name in own], settings, RunSettings())
        others = [name for name in names if name not in own]
        told = ", ".join(
            f"{item.kind} {item.path.rpartition('/')[2]} {item.value:.3g} ± {item.standard_deviation:.2g}"
            for item in fit.estimates
            if item.of_robot
        )
        if share := unexplained_share(fit):
            told = f"{100.0 * share:.2g}% left of its own; {told}"
        error = float(np.mean([machine.error(name, fit.estimates) for name in others]))
        rows.append(Predicted(", ".join(own), error, float(np.mean([nominal[name] for name in others])), told))
        say(f"{rows[-1].fitted}: {error:.4f} (as they are {rows[-1].nominal:.4f}); {told}")
        keep(options, Predicted, rows)
    by, peer = beams(Path(options.folder), machine, fits), servo(Path(options.folder), machine)
    errors, inside = [row.error for row in rows], covered(fits)
    as_they_are = list(nominal.values())
    rows += [
        Predicted("median", float(np.median(errors)), float(np.mean(as_they_are)), ""),
        Predicted("largest", max(errors), max(as_they_are), ""),
        *(beam_row(machine, own, beam) for own, beam in by.items()),
        *regressions(machine, fits),
    ]
    lines = [f"in the 95% interval, {name}: {a} of {n}" for name, (a, n) in inside.items()]
    if peer is not None:
        lines.append(f"{peer.bench.model} of better-actuator-models, fitted to all: {peer.error:.3f} rad "
                     f"(as published {peer.published_error:.3f} rad)")  # fmt: skip
    played = replays(machine, fits, by, peer)
    lines += map(_sentence, played)
    finish(
        options, "Predictions of a real machine", rows, lines=lines, in_the_95_percent_interval=inside,
        replays=[vars(row) for row in played],
    )  # fmt: skip
    return 0
