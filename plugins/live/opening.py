"""From a shot to a robot that can be streamed to."""

import os
from dataclasses import replace

from calmotion.host import Settings, quantity_of
from calmotion.model import RunSettings, Source
from calmotion.simulation import CompiledShot
from calmotion.tolerance import compiled_in
from calmotion.workflow import Hooks, Shot, compiled_run

from .session import Live
from .settings import LiveSettings


def live(
    shot: Shot | str | os.PathLike[str],
    *,
    lookahead: float | str = 0.12,
    rate: float = 250.0,
    settings: LiveSettings | None = None,
    operators: Settings | None = None,
    hooks: Hooks | None = None,
) -> Live:
    """Calm commands from a stream of joint angles.

    Args:
        shot: The robot, as for `calmotion.simulate`.
        lookahead: How late the robot may answer: [s], or text with a unit ("120ms").
        rate: Commands a second [Hz].
        settings: The rest; look-ahead and rate in it are not read.
        operators: Settings of operators, as of meshes.
        hooks: Progress, cancelling.

    Raises:
        ShotError: The robot cannot be simulated, or not live.
        SettingError: A rate or a look-ahead that does not fit, or that this machine cannot keep.
    """
    seconds = quantity_of(lookahead, "s", "lookahead")
    assert seconds is not None
    chosen = replace(settings or LiveSettings(), lookahead=seconds, rate=float(rate))
    return Live(compiled(shot if isinstance(shot, Shot) else Shot(shot), operators, hooks), chosen)


def compiled(shot: Shot, operators: Settings | None = None, hooks: Hooks | None = None) -> CompiledShot:
    """The compiled robot of a shot.

    Raises:
        ShotError: It cannot be made.
    """
    return compiled_in(compiled_run(shot, Source("", "", RunSettings()), operators, hooks).run.get)
