"""What limits the tempo of a compiled shot: its curves, and the efforts of its rigid robot."""

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Track
from calmotion.model.curves import held_curve
from calmotion.model.motor import measure_of
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import rigid_model
from calmotion.retargeting.retiming.tempo import TempoInput
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.forward import run_forward
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.preparation import failure_error, modes_of, prepare
from calmotion.tolerance.motors.animation_limits import rigid_efforts, tempo_limits


def tempo_input(shot: CompiledShot, options: RunSettings, tracks: Sequence[Track]) -> TempoInput:
    """What the tempo of a shot follows from, if its motors do what some tracks say.

    Raises:
        ShotError: The rigid robot cannot follow them, where efforts are limited.
    """
    prepared, limits = prepare(shot, options), tempo_limits(shot.character)
    grid, end = prepared.grid, float(shot.animation.frame_times[-1])
    each = [held_curve(track, end) for track in tracks]

    def curves(times: Array, order: int) -> Array:
        return np.stack([curve(times, order) for curve in each], axis=1)

    efforts = None
    if np.any(np.isfinite(limits.effort)):
        model, sampled = rigid_model(prepared.model), sample_curves(tracks, grid)
        try:
            run = run_forward(
                model, Workspace.for_system(model.system), sampled.angles, sampled.rates, grid.h, prepared.world
            )
            efforts = rigid_efforts(model, grid, prepared.world, sampled, run)
        except SimulationFailure as failure:
            raise failure_error(prepared, failure) from failure
    frames = shot.animation.frame_times
    motors = shot.character.motors
    return TempoInput(
        grid.times[grid.judged], curves, limits, efforts, float(frames[1] - frames[0]),
        float(np.min(modes_of(prepared)[0], initial=np.inf)),
        tuple(motor.path for motor in motors), tuple(measure_of(motor).effort_unit for motor in motors),
    )  # fmt: skip
