"""The result of a search in windows, put together from its windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from calmotion.arrays import Array
from calmotion.model import LimitUse, MotorCurve, OptimizerStep, Result, Simplification, Simulation, WindowRow
from calmotion.model.limits.bounds import excesses, motor_bounds
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.model.run import RunSettings
from calmotion.retargeting.problem.posing import SMOOTHNESS, closeness_of
from calmotion.retargeting.simplification.pruning import UNCHANGED
from calmotion.retargeting.windows.parts import Piece, joined, offset_curves
from calmotion.retargeting.windows.plan import Window
from calmotion.retargeting.windows.search import Found
from calmotion.simulation.bodies import mode_tables, skins
from calmotion.simulation.inputs.curves import Curves
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.preparation import Prepared
from calmotion.simulation.report import left_out_rows, limit_uses, performed_motion, reference_motion
from calmotion.simulation.target_errors import IntendedMotion, Objective

JUMP = 1e-7  # of the third derivative at a frame, over the largest, from which the frame carries a knot


@dataclass(eq=False)
class Done:
    """What the windows of a search have made so far.

    Attributes:
        before, after: Simulations of the input and of the result.
        rows: One for each window.
        steps: Of all searches.
        offsets: Of all motors at the frames, shape [f, M].
        interrupted: Whether the user ended it.
        searched: Whether a window was searched.
    """

    before: list[Piece] = field(default_factory=list)
    after: list[Piece] = field(default_factory=list)
    rows: list[WindowRow] = field(default_factory=list)
    steps: list[OptimizerStep] = field(default_factory=list)
    offsets: Array = field(default_factory=lambda: np.zeros((0, 0)))
    interrupted: bool = False
    searched: bool = False
    evaluations: int = 0
    gradients: int = 0
    products: int = 0
    parameters: int = 0
    resumed: int = 0
    idle_gain: float | None = None
    expected: float | None = None
    reasons: list[str] = field(default_factory=list)

    def add(self, found: Found) -> None:
        """Count the search of a window."""
        search = found.search
        self.steps += [
            OptimizerStep(
                i.value, i.gradient_norm, self.evaluations + i.evaluations, 2 * (self.products + i.products)
            )
            for i in search.history
        ]  # fmt: skip
        self.evaluations += search.evaluations
        self.gradients += search.gradients
        self.products += search.products
        self.parameters += found.parameters
        self.resumed += found.resumed_iterations
        self.reasons.append(search.reason)
        if found.idle_gain is not None:
            self.idle_gain = max(found.idle_gain, self.idle_gain or 0.0)
        gain = search.history[-1].gain if search.history else np.nan
        if np.isfinite(gain):
            self.expected = max(float(gain), self.expected or 0.0)


def result_of(
    prepared: Prepared, done: Done, curves: Curves, intended: IntendedMotion, options: RunSettings,
    windows: Sequence[Window], wall: float,
) -> Result:  # fmt: skip
    """The result of the whole shot.

    Args:
        curves: The animator's.
        intended: The intended motion.
        wall: Time of the search [s].
    """
    grid, model = prepared.grid, prepared.model
    offsets = offset_curves(done.offsets, grid)
    changed = curves.plus(offsets.derivatives)
    before, after = joined(done.before, grid.times), joined(done.after, grid.times)
    objective = Objective.over(model, intended, grid, prepared.shot.animation.weights)
    motors = _motor_curves(done.offsets, curves, grid)
    reasons = [reason for reason in done.reasons if reason != "converged"]
    steps = tuple(done.steps) or (OptimizerStep(_value(objective, after), 0.0, 0, 0),)
    return Result(
        reference=reference_motion(model, grid, intended, curves.angles),
        before=before,
        after=after,
        skins=skins(prepared.bodies),
        modes=mode_tables(prepared.bodies),
        curves=motors,
        steps=steps,
        objective_before=_value(objective, before),
        objective_after=_value(objective, after) + _penalty(offsets, prepared, options),
        gradients=done.gradients,
        linearized_sweeps=2 * done.products + done.gradients,
        forward_simulations=done.evaluations + 2,
        iterations=len(done.steps),
        parameters=done.parameters,
        wall_s=wall,
        step_s=grid.h,
        pre_roll_s=grid.pre_roll,
        dof=model.dof,
        left_out=(*left_out_rows(prepared), *_rows(windows, grid, motors)),
        limits=_limits(prepared, (curves, before), (changed, after)),
        stopped="interrupted" if done.interrupted else next(iter(reasons), "converged"),
        expected_gain_m=done.expected,
        interrupted=done.interrupted,
        performed=performed_motion(prepared, changed),
        idle_gain_m=done.idle_gain,
        resumed_iterations=done.resumed,
        windows=tuple(done.rows),
    )


def _value(objective: Objective, simulation: Simulation) -> float:
    motion = simulation.motion
    residuals, _ = objective.residuals(motion.target_positions, motion.target_rotations)
    return 0.5 * float(np.sum(residuals**2))


def _penalty(offsets: Curves, prepared: Prepared, options: RunSettings) -> float:
    """The regulariser of the offsets."""
    given = (options.smoothness, prepared.character.retarget.smoothness, SMOOTHNESS)
    smoothness = next(value for value in given if value is not None)
    sums = closeness_of(prepared.character) * np.sum(offsets.angles**2) + smoothness * np.sum(offsets.accelerations**2)
    return 0.5 * prepared.grid.h * float(sums)


def _motor_curves(offsets: Array, curves: Curves, grid: TimeGrid) -> tuple[MotorCurve, ...]:
    found, between = [], offset_curves(offsets, grid).angles[grid.judged]
    for motor in range(curves.angles.shape[1]):
        own, values = offsets[:, motor], curves.angles[grid.frames, motor]
        largest = float(np.max(np.abs(between[:, motor]), initial=0.0))
        if largest <= UNCHANGED:
            found.append(MotorCurve(motor, False, grid.frame_times[[0, -1]], values, 0.0))
        else:
            found.append(MotorCurve(motor, True, _knots(own, grid), values + own, largest))
    return tuple(found)


def _knots(offsets: Array, grid: TimeGrid) -> Array:
    """Times of the frames at which an offset changes its cubic, and of the first and the last one [s]."""
    third = CubicSpline(grid.frame_times, offsets, bc_type="not-a-knot").c[0]
    jumps = np.abs(np.diff(third))
    times: Array = grid.frame_times[np.concatenate([[True], jumps > JUMP * np.max(jumps, initial=0.0), [True]])]
    return times


class _Performed(NamedTuple):
    """What motors did."""

    derivatives: tuple[Array, ...]
    efforts: Array


def _limits(
    prepared: Prepared, before: tuple[Curves, Simulation], after: tuple[Curves, Simulation]
) -> tuple[LimitUse, ...]:
    """Use of all limits of the motors in the input and in the result."""
    bounds, judged = motor_bounds(prepared.character), prepared.grid.judged
    used = []
    for curves, simulation in (before, after):
        done = _Performed(curves.derivatives, simulation.motion.motor_efforts)
        used.append(excesses(bounds, {name: kinds_of_limits()[name].values(done) for name in bounds}, judged))
    return limit_uses(used[0], used[1], prepared.grid)


def _rows(windows: Sequence[Window], grid: TimeGrid, motors: Sequence[MotorCurve]) -> list[Simplification]:
    first, times = windows[0], grid.frame_times
    length, overlap = float(times[first.kept]), float(times[first.last] - times[first.kept])
    rows = [
        Simplification(
            f"{len(windows)} windows of {length:.3g} s that overlap by {overlap:.3g} s",
            "each goes on where the one before ends; what it would change there dies away in the overlap",
        )
    ]
    closest = min((float(np.diff(curve.knots).min()) for curve in motors if curve.changed), default=None)
    if closest is not None:
        rows.append(
            Simplification(
                f"knots at least {1e3 * closest:.3g} ms apart",
                "as in one search",
            )
        )
    return rows
