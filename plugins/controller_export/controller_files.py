"""Files of commands for motor controllers, in the formats that plugins add."""

from pathlib import Path

import numpy as np
from calmotion.errors import ShotError
from calmotion.host import Host, SettingError, Settings, nearest
from calmotion.model import Animation, Character, Provenance, Result, commanded_curves
from calmotion.support import distinct_names
from calmotion.workflow import Outcome, again, refuse_unwritable

from .command_format import CommandFormat
from .commands import ExportRequest, MotorCurves, WrittenCommands


def formats(host: Host) -> dict[str, type[CommandFormat]]:
    """The formats that plugins add, by name."""
    found = [cls for cls in host.providers(WrittenCommands) if issubclass(cls, CommandFormat)]
    return {cls.format: cls for cls in sorted(found, key=lambda cls: cls.format)}


def format_named(host: Host, name: str) -> type[CommandFormat]:
    """The format of that name.

    Raises:
        SettingError: There is none.
    """
    known = formats(host)
    if name not in known:
        failed = "; ".join(f"{plugin.id}: {plugin.error}" for plugin in host.failures())
        raise SettingError(
            "there is no such format",
            path="--to",
            found=name,
            remedy=f"{nearest(str(name), known)}Use one of {', '.join(known)}."
            + (f" Plugins that failed: {failed}" if failed else ""),
        )
    return known[name]


def curves_of(outcome: Outcome, result: Result | None) -> MotorCurves:
    """The curves of a shot's motors: the optimised ones of a result, else what the shot carries.

    Raises:
        ShotError: There are no motors.
    """
    character, animation = outcome.require(Character), outcome.require(Animation)
    if result is not None:
        animation = result.performed_animation(animation)
    if not character.motors:
        raise ShotError(
            "the shot has no motors to export", path=character.path, remedy="Animate the drives of its joints."
        )
    motors = character.motors
    own = [character.joints[motor.joint].name or motor.path.rsplit("/", 1)[-1] for motor in motors]
    if len(set(own)) < len(own):
        short = distinct_names([motor.path for motor in motors])
        own = [short[motor.path] for motor in motors]
    limits = np.array([[character.joints[m.joint].lower, character.joints[m.joint].upper] for m in motors])
    shot = Path(outcome.require(Provenance).shot).name
    return MotorCurves(
        shot, float(animation.frame_times[-1]), character.retarget.cyclic, motors, tuple(own), limits.reshape(-1, 2),
        commanded_curves(character, animation, result),
    )  # fmt: skip


def write_commands(
    outcome: Outcome, curves: MotorCurves, request: ExportRequest, settings: Settings | None = None
) -> WrittenCommands:
    """Write commands and read them back.

    Args:
        outcome: A run that read the shot.
        curves: Of its motors.
        request: Format, rate and file.
        settings: Of operators, stronger than the shot's.

    Raises:
        RunError: They cannot be written.
    """
    refuse_unwritable(request.file)
    return again(outcome, WrittenCommands, curves, request, settings=settings)
