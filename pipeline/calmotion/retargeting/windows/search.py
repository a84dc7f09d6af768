"""The search of one window: offsets that go on from what is there, over its frames."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model.limits.bounds import motor_bounds
from calmotion.model.run import RunSettings
from calmotion.retargeting.checkpoint import Checkpoint, problem_key
from calmotion.retargeting.found_curves import found_curves
from calmotion.retargeting.problem.adaptive_knots import first_breaks
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.offset_basis import OffsetBasis, basis_on, uniform_breaks
from calmotion.retargeting.problem.offset_space import BaseOffsets, OffsetSpace
from calmotion.retargeting.problem.posing import SMOOTHNESS, closeness_of, knot_spacing, locked_coefficients
from calmotion.retargeting.problem.problem import RetargetProblem, with_first_penalty
from calmotion.retargeting.problem.robot import Robot
from calmotion.retargeting.search import RetargetSearch
from calmotion.retargeting.solver.gauss_newton import Search
from calmotion.retargeting.windows.continued import Beginning, ContinuedSimulator
from calmotion.retargeting.windows.parts import Part
from calmotion.simulation.inputs.curves import Curves
from calmotion.simulation.inputs.gearing import coupling_of, leaders
from calmotion.simulation.simulate import Progress
from calmotion.simulation.target_errors import IntendedMotion, Objective


@dataclass(frozen=True, eq=False)
class Setting:
    """What all windows of a shot have in common.

    Attributes:
        options: Of the run.
        tolerance: Acceptable error [m].
        frequency: Lowest frequency of the character [Hz].
        checkpoint: File of the search that runs; None for none.
    """

    options: RunSettings
    tolerance: float
    frequency: float
    checkpoint: Path | None


@dataclass(frozen=True, eq=False)
class Found:
    """What the search of a window found.

    Attributes:
        offsets: Change of the motors at its frames, shape [f, M].
        search: Its state at the end.
        parameters: Number of its unknowns.
        interrupted: Whether the user ended it.
        idle_gain: Gain that idle motors would bring [m]; None where there are none.
        resumed_iterations: Iterations of the checkpoint from which it resumed.
    """

    offsets: Array
    search: Search
    parameters: int
    interrupted: bool
    idle_gain: float | None
    resumed_iterations: int


def search_window(
    part: Part, kept: float, curves: Curves, base: Curves, intended: IntendedMotion, beginning: Beginning | None,
    setting: Setting, progress: Progress,
) -> Found | None:  # fmt: skip
    """Search a window; None where nothing in it may change.

    Args:
        part: From its first frame to its last one.
        kept: Time to which its offsets are kept [s]; where they end in the part but the shot goes on, they fade out
            from there.
        curves: The animator's, of the whole shot.
        base: Offsets that are there, of the part.
        intended: Of the whole shot.
        beginning: The states from which it goes on; None for the window that begins the shot.
        setting: Of the shot.
        progress: Called with its fraction.

    Raises:
        SimulationFailure: It cannot be simulated with the offsets that are there.
    """
    prepared = part.prepared
    problem, locked = _posed(part, curves, base, intended, beginning, setting)
    if problem is None:
        return None
    start = np.zeros(problem.size)
    at = with_first_penalty(problem.at(start), setting.tolerance)
    problem = at.problem
    options, animation, character = setting.options, prepared.shot.animation, prepared.character
    known = problem_key(problem, locked, (options, setting.tolerance, "window", part.first, problem.grid.continues))
    searched = RetargetSearch(
        at, Search.start(start), (), character, animation, options, setting.tolerance, setting.frequency,
        not knot_spacing(character, options), Checkpoint(setting.checkpoint, known), progress,
    )  # fmt: skip
    searched.run(start)
    final = searched.problem
    x = found_curves(final, len(character.motors), searched.search.x)[1]
    basis = final.space.basis
    coefficients = x.reshape(basis.count, len(final.space.motors)) @ final.space.coupling.T
    if kept < part.prepared.grid.end and not part.prepared.grid.continues:
        coefficients *= fading(basis, kept)[:, None]
    return Found(
        np.asarray(basis.at_frames @ coefficients), searched.search, final.size, searched.interrupted,
        searched.idle_gain, searched.resumed_iterations,
    )  # fmt: skip


def fading(basis: OffsetBasis, kept: float) -> Array:
    """Factors of coefficients with which offsets stay as they are up to a time, then fade out, shape [P].

    They vanish at the last knot with slope and curvature, on the knots that there are.

    Args:
        kept: [s].
    """
    starts, last = basis.support[:, 0], basis.knots[-1]
    ending = float(np.min(starts[basis.support[:, 1] >= last], initial=last))
    s = np.clip((starts - kept) / max(ending - kept, 1e-9), 0.0, 1.0)
    return np.asarray(1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s * s))


def _posed(
    part: Part, curves: Curves, base: Curves, intended: IntendedMotion, beginning: Beginning | None, setting: Setting
) -> tuple[RetargetProblem | None, BoolArray]:  # fmt: skip
    """The problem of a window, and its coefficients that the shot locks."""
    prepared, options = part.prepared, setting.options
    character, grid, model = prepared.character, prepared.grid, prepared.model
    settings, motors = character.retarget, leaders(character)
    spacing = knot_spacing(character, options)
    breaks = uniform_breaks(grid, spacing) if spacing else first_breaks(grid)
    basis = basis_on(grid, breaks, settings.endpoints == "kept")
    locked = locked_coefficients(prepared.shot.animation, basis, motors, grid.end)
    if not len(motors) or not basis.count or np.all(locked):
        return None, locked
    coupling = coupling_of(character, motors)
    bounds = motor_bounds(character, np.any(coupling, axis=1))
    smoothness = next(v for v in (options.smoothness, settings.smoothness, SMOOTHNESS) if v is not None)
    there = BaseOffsets(base.angles, base.accelerations, grid.h) if np.any(base.angles) else None
    objective = Objective.over(model, part.intended_of(intended), grid, prepared.shot.animation.weights)
    problem = RetargetProblem.of_model(
        model, grid, part.curves_of(curves).plus(base.derivatives), objective,
        OffsetSpace(basis, motors, coupling, smoothness, closeness_of(character), there), prepared.world,
        LimitTerms.of(bounds, grid.judged, grid.h),
    )  # fmt: skip
    if beginning is not None:
        simulator = ContinuedSimulator(model, grid.h, prepared.world, beginning)
        problem = replace(problem, robots=(Robot(simulator, objective),))
    return problem, locked
