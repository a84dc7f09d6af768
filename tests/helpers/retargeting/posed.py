"""Retargeting problems of small shots, for the tests."""

import dataclasses

import numpy as np
from calmotion.model import Animation, Track
from calmotion.model.limits.bounds import motor_bounds
from calmotion.model.run import RunSettings
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.offset_basis import make_basis
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.intended_motion import rigid_motion, static_motion
from calmotion.simulation.preparation import prepare
from calmotion.simulation.target_errors import Objective

FINE_FRAMES = np.arange(181) / 120.0


def ignore_progress(fraction, message):
    """A progress callback for runs whose progress is not tested."""


def make_problem(character, bodies, animation, pre_roll=0.0, kept=False, limited=False, static=False, smoothness=1e-6):
    prepared = prepare(compile_shot(character, animation, bodies), RunSettings(step=1 / 240, pre_roll=pre_roll))
    model, grid = prepared.model, prepared.grid
    curves = sample_curves(animation.tracks, grid)
    intended = rigid_motion(model, curves.angles, curves.rates, grid.h)
    if static:
        intended = static_motion(model, intended, curves.angles, grid.judged)
    objective = Objective.over(model, intended, grid, animation.weights)
    basis = make_basis(grid, 0.1, kept)
    limits = LimitTerms(motor_bounds(character), grid.judged, grid.h, 3.0, on=True) if limited else None
    motors = np.arange(len(character.motors), dtype=np.int32)
    space = OffsetSpace.uncoupled(basis, motors, len(motors), smoothness, 1e-4)
    return RetargetProblem.of_model(model, grid, curves, objective, space, None, limits)


def jerking(at=0.6):
    """A short blow amid a slow move."""
    s = np.clip((FINE_FRAMES - at) / 0.12, 0.0, 1.0)
    blow = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    slow = np.clip((FINE_FRAMES - 0.05) / 1.3, 0.0, 1.0)
    slow = slow**3 * (10.0 - 15.0 * slow + 6.0 * slow * slow)
    tracks = (Track(FINE_FRAMES, 0.2 * slow), Track(FINE_FRAMES, 0.1 * slow + 0.25 * blow))
    return Animation(FINE_FRAMES, tracks, tracks)


def looped(character, animation):
    """A loop out of a shot that ends where it does not begin: the moves, and back again."""
    tracks = tuple(
        Track(
            track.times, track.values - np.linspace(0.0, 1.0, len(track.values)) * (track.values[-1] - track.values[0])
        )
        for track in animation.tracks
    )
    character = dataclasses.replace(character, retarget=dataclasses.replace(character.retarget, cyclic=True))
    return character, dataclasses.replace(animation, tracks=tracks, current=tracks)
