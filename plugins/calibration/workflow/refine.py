"""A recorded take improves the model of the robot and the curves of the next take: the command as a function."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.model import OutputPaths, RunSettings
from calmotion.retargeting import errors_on, random_scenarios, uncertain_parameters
from calmotion.tolerance import compiled_in, found_tracks
from calmotion.usd import CALIBRATION, open_stage, refuse_layers_of, role_of
from calmotion.workflow import (
    Given,
    OptimizationResult,
    Path,
    Progress,
    Shot,
    SimulationResult,
    optimize,
    plain,
    refuse_unwritable,
    simulate,
)

from ..model import kinds
from .calibrate import CalibratedShot, calibrate

DRAWS = 20  # robots within the error of the calibration, on which the new curves are measured


@dataclass(frozen=True, eq=False)
class RefinedShot:
    """What a take brought.

    Attributes:
        calibrated: The model with which the take agrees.
        played: The curves of the take on this model.
        optimized: The new curves.
        take: Number of the take, 1 for the first one.
        expected: Largest error of each target with the new curves on robots within the error of the calibration [m],
            shape [S, K].
        total_wall_s: Time of all of it [s].
    """

    calibrated: CalibratedShot
    played: SimulationResult
    optimized: OptimizationResult
    take: int
    expected: Array
    total_wall_s: float

    @property
    def layer(self) -> str | None:
        """The layer with the new curves; its root layer opens it over the new model and the shot."""
        written = self.optimized.report()["layer"]
        return None if written is None else str(written)

    def report(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        found, played = self.optimized.report(), self.played.report()
        errors = {row["path"]: row["max_error_m"] for row in played["targets"]}
        targets = [
            {
                "path": row["path"],
                "max_error_played_m": errors[row["path"]],
                "max_error_m": row["max_error_after_m"],
                "expected_max_error_m": float(np.median(column)),
                "expected_p95_max_error_m": float(np.quantile(column, 0.95)),
            }
            for row, column in zip(found["targets"], self.expected.T, strict=True)
        ]
        calibration = self.calibrated.report()
        report: dict[str, Any] = plain(
            {
                **calibration,
                "command": "refine",
                "take": self.take,
                "targets": targets,
                "draws": len(self.expected),
                "model": calibration["layer"],
                "model_root": calibration["root"],
                "layer": found["layer"],
                "root": found["root_layer"],
                "iterations_of_curves": found["iterations"],
                "total_wall_s": self.total_wall_s,
            }
        )
        return report


# parameters: one for each option of the command, all but the shot and the recordings by keyword
def refine(
    shot: Shot | Path,
    recordings: Sequence[Path] | Path,
    *,
    layer: Path,
    parameters: Sequence[str] = kinds.DEFAULT,
    priors: Mapping[str, float] | None = None,
    by_motor_type: bool = False,
    tolerance: float | str | None = None,
    step: float | str | None = None,
    operators: Sequence[str] = (),
    settings: Given = None,
    progress: Callable[[Progress], None] | None = None,
    on_operator: Callable[[Any], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> RefinedShot:
    """Calibrate the robot from a take of its current curves, and optimise these for the new model.

    The model goes into a layer beside the new curves, `<stem>_model.usda`. The root layer of the new curves opens both
    over the shot, and is the shot of the next take.

    Args:
        shot: The shot that was performed, with its curves: the root layer of the last take, or of `optimize`.
        recordings: Of this take, as of `calibrate`.
        layer: USD layer to write.
        parameters, priors, by_motor_type, step: As of `calibrate`.
        tolerance: Of model and curves, [m] or text with a unit.
        operators, settings, progress, on_operator, cancel: As of `simulate`.

    Raises:
        ShotError: The shot cannot be processed, or a recording does not fit it.
        SettingError: An argument does not fit.
    """
    begin, target = time.perf_counter(), os.fspath(layer)
    opened = shot if isinstance(shot, Shot) else Shot(shot)
    _refuse(opened.path, target)
    model = f"{os.path.splitext(target)[0]}_model.usda"
    common: dict[str, Any] = {
        "tolerance": tolerance, "operators": operators, "settings": settings, "progress": progress,
        "on_operator": on_operator, "cancel": cancel,
    }  # fmt: skip
    calibrated = calibrate(
        opened,
        recordings,
        layer=model,
        parameters=parameters,
        priors=priors,
        step=step,
        by_motor_type=by_motor_type,
        **common,
    )
    assert calibrated.layer is not None
    root = calibrated.layer.root
    improved = opened.unread(root)
    played = simulate(improved, **common)
    improved.forget()
    optimized = optimize(improved, outputs=OutputPaths(layer=target), **common)
    return RefinedShot(
        calibrated, played, optimized, takes_of(root), expected_errors(optimized), time.perf_counter() - begin
    )


def _refuse(shot: str, layer: str) -> None:
    """Refuse what the last step would refuse, before the first one writes the model."""
    refuse_unwritable(layer)
    refuse_layers_of(shot, layer)


def takes_of(root: str) -> int:
    """Number of takes that a shot carries."""
    stage = open_stage(root)  # its layers live as long as it does
    return sum(role_of(layer) == CALIBRATION for layer in stage.GetLayerStack())


def expected_errors(optimized: OptimizationResult, draws: int = DRAWS) -> Array:
    """Largest errors of the targets with the new curves on robots within the error of the calibration [m].

    Args:
        optimized: Of a shot with a calibration.
        draws: Number of robots.

    Returns:
        Shape [draws, K].
    """
    shot = compiled_in(optimized.outcome.run.get)
    tracks = found_tracks(optimized.result, shot.animation)
    robots = random_scenarios(uncertain_parameters(shot), draws)
    options = RunSettings(step=optimized.result.step_s, pre_roll=optimized.result.pre_roll_s)
    return errors_on(shot, options, {"found": tracks}, robots)["found"][..., 0]
