"""Limits of the motors that an animation exceeds, before anything is meshed: what `inspect` tells."""

import contextlib

import numpy as np
from scipy.interpolate import CubicSpline

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Animation, Character
from calmotion.model.character import with_ideal_motors
from calmotion.model.limits.base import CurveLimit
from calmotion.model.limits.bounds import excesses, motor_bounds
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.model.limits.use import is_exceeded
from calmotion.model.outputs import ExceededLimits
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.analysis.rigid_response import motor_responses
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, body_anchors, rigid_body
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.forward import ForwardRun, limited_values, run_forward
from calmotion.simulation.inputs.curves import Curves, sample_curves
from calmotion.simulation.inputs.tempo import TEMPO_LIMITS, MotorEfforts, TempoLimits, few_instants, needed_tempo
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.preparation import prepare
from calmotion.simulation.report import limit_uses
from calmotion.tolerance.simplification.by_rigid_poses import with_rough_masses


def exceeded_limits(character: Character, animation: Animation, options: RunSettings) -> ExceededLimits:
    """The limits that an animation exceeds on a rigid robot with ideal motors, each where it does most.

    Efforts are those of rigid links: flexible ones swing about them. Links without a stated mass have that of their
    closed surface, or of half of the box around it. Where the robot cannot follow the animation, efforts are unknown,
    and so is the tempo at which it could where efforts are limited.

    Args:
        character, animation: The shot.
        options: Of the run.
    """
    bounds = motor_bounds(character)
    if not bounds:
        return ExceededLimits(())
    tree, rough = span_tree(character), with_rough_masses(with_ideal_motors(character))
    rigid = [rigid_body(body, own) for body, own in zip(rough.bodies, body_anchors(rough, tree), strict=True)]
    prepared = prepare(compile_shot(rough, animation, rigid), options)
    model, grid, world = prepared.model, prepared.grid, prepared.world
    curves, workspace = sample_curves(animation.tracks, grid), Workspace.for_system(model.system)
    steady = SteadyState(model, world, grid.h, workspace) if grid.cyclic else None
    run: ForwardRun | None
    try:
        run = run_forward(model, workspace, curves.angles, curves.rates, grid.h, world, steady=steady)
        values = limited_values(model, bounds, curves, run)
    except (SimulationFailure, ShotError):  # `simulate` says what is wrong
        run = None
        kinds = {name: kind for name, kind in kinds_of_limits().items() if isinstance(kind, CurveLimit)}
        values = {name: curves.derivatives[kinds[name].order] for name in bounds if name in kinds}
        bounds = {name: bounds[name] for name in values}
    found = excesses(bounds, values, grid.judged)
    uses = tuple(use for use in limit_uses(found, found, grid) if is_exceeded(use))
    slower = [use for use in uses if use.quantity != "position"]
    efforts = None
    if slower and "effort" in values and run is not None and steady is None:
        with contextlib.suppress(SimulationFailure):
            efforts = rigid_efforts(model, grid, world, curves, run)
    known = efforts is not None or all(use.quantity != "effort" for use in slower)
    if not slower or not known:
        return ExceededLimits(uses)
    judged = grid.judged
    return ExceededLimits(
        uses, needed_tempo(grid.times[judged], curves.angles[judged], tempo_limits(character), efforts)
    )


def tempo_limits(character: Character) -> TempoLimits:
    """The limits that a slower tempo helps to keep."""
    bounds, none = motor_bounds(character), np.full(len(character.motors), np.inf)
    return TempoLimits(**{name: bounds[name].upper if name in bounds else none for name in TEMPO_LIMITS})


def rigid_efforts(model: Model, grid: TimeGrid, world: Array, curves: Curves, run: ForwardRun) -> MotorEfforts:
    """What the motors of a rigid robot have to do in the judged time: at rest, by the square of the tempo, and by its
    change.

    Args:
        model, grid, world: The robot, the instants, and its moving roots.
        curves, run: Of its motors, and its motion by them.

    Raises:
        SimulationFailure: A pose in which the robot finds no rest, or its system is singular.
    """
    states = run.trajectory.states
    slow = 1e3  # at which nothing but weight is left
    rest = run_forward(
        model, Workspace.for_system(model.system), curves.angles, curves.rates / slow, slow * grid.h, world
    )
    efforts, weight = (
        model.motor_efforts(reactions(model.system, one.trajectory, one.joint_angles, one.joint_rates).efforts)
        for one in (run, rest)
    )
    few = few_instants(grid.times)
    motors = np.arange(curves.angles.shape[1], dtype=np.int32)
    _, inertia = motor_responses(
        model, states.c[few], states.q[few], run.joint_angles[few], motors, world[few], grid.times[few]
    )
    change = CubicSpline(grid.times[few], np.einsum("tmk,tk->tm", inertia, curves.rates[few]))(grid.times)
    judged = grid.judged
    return MotorEfforts(weight[judged], (efforts - weight)[judged], change[judged])
