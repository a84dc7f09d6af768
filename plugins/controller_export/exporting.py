"""Commands for motor controllers, and what playing them costs: written, read back, played and simulated."""

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.host import Settings
from calmotion.model import Animation, Character, Provenance, Result, RunSettings, Source, switched_motors, tolerance_of
from calmotion.simulation import CompiledShot
from calmotion.support import temporary_folder
from calmotion.tolerance import compiled_in
from calmotion.version import __version__
from calmotion.workflow import (
    Given,
    Hooks,
    Outcome,
    Path,
    Progress,
    Shot,
    SimulationResult,
    carry_out,
    compiled_run,
    no_input,
    plain,
    read_settings,
    refuse_layers,
    refuse_overwriting,
    with_shot,
)

from .commands import Commands, ExportRequest, WrittenCommands
from .controller_files import curves_of, format_named, write_commands
from .given import GivenExport, given_export, refuse_beyond_format, refuse_beyond_shot
from .lowest_rate import lowest_rate
from .playback import Loss, Playback

HIGHEST = 1000  # rate that is tried [Hz]; a higher one where a higher one is given
CONVERGED = 0.05  # change of the loss with half the step, over the larger of it and a tenth of the allowed loss
HALVINGS = 3  # of that step
_READ = (Character, Animation, Provenance)


@dataclass(frozen=True)
class Export:
    """Written commands and what playing them costs.

    Attributes:
        format: Name of the format.
        files: The files.
        rate: Commands a second [Hz].
        start_delay: How late the player starts [s].
        written: The commands, exact and as read back.
        targets: Prim paths of the targets.
        loss: Of what is played, by target.
        rate_loss: Of the same without rounding and delay.
        rounded_loss: Of the same without delay.
        fastest: Largest speed of each target [m/s]: what a second of delay costs at most.
        lowest_rate: Lowest whole rate that keeps the allowed loss [Hz]; None where none does, or it was not looked for.
        tolerance: Accuracy of the simulation at the targets [m].
        allowed_loss: Loss that is accepted at the targets [m].
        step: Of the simulations [s].
        simulations: Number of simulations.
        motors: Prim paths of the motors and the names of their joints in the file.
        searched: Whether the lowest rate was looked for.
        total_wall_s: Time of all of it [s].
        notes: What the user of the files must know, as sentences.
    """

    format: str
    files: tuple[str, ...]
    rate: float
    start_delay: float
    written: WrittenCommands
    targets: tuple[str, ...]
    loss: Loss
    rate_loss: Loss
    rounded_loss: Loss
    fastest: Array
    lowest_rate: int | None
    tolerance: float
    allowed_loss: float
    step: float
    simulations: int
    motors: dict[str, str]
    searched: bool
    total_wall_s: float
    notes: tuple[str, ...]

    @property
    def loss_kept(self) -> bool:
        """Whether the loss of what is played is accepted."""
        return self.loss.largest <= self.allowed_loss

    @cached_property
    def loss_m(self) -> dict[str, float]:
        """The loss by prim path of the target [m]."""
        return dict(zip(self.targets, self.loss.distances.tolist(), strict=True))

    def report(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        rows = [
            {
                "path": path,
                "loss_m": self.loss.distances[k],
                "rotation_loss_rad": self.loss.angles[k],
                "rate_loss_m": self.rate_loss.distances[k],
                "rounding_loss_m": max(0.0, self.rounded_loss.distances[k] - self.rate_loss.distances[k]),
                "start_loss_m": max(0.0, self.loss.distances[k] - self.rounded_loss.distances[k]),
                "delay_cost_m_per_s": self.fastest[k],
            }
            for k, path in enumerate(self.targets)
        ]
        report: dict[str, Any] = plain(
            {
                "command": "export",
                "version": __version__,
                "format": self.format,
                "files": self.files,
                "rate_hz": self.rate,
                "start_delay_s": self.start_delay,
                "interpolation": self.written.read.interpolation,
                "commands": len(self.written.exact.times),
                "motors": self.motors,
                "loss_m": self.loss_m,
                "targets": rows,
                "max_loss_m": self.loss.largest,
                "tolerance_m": self.tolerance,
                "allowed_loss_m": self.allowed_loss,
                "loss_kept": self.loss_kept,
                "tolerance_kept": self.loss_kept,  # the name of older versions
                "lowest_rate_hz": self.lowest_rate,
                "searched": self.searched,
                "step_s": self.step,
                "simulations": self.simulations,
                "total_wall_s": self.total_wall_s,
                "notes": self.notes,
            }
        )
        return report


# parameters: one for each option of the command, all but the shot and the file by keyword
def export(
    shot: Shot | SimulationResult | Path,
    file: Path | None = None,
    *,
    to: str,
    rate: float = 100.0,
    start_delay: float | str = 0.0,
    tolerance: float | str | None = None,
    allowed_loss: float | str | None = None,
    search: bool = True,
    operators: Sequence[str] = (),
    settings: Given = None,
    progress: Callable[[Progress], None] | None = None,
    on_operator: Callable[[Any], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Export:
    """Write the motor curves as commands for a controller, and measure what playing them costs.

    The file is read back, interpolated as its player does it, and simulated.

    Args:
        shot: A result, a shot, or a USD file: a shot, or a layer that `simulate` or `optimize` wrote beside its root
            layer.
        file: File to write; None: named after the shot, in the working folder.
        to: Name of the format; `formats` lists them.
        rate: Commands a second [Hz].
        start_delay: How late the player starts, [s] or text with a unit (`"5ms"`).
        tolerance: Accuracy of the simulation at the targets, [m] or text with a unit; None: the shot's own.
        allowed_loss: Loss that is accepted at the targets, [m] or text with a unit; None: the tolerance.
        search: Look for the lowest rate that keeps the allowed loss as well.
        operators: Idnames of operators of plugins to run as well, with a shot.
        settings: Settings of operators.
        progress, on_operator, cancel: As of `simulate`.

    Raises:
        ShotError: The shot cannot be processed, or the file cannot be written.
        SettingError: An argument does not fit.
    """
    begin = time.perf_counter()
    given = given_export(to, rate, start_delay, tolerance, allowed_loss)
    chosen, hooks = read_settings(settings), Hooks(progress, on_operator, cancel)
    if isinstance(shot, SimulationResult):
        opened, result, outcome = shot.shot, shot.result, shot.outcome
        cls = format_named(opened.host, to)
    else:
        opened, result = shot if isinstance(shot, Shot) else Shot(with_shot(os.fspath(shot))), None
        cls = format_named(opened.host, to)
        outcome = carry_out(opened, "simulate", wanted=_READ, operators=operators, settings=chosen, hooks=hooks)
    refuse_beyond_format(cls.highest_rate, given)
    target = os.fspath(file) if file is not None else f"{FilePath(opened.path).stem}{cls.suffix}"
    refuse_overwriting(opened.inputs, {"-o": target})
    character = outcome.require(Character)
    refuse_layers(opened.path, outcome.require(Provenance), character, {"-o": target})
    refuse_beyond_shot(character, outcome.require(Animation), given)
    exporter = _Exporter(outcome, result, given, chosen, hooks, highest=cls.highest_rate)
    # what is wrong with the format's settings is refused here, before the first mesh
    written = exporter.written(given.rate, target)
    compiled = (
        outcome
        if result is not None
        else compiled_run(opened, Source("", "", RunSettings(tolerance=given.tolerance)), chosen, hooks)
    )
    made = exporter.measured(written, compiled, search)
    return replace(made, total_wall_s=time.perf_counter() - begin)


def write_curves(
    result: SimulationResult, file: Path, *, to: str = "csv", rate: float = 500.0, settings: Given = None
) -> str:
    """Write the motor curves of a result as commands, without a look at what playing them costs; returns the path.

    Args:
        result: With the curves.
        file: File to write.
        to: Name of the format.
        rate: Commands a second [Hz].
        settings: Settings of operators, such as `{"export.csv.angles": "deg"}`.

    Raises:
        RunError: It cannot be written.
        SettingError: There is no such format, it has no such rate, or the file is read as the shot.
    """
    refuse_beyond_format(format_named(result.shot.host, to).highest_rate, given_export(to, rate))
    request = ExportRequest(to, rate, no_input(result.outcome, file))
    curves = curves_of(result.outcome, result.result)
    return write_commands(result.outcome, curves, request, read_settings(settings)).files[0]


class _Exporter:
    """Writes and plays the commands of one shot.

    Args:
        outcome: A run that read the shot.
        result: With optimised curves, or None.
        given: What the user wants.
        settings: Of operators.
        hooks: Progress and cancelling.
        highest: Rate that the player of the format takes at most [Hz].
    """

    def __init__(
        self, outcome: Outcome, result: Result | None, given: GivenExport, settings: Settings, hooks: Hooks, *,
        highest: float,
    ) -> None:  # fmt: skip
        self._highest = int(min(max(HIGHEST, given.rate), highest))
        self._outcome, self._given, self._settings, self._hooks = outcome, given, settings, hooks
        self._curves = curves_of(outcome, result)
        self._playback: Playback
        self._allowed, self._finer = 0.0, 1.0

    def written(self, rate: float, file: str) -> WrittenCommands:
        """Commands at a rate [Hz], written to a file."""
        return write_commands(
            self._outcome, self._curves, ExportRequest(self._given.format, rate, file), self._settings
        )

    def measured(self, written: WrittenCommands, outcome: Outcome, search: bool) -> Export:
        """The loss by written commands, on the robot that a run compiled."""
        given, source = self._given, outcome.run.get(Source)
        options = source.settings if source is not None else RunSettings()
        compiled: CompiledShot = compiled_in(outcome.run.get)
        self._playback = Playback(compiled, options, self._curves)
        tolerance = tolerance_of(compiled.character, given.tolerance or options.tolerance)
        self._allowed = tolerance if given.allowed_loss is None else given.allowed_loss
        targets = tuple(target.path for target in compiled.character.targets)
        self._tell(0.1, "playing the commands")
        step, rounded = self._converged(written.read, given.rate)
        exact = self._loss(written.exact, step)
        loss = self._loss(written.read, step, given.delay) if given.delay else rounded
        lowest = self._lowest(loss) if search else None
        switched = [compiled.character.motors[motor].path for motor in switched_motors(compiled.character)]
        notes = written.notes
        if switched:
            what = f"calm:motor:powered switches {', '.join(switched)} off and on, which the file does not say"
            notes += (f"{what}; its player has to do so at the same times, and the loss is that of a player that does",)
        names = {motor.path: name for motor, name in zip(self._curves.motors, self._curves.names, strict=True)}
        return Export(
            given.format, written.files, given.rate, given.delay, written, targets, loss, exact, rounded,
            self._playback.fastest(step), lowest, tolerance, self._allowed, step, self._playback.simulations, names,
            search, 0.0, notes,
        )  # fmt: skip

    def _loss(self, commands: Commands, step: float, delay: float = 0.0) -> Loss:
        return self._playback.loss(commands, step, delay)

    def _converged(self, commands: Commands, rate: float) -> tuple[float, Loss]:
        """A step that resolves what the commands do to the robot [s], and the loss with it."""
        step = self._playback.step_for(1.0 / rate)
        loss = self._loss(commands, step)
        for _ in range(HALVINGS):
            finer = self._loss(commands, 0.5 * step)
            scale = max(finer.largest, 0.1 * self._allowed)
            change = float(np.max(np.abs(finer.distances - loss.distances), initial=0.0))
            if change <= CONVERGED * scale:
                break
            step, loss = 0.5 * step, finer
        self._finer = self._playback.step_for(1.0 / rate) / step
        return step, loss

    def _lowest(self, loss: Loss) -> int | None:
        """The lowest rate that keeps the allowed loss, from files that are written for the purpose and removed."""
        given, tried = self._given, 0
        known = {int(given.rate): loss.largest} if float(given.rate).is_integer() else {}
        with temporary_folder() as folder:

            def at(rate: int) -> float:
                nonlocal tried
                tried += 1
                self._tell(min(0.95, 0.3 + 0.07 * tried), f"playing {rate} commands a second")
                written = self.written(float(rate), str(folder / f"at_{rate}"))
                step = self._playback.step_for(1.0 / rate) / self._finer
                return self._loss(written.read, step, given.delay).largest

            return lowest_rate(at, self._allowed, known, self._highest)

    def _tell(self, fraction: float, message: str) -> None:
        self._hooks.tell("Play the commands", fraction, message)
