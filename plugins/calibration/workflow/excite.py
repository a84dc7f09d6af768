"""Find a test motion for a robot: the command as a function."""

import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from calmotion.errors import ShotError
from calmotion.host import SettingError, parse_quantity, quantity_of
from calmotion.model import Character, Provenance, RunSettings
from calmotion.recordings import ACCELEROMETER, ANGLE, EFFORT, MARKER
from calmotion.tolerance import compiled_in
from calmotion.usd import write_performance
from calmotion.version import __version__
from calmotion.workflow import Given, Hooks, Path, Progress, Shot, plain, read_settings

from ..identification.excitation.design import ExcitationSettings, blank_recordings, excite_shot
from ..identification.parameters import refuse_unknown
from ..model import kinds
from ..model.excitation import Excitation, PlannedSensor
from .calibrate import compiled_with_sensors, with_sensors

# Standard deviation of the noise, and samples in a second, of sensors of which the user says nothing else.
NOISE = {ACCELEROMETER: (0.1, 400.0), MARKER: (3e-4, 120.0), ANGLE: (3e-4, 200.0), EFFORT: (0.02, 200.0)}
SENSORS = (ACCELEROMETER, ANGLE)
_UNITS = {MARKER: "m", ACCELEROMETER: "", ANGLE: "", EFFORT: ""}
_FORM = re.compile(r"([a-z]+)(?:@(/[^=]+))?(?:=(.+))?")


@dataclass(frozen=True, eq=False)
class ExcitedShot:
    """A test motion.

    Attributes:
        excitation: The motion, and what a recording of it would tell.
        layer: The written layer, which opens the shot with the motion, or None.
        total_wall_s: Time of all of it [s].
    """

    excitation: Excitation
    layer: str | None
    total_wall_s: float

    def report(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        found = self.excitation
        report: dict[str, Any] = plain(
            {
                "command": "excite",
                "version": __version__,
                "parameters": [
                    {
                        "name": row.name, "kind": row.kind, "path": row.path, "unit": row.unit, "value": row.nominal,
                        "prior": {"value": row.nominal, "standard_deviation": row.prior},
                        "standard_deviation": row.excited, "standard_deviation_chirp": row.chirp,
                        "identifiable": row.identifiable,
                    }
                    for row in found.predicted
                ],
                "motors": [vars(row) for row in found.motors],
                "sensors": [vars(row) for row in found.sensors],
                "clearances": [
                    {"bodies": [row.first, row.second], "first_pose_m": row.apart, "least_m": row.least}
                    for row in found.clear
                ],
                "unchecked_pairs": [list(pair) for pair in found.together],
                "duration_s": float(found.times[-1]),
                "information": found.information,
                "motions": found.evaluations,
                "wall_s": found.wall_s,
                "total_wall_s": self.total_wall_s,
                "layer": self.layer,
            }
        )  # fmt: skip
        return report


# parameters: one for each option of the command, all but the shot by keyword
def excite(
    shot: Shot | Path,
    *,
    layer: Path | None = None,
    sensors: Sequence[str] = SENSORS,
    parameters: Sequence[str] = kinds.DEFAULT,
    priors: Mapping[str, float] | None = None,
    duration: float | str = 4.0,
    amplitude: float | str = "10deg",
    tries: int = 1000,
    by_motor_type: bool = False,
    step: float | str | None = None,
    operators: Sequence[str] = (),
    settings: Given = None,
    progress: Callable[[Progress], None] | None = None,
    on_operator: Callable[[Any], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> ExcitedShot:
    """Find a short test motion within all limits whose recording tells the parameters of a robot.

    Args:
        shot: The shot, or its USD file: the robot, its first pose, and how fast it may move.
        layer: USD layer to write; it opens the shot with the motion.
        sensors: What will record it: kinds (`marker`, `accelerometer`, `angle`, `effort`), at all targets or motors, or
            as `KIND@/PRIM`; each with `=NOISE`, its standard deviation in SI or with a unit.
        parameters, priors: As of `calibrate`.
        duration: [s] or text with a unit.
        amplitude: Largest excursion of a hinge from the first pose, [rad] or text with a unit.
        tries: Number of motions that are compared.
        by_motor_type: As of `calibrate`.
        step: Of the simulations, [s] or text with a unit.
        operators, settings, progress, on_operator, cancel: As of `simulate`.

    Raises:
        ShotError: The shot cannot be processed, or nothing may move.
        SettingError: An argument does not fit.
    """
    begin = time.perf_counter()
    refuse_unknown(parameters, priors or {})
    chosen, hooks = read_settings(settings), Hooks(progress, on_operator, cancel)
    wanted = [sensor_of(text) for text in sensors]
    named = blank_recordings([sensor for sensor in wanted if sensor.path], 1.0)
    options = RunSettings(step=quantity_of(step, "s", "step"))
    target = None if layer is None else os.fspath(layer)
    outcome = compiled_with_sensors(with_sensors(shot), named, options, target, operators, chosen, hooks)
    character = outcome.require(Character)
    _refuse_other_drives(character)
    length, largest = quantity_of(duration, "s", "duration"), quantity_of(amplitude, "rad", "amplitude")
    assert length is not None and largest is not None
    found = excite_shot(
        compiled_in(outcome.run.get),
        ExcitationSettings(
            _placed(wanted, character), tuple(parameters), dict(priors or {}), length, largest, tries=tries,
            by_motor_type=by_motor_type,
        ),
        options, partial(hooks.tell, "Find a test motion"),
    )  # fmt: skip
    if target is not None:
        write_performance(target, outcome.require(Provenance), character, (found.times, found.values), {})
    return ExcitedShot(found, target, time.perf_counter() - begin)


def sensor_of(text: str) -> PlannedSensor:
    """A sensor as the user names it; one without a prim has an empty path.

    Raises:
        SettingError: There is no such kind of sensor, or its noise is not a positive number.
    """
    match = _FORM.fullmatch(text)
    if match is None or match[1] not in NOISE:
        raise SettingError(
            "there is no such sensor",
            path="--sensor",
            found=text,
            remedy=f"Write KIND, KIND@/PRIM or KIND@/PRIM=NOISE; kinds are {', '.join(NOISE)}.",
        )
    kind, path, noise = match.groups()
    sigma, rate = NOISE[kind]
    if noise is not None:
        sigma = parse_quantity(noise, _UNITS[kind])
        if not sigma > 0.0:
            raise SettingError(
                "the noise of a sensor must be positive",
                path="--sensor",
                found=text,
                remedy="Write its standard deviation, such as marker=0.3mm.",
            )
    return PlannedSensor(kind, path or "", sigma, rate)


def _placed(sensors: Sequence[PlannedSensor], character: Character) -> tuple[PlannedSensor, ...]:
    """Sensors at all targets or motors where no prim is named."""
    found: dict[tuple[str, str], PlannedSensor] = {}
    for sensor in sensors:
        owners = character.motors if sensor.kind in (ANGLE, EFFORT) else character.targets
        for path in [sensor.path] if sensor.path else [owner.path for owner in owners]:
            found[sensor.kind, path] = PlannedSensor(sensor.kind, path, sensor.sigma, sensor.rate)
    return tuple(found.values())


def _refuse_other_drives(character: Character) -> None:
    for motor in character.motors:
        if not motor.attribute.startswith("drive:"):
            raise ShotError(
                "a test motion can be written only to drives; this motor follows the animation of bodies or a skeleton",
                path=motor.path,
                attribute=motor.attribute,
                remedy="Apply PhysicsDriveAPI to the joint",
            )
