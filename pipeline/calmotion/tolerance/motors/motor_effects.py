"""How far compliant motors move the targets: by the gains that a shot carries, and their part of its error."""

from dataclasses import replace
from functools import partial

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import Result
from calmotion.model.character import Character, motors_give, with_ideal_motors
from calmotion.model.motor import PRESCRIBED, SERVO
from calmotion.model.outputs import MotorEffects
from calmotion.model.result import ErrorShares
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, rigid_model, with_drives
from calmotion.simulation.compiled_shot import CompiledShot, compile_shot
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.forward import run_forward
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.preparation import Prepared, prepare
from calmotion.simulation.simulate import Progress, intended_motion
from calmotion.tolerance.integrator_choice import by_fast_scheme
from calmotion.tolerance.simulation import own_step


def with_gains_used(character: Character) -> Character:
    """The character with every ideal motor that has gains as a drive, or as a servo where its rotor is known; coupled
    motors are both servos, or both ideal where one has no gains."""
    models = [motor.model_of_gains for motor in character.motors]
    for k, motor in enumerate(character.motors):
        if motor.turns_with is not None:
            pair = [k, motor.turns_with.other]
            model = PRESCRIBED if any(models[own] == PRESCRIBED for own in pair) else SERVO
            models = [model if own in pair else found for own, found in enumerate(models)]
    motors = (replace(motor, model=model) for motor, model in zip(character.motors, models, strict=True))
    return replace(character, motors=tuple(motors))


_UNKNOWN = MotorEffects((), *4 * (np.zeros(0),))


def effects_of_gains(shot: CompiledShot, options: RunSettings) -> MotorEffects:
    """What the gains that a shot carries would do to its animation; of no motors where it has none, or where the robot
    would not follow it.

    Args:
        shot: Its motors may be ideal.
        options: Of the run.

    Raises:
        ShotError: The shot cannot be simulated.
    """
    character = with_gains_used(shot.character)
    if not motors_give(character):
        return _UNKNOWN
    options = replace(options, step=own_step(character, options))
    prepared = prepare(shot, options)
    found = []
    for model in (_giving_model(shot, character), _with_ideal_motors(shot)):
        try:
            errors = by_fast_scheme(options, partial(_errors, prepared, model))
        except ShotError:
            return _UNKNOWN
        lag = errors[prepared.grid.judged].max(axis=0, initial=0.0)
        found += [lag, np.zeros_like(lag) if prepared.grid.cyclic else errors[0]]
    return MotorEffects(tuple(m.path for m in character.motors if m.model != PRESCRIBED), *found)


def _giving_model(shot: CompiledShot, character: Character) -> Model:
    """The robot on compliant motors; on rigid links where one of its motors could not stand on a flexible one."""
    try:
        return compile_shot(character, shot.animation, shot.bodies).model
    except ShotError:
        return with_drives(rigid_model(shot.model), character.motors)


def with_error_shares(shot: CompiledShot, result: Result, options: RunSettings, progress: Progress) -> Result:
    """The result with the parts of the motors and of the links in the error of the animated curves: what is left of it
    where the other of the two is ideal. The result itself where motors are ideal, where its input is no animation, or
    where one of these robots cannot be simulated, though the robot itself was.
    """
    character, animation = shot.character, shot.animation
    if not motors_give(character) or (result.after is None and animation.current is not animation.tracks):
        return result
    progress(0.99, "the parts of motors and links in the error")
    of_step = replace(options, step=result.step_s)

    def largest(model: Model, options: RunSettings) -> Array:
        prepared = prepare(shot, options)
        return np.asarray(_errors(prepared, model, options)[prepared.grid.judged].max(axis=0, initial=0.0))

    models = with_drives(rigid_model(shot.model), character.motors), _with_ideal_motors(shot)
    try:
        motors, links = (by_fast_scheme(of_step, partial(largest, model)) for model in models)
    except ShotError:
        return result
    return replace(result, error_shares=ErrorShares(motors, links))


def _with_ideal_motors(shot: CompiledShot) -> Model:
    return compile_shot(with_ideal_motors(shot.character), shot.animation, shot.bodies).model


def _errors(prepared: Prepared, model: Model, options: RunSettings) -> Array:
    """Distances of the targets from what is intended while a model follows the animated curves [m], shape [T, K].

    Raises:
        ShotError: The model cannot be simulated.
    """
    grid, tracks = prepared.grid, prepared.shot.animation.tracks
    angles, rates = sample_tracks(tracks, grid)
    workspace = Workspace.for_system(model.system)
    steady = SteadyState(model, prepared.world, grid.h, workspace) if grid.cyclic else None
    try:
        run = run_forward(
            model, workspace, angles, rates, grid.h, prepared.world, integrator=options.scheme, steady=steady
        )
    except SimulationFailure as failure:
        # never shown: both callers go on without it
        raise IntegrationError(str(failure), path=prepared.character.path) from failure
    intended = intended_motion(prepared, angles, rates)
    return np.asarray(np.linalg.norm(run.target_positions - intended.target_positions, axis=2))
