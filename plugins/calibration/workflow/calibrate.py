"""Calibrate the robot of a shot: the command as a function."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from calmotion.host import SettingError, Settings, merge, nearest, quantity_of
from calmotion.model import Animation, Character, OutputPaths, Provenance, RunSettings, Source, WrittenLayer
from calmotion.multibody import IMPLICIT
from calmotion.recordings import SensorRecording, measured_prims, read_recordings, refuse_unknown_channels
from calmotion.simulation import CompiledShot, compile_shot
from calmotion.tolerance import compiled_in
from calmotion.usd import refuse_inputs
from calmotion.workflow import (
    Given,
    Hooks,
    Outcome,
    Path,
    Progress,
    Shot,
    again,
    carry_out,
    compiled_run,
    read_settings,
    refuse_unwritable,
    with_shot,
)

from ..identification.calibrate import CalibrationSettings, calibrate_shots
from ..identification.parameters import refuse_unknown
from ..identification.recordings.plausible import refuse_long
from ..identification.signals import refuse_cyclic
from ..model import kinds
from ..model.estimates import Calibration, CalibrationFigures, Estimate

_READ = (Character, Animation, Provenance)


@dataclass(frozen=True, eq=False)
class CalibratedShot:
    """A calibrated robot.

    Attributes:
        calibration: The estimates, and how well the model predicts each channel.
        layer: The written layers, or None.
        figures: Paths of the figures.
        total_wall_s: Time of all of it [s].
    """

    calibration: Calibration
    layer: WrittenLayer | None
    figures: tuple[str, ...]
    total_wall_s: float
    _outcome: Outcome = field(repr=False)

    @property
    def parameters(self) -> Mapping[str, Estimate]:
        """The estimates by name, such as `modulus /Arm/Nylon`."""
        return {item.name: item for item in self.calibration.estimates}

    def write(self, layer: Path) -> WrittenLayer:
        """Write the estimates as a layer of overs, and beside it a root layer that opens it with the shot.

        Raises:
            ShotError: It cannot be written.
        """
        return _written(self._outcome, self.calibration, os.fspath(layer))

    def draw(self, folder: Path) -> tuple[str, ...]:
        """Draw measured and simulated signals before and after, residuals and intervals; returns the paths.

        Raises:
            RunError: They cannot be written.
        """
        return _drawn(self._outcome, self.calibration, os.fspath(folder), {})

    def report(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        from .report import calibration_report

        return calibration_report(self.calibration, self.layer, self.figures, self.total_wall_s)


# parameters: one for each option of the command, all but the shot and the recordings by keyword
def calibrate(
    shot: Shot | Path,
    recordings: Sequence[Path] | Path,
    *,
    others: Sequence[tuple[Shot | Path, Sequence[Path] | Path]] = (),
    layer: Path | None = None,
    parameters: Sequence[str] = kinds.DEFAULT,
    priors: Mapping[str, float] | None = None,
    validate: bool = True,
    by_motor_type: bool = False,
    tolerance: float | str | None = None,
    step: float | str | None = None,
    integrator: str | None = None,
    figures: Path | None = None,
    operators: Sequence[str] = (),
    settings: Given = None,
    progress: Callable[[Progress], None] | None = None,
    on_operator: Callable[[Any], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> CalibratedShot:
    """Estimate the parameters of a robot from recordings of its performance, with their standard deviations.

    Of several shots, nominal values may differ by known factors, as gains of the firmware; clocks, biases and places of
    sensors are those of each shot. The layer lies over the first shot, and over any other of the robot.

    Args:
        shot: The shot that was performed, or its USD file; with a layer of results, the curves of that layer.
        recordings: Files, each as FILE or FILE@/PRIM, the prim where the sensor of a file sits that does not name it.
        others: Further shots of the robot, each with its recordings.
        layer: USD layer to write.
        parameters: What to estimate: kinds, each by itself or as `KIND:PATTERN` for some prim paths.
        priors: Standard deviations of what is known before, by kind; relative ones, or SI of those about zero.
        by_motor_type: Motors of one type (`calm:motor:type`) share their parameters.
        validate: Hold out a fifth of the recordings, and compare it with the result.
        tolerance: Accuracy of the simulation at the targets, [m] or text with a unit; None: the shot's own.
        step: First time step, [s] or text with a unit; it is halved until the estimates no longer depend on it.
        integrator: Of the simulations; None: automatic.
        figures: Folder for figures.
        operators, settings, progress, on_operator, cancel: As of `simulate`.

    Raises:
        ShotError: A shot cannot be processed, a recording does not fit it, or the shots are not of one robot.
        SettingError: An argument does not fit.
    """
    begin = time.perf_counter()
    chosen, hooks = read_settings(settings), Hooks(progress, on_operator, cancel)
    refuse_unknown(parameters, priors or {})
    if integrator is not None and integrator not in IMPLICIT:
        raise SettingError(
            f"calibrate supports only {', '.join(IMPLICIT)}", path="--integrator", found=integrator,
            remedy=f"{nearest(integrator, IMPLICIT)}Remove the option, or use one of these.",
        )  # fmt: skip
    options = RunSettings(
        tolerance=quantity_of(tolerance, "m", "tolerance"), step=quantity_of(step, "s", "step"), integrator=integrator
    )
    target = None if layer is None else os.fspath(layer)
    opened, taken, outcomes = [], list[tuple[CompiledShot, Sequence[SensorRecording]]](), []
    for one, files in ((shot, recordings), *others):
        names = [os.fspath(file) for file in ([files] if isinstance(files, (str, os.PathLike)) else files)]
        opened.append(with_sensors(one))
        read = read_recordings(opened[-1].host, names, merge([opened[-1].settings, chosen]))
        _refuse_twice(read, [recording for _, earlier in taken for recording in earlier])
        outcomes.append(compiled_with_sensors(opened[-1], read, options, target, operators, chosen, hooks))
        taken.append((compiled_in(outcomes[-1].run.get), read))
    outcome = outcomes[0]
    given = CalibrationSettings(tuple(parameters), dict(priors or {}), validate, by_motor_type=by_motor_type)
    calibration = calibrate_shots(taken, given, options, partial(hooks.tell, "Estimate the parameters"))
    written = None if target is None else _written(outcome, calibration, target)
    drawn = () if figures is None else _drawn(outcome, calibration, os.fspath(figures), chosen)
    return CalibratedShot(calibration, written, drawn, time.perf_counter() - begin, outcome)


def _refuse_twice(recordings: Sequence[SensorRecording], earlier: Sequence[SensorRecording]) -> None:
    """Refuse a recording of two shots: the clock of a recording goes by its file.

    Raises:
        SettingError: There is one.
    """
    known = {os.path.realpath(recording.file) for recording in earlier}
    for recording in recordings:
        if os.path.realpath(recording.file) in known:
            raise SettingError(
                "this recording is given twice", path="--recording", found=recording.file,
                remedy="Name it once, behind the shot that was performed",
            )  # fmt: skip


def read_performed(
    shot: Shot | Path, recordings: Sequence[Path], like: CompiledShot | None = None
) -> tuple[CompiledShot, tuple[SensorRecording, ...]]:
    """A shot with a target at each sensor, ready to be simulated, and its recordings, as `calibrate_shots` takes them.

    Args:
        like: A shot of the same robot, whose flexible bodies, reduced for its motion, serve here too.

    Raises:
        ShotError: The shot cannot be processed, or a recording does not fit it.
        SettingError: A recording cannot be read.
    """
    opened = with_sensors(shot)
    files = [os.fspath(file) for file in recordings]
    read = read_recordings(opened.host, files, opened.settings) if files else ()
    hooks = Hooks(None, None, None)
    if like is not None and any(body.simulated_flexible for body in like.character.bodies):
        source = Source("", "", RunSettings(), measured=measured_prims(read))
        first = carry_out(opened, "simulate", wanted=_READ, source=source, hooks=hooks)
        character = first.require(Character)
        if [body.path for body in character.bodies] == [body.path for body in like.character.bodies]:
            character = replace(character, bodies=like.character.bodies)
            return compile_shot(character, first.require(Animation), like.bodies), read
    outcome = compiled_with_sensors(opened, read, RunSettings(), None, (), {}, hooks)
    return compiled_in(outcome.run.get), read


def compiled_with_sensors(
    opened: Shot, recordings: Sequence[SensorRecording], options: RunSettings, layer: str | None,
    operators: Sequence[str], settings: Settings, hooks: Hooks,
) -> Outcome:  # fmt: skip
    """A run that compiles the shot, after everything was refused that does not fit."""
    source = Source("", "", options, measured=measured_prims(recordings))
    if layer is not None:
        refuse_unwritable(layer)
    first = carry_out(
        opened, "simulate", wanted=_READ, operators=operators, source=source, settings=settings, hooks=hooks
    )
    character = first.require(Character)
    refuse_cyclic(character.retarget.cyclic, character.path)
    refuse_unknown_channels(character, recordings)
    refuse_long(recordings, float(first.require(Animation).frame_times[-1]))
    if layer is not None:
        refuse_inputs(first.require(Provenance), layer)
    return compiled_run(opened, source, settings, hooks)


def with_sensors(shot: Shot | Path) -> Shot:
    """The shot, to be read again: the prims of sensors are targets of this reading alone."""
    if not isinstance(shot, Shot):
        return Shot(with_shot(os.fspath(shot)))
    return shot.unread()


def _written(outcome: Outcome, calibration: Calibration, layer: str) -> WrittenLayer:
    from ..writing import write_calibration

    return WrittenLayer(*write_calibration(outcome.require(Character), outcome.require(Provenance), calibration, layer))


def _drawn(outcome: Outcome, calibration: Calibration, folder: str, settings: Settings) -> tuple[str, ...]:
    return again(outcome, CalibrationFigures, calibration, OutputPaths(figures=folder), settings=settings).paths
