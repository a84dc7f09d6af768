"""Simulate a shot as animated."""

import time
from collections.abc import Callable

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Result, Track
from calmotion.model.character import contact_joints, switched_motors
from calmotion.model.limits.bounds import excesses, motor_bounds
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.simulation.bodies import mode_tables, skins
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.forward import limited_values, run_forward
from calmotion.simulation.inputs.curves import sample_curves, sample_tracks
from calmotion.simulation.inputs.open_chains import refuse_open_joints
from calmotion.simulation.inputs.shapers import shaped
from calmotion.simulation.inputs.supported import refuse_half_turns
from calmotion.simulation.intended_motion import rigid_motion, static_motion
from calmotion.simulation.preparation import Prepared, failure_error, modes_of, prepare
from calmotion.simulation.report import left_out_rows, limit_uses, performed_motion, reference_motion, simulation_of
from calmotion.simulation.target_errors import IntendedMotion, Objective

Progress = Callable[[float, str], None]


def intended_motion(prepared: Prepared, angles: Array, rates: Array) -> IntendedMotion:
    """What the targets should do, as `calm:retarget:reference` says.

    Args:
        angles, rates: The animator's, shape [T, M].
    """
    rigid = rigid_motion(prepared.model, angles, rates, prepared.grid.h, prepared.world, prepared.grid.cyclic)
    if prepared.character.retarget.reference == "rigid":
        return rigid
    return static_motion(prepared.model, rigid, angles, prepared.grid.times >= 0.0, prepared.world)


def shape_tracks(shot: CompiledShot, options: RunSettings, kind: str, cutoff: float) -> tuple[Track, ...]:
    """The shot's tracks through an input shaper or a filter, sampled at the steps of its simulation.

    Args:
        kind: One of `calmotion.model.run.SHAPERS`.
        cutoff: Of the low-pass filter, over the lowest frequency.

    Raises:
        ShotError: There is no such shaper, nothing to shape for, or contacts that come and go, or motors that are
            switched.
    """
    character = shot.character
    changing = [character.joints[joint].path for joint in contact_joints(character)]
    changing += [character.motors[motor].path for motor in switched_motors(character)]
    if changing:
        raise ShotError(
            "a shaper delays the motion, and contacts with the ground and switches of motors would not be",
            path=changing[0],
            attribute="--shaper",
            found=kind,
            remedy="Leave it out; calmotion optimize calms the motion without a delay.",
        )
    prepared = prepare(shot, options)
    grid, curves = prepared.grid, sample_curves(shot.animation.current, prepared.grid)
    found = shaped(curves, grid, kind, *modes_of(prepared), cutoff)
    return tuple(Track(grid.times, column) for column in found.angles.T)


def simulate_shot(shot: CompiledShot, options: RunSettings, progress: Progress) -> Result:
    """Simulate the shot as animated, and measure it against the rigid motion of the animator's intent."""
    prepared, character, animation = prepare(shot, options), shot.character, shot.animation
    model, grid, world = prepared.model, prepared.grid, prepared.world
    workspace = Workspace.for_system(model.system)
    curves = sample_curves(animation.current, grid)
    angles, rates = curves.angles, curves.rates
    intended, intended_rates = sample_tracks(animation.tracks, grid)
    refuse_half_turns(character, grid, angles)
    try:
        reference = intended_motion(prepared, intended, intended_rates)
        progress(0.0, "loading kernels (compiled in the first run)")
        run_forward(model, workspace, angles[:3], rates[:3], grid.h, world[:3], integrator=options.scheme)
        begin = time.perf_counter()
        steady = SteadyState(model, world, grid.h, workspace) if grid.cyclic else None
        run = run_forward(
            model, workspace, angles, rates, grid.h, world, lambda fraction: progress(fraction, "simulating"),
            options.scheme, steady,
        )  # fmt: skip
        wall = time.perf_counter() - begin
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure
    refuse_open_joints(character, model, grid, run, options)
    objective = Objective.over(model, reference, grid, animation.weights)
    bounds = motor_bounds(character)
    used = excesses(bounds, limited_values(model, bounds, curves, run), grid.judged)
    residuals, _ = objective.residuals(run.target_positions, run.target_rotations)
    intent = reference_motion(model, grid, reference, intended)
    as_intended = animation.current is animation.tracks and character.retarget.reference == "rigid"
    return Result(
        reference=intent,
        before=simulation_of(prepared, run, reference),
        after=None,
        skins=skins(prepared.bodies),
        modes=mode_tables(prepared.bodies),
        curves=(),
        objective_before=0.5 * float(np.sum(residuals**2)),
        objective_after=None,
        wall_s=wall,
        step_s=grid.h,
        pre_roll_s=grid.pre_roll,
        dof=model.dof,
        left_out=tuple(left_out_rows(prepared)),
        limits=limit_uses(used, used, grid),
        performed=intent if as_intended else performed_motion(prepared, curves),
    )
