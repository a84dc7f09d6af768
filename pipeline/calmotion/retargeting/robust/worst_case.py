"""Curves with the smallest largest error over some robots, where the nominal one is off by no more than is allowed.

The largest error is made smooth by a power mean (`solver.norm`), which the search minimises as it does the squares.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model import Track
from calmotion.model.run import RunSettings
from calmotion.model.uncertainty import Scenario
from calmotion.retargeting.found_curves import found_curves
from calmotion.retargeting.problem.limits import MARGIN, LimitTerms
from calmotion.retargeting.problem.posing import locked_coefficients, pose
from calmotion.retargeting.problem.problem import Evaluation, RetargetProblem
from calmotion.retargeting.quantities.kept_feet import with_kept_feet
from calmotion.retargeting.robust.measure import largest_errors
from calmotion.retargeting.robust.robots import robots_of
from calmotion.retargeting.search_terms import with_terms
from calmotion.retargeting.solver.gauss_newton import Ends, Search, minimize
from calmotion.retargeting.solver.norm import PowerMean
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulate import Progress, intended_motion
from calmotion.support import interrupts


@dataclass(frozen=True, eq=False)
class LeastMaximum:
    """Curves with the smallest largest error.

    Attributes:
        tracks: The curves; those where it began, where no others are better.
        scenarios: The robots, with the weights of their squared errors in the sum that is stationary at these curves.
        errors: Largest weighted errors of each target's position and rotation on each robot [m], shape [S, K, 2].
        search: The work that was done.
    """

    tracks: tuple[Track, ...]
    scenarios: tuple[Scenario, ...]
    errors: Array
    search: Search

    ORDERS: ClassVar[tuple[int, ...]] = (8, 16)  # of the power means, one after the other
    ROUNDS: ClassVar[int] = 20  # most iterations
    GAIN: ClassVar[float] = 0.02  # share of the mean error that an iteration must gain
    PRODUCTS: ClassVar[int] = 60  # of a system
    FIRST_FACTOR: ClassVar[float] = 0.4  # of the largest error over the allowed one: the others' errors fall as well
    AIM: ClassVar[float] = 0.97  # of the allowed error, where the nominal robot's is to be
    DAMPED: ClassVar[float] = 10.0  # growth of the damping after a step that was too long, and its fall after others
    FREE: ClassVar[float] = 1e-3  # share of the merit that damping may take without holding a step back
    CHANGE: ClassVar[float] = 1.6  # most by which the factors change at once
    BISECTIONS: ClassVar[int] = 6  # of the way back to where it began, until bound and limits are kept


def least_maximum(
    shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], scenarios: Sequence[Scenario], allowed: float,
    progress: Progress,
) -> LeastMaximum:  # fmt: skip
    """The smallest largest error over some robots.

    An error of the nominal robot counts f times, so that it comes to what is allowed where the largest one of the
    others is f times as large.

    Args:
        shot: The shot as animated.
        options: Of the search, with its time step.
        tracks: Where it begins.
        scenarios: The robots, the nominal one first; those that have no derivatives where it begins are left out.
        allowed: Error that a target may have on the nominal robot [m], and its rotation as it weighs beside the
            position; where it begins with more, as much.
        progress: Called with a fraction and a message.

    Raises:
        SimulationFailure: A robot cannot be simulated.
    """
    own, (start, fixed) = LeastMaximum, _posed(shot, options, tracks, scenarios)
    smooth = [one for k, one in enumerate(scenarios) if k == 0 or not start.runs[k].is_refined]
    if len(smooth) < len(scenarios):
        scenarios, (start, fixed) = smooth, _posed(shot, options, tracks, smooth)
    bound = bound_of(start, allowed)
    search, orders = Search.start(start.x, start), list(own.ORDERS)
    damping = whole = 0.0
    factors = np.maximum(own.FIRST_FACTOR * largest_of(start) / bound, 1.0)
    for number in range(own.ROUNDS):
        interrupts.check()
        told = f"largest weighted error on {len(scenarios)} robots: {1e3 * largest_of(search.at):.3f} mm"
        progress(number / own.ROUNDS, told)
        mean = power_mean(start.problem, orders[0], factors)
        at = search.at.of(replace(search.at.problem, norm=mean, damping=damping))
        enough = own.GAIN * float(np.sqrt(2.0 * at.objective_value / at.problem.unit))
        begun = replace(search, history=(), reason="", radius=np.inf, at=at)
        search = minimize(at.problem, begun, fixed, Ends(enough, 1, own.PRODUCTS))
        shortened = search.evaluations - begun.evaluations > 2
        if shortened or np.array_equal(search.x, at.x):  # multipliers are those of a step that was not taken
            search = replace(search, at=search.at.with_limits(at.problem.limits))
        if shortened:
            step = search.x - at.x
            whole = at.merit / max(float(step @ at.problem.space.closeness_product(step)), 1e-300)
            damping = max(own.DAMPED * damping, whole)
        else:
            damping /= own.DAMPED
        nominal = errors_of(search.at)[0] / bound
        factors = np.maximum(factors * np.clip(nominal / own.AIM, 1.0 / own.CHANGE, own.CHANGE), 1.0)
        if search.reason != "iteration limit" and damping <= own.FREE * whole:
            if len(orders) > 1:
                orders.pop(0)
            elif not np.any(nominal > 1.0):
                break
    best = _within(start, search.at, bound)
    weights = power_mean(best.problem, own.ORDERS[-1], factors).weights(best.residuals).reshape(len(scenarios), -1)
    shares = weights.sum(axis=1) / weights.sum()
    weighted = tuple(replace(s, weight=float(w)) for s, w in zip(scenarios, shares, strict=True))
    found = tuple(tracks) if best is start else _tracks(shot, best)
    return LeastMaximum(found, weighted, errors_of(best), search)


def errors_of(at: Evaluation) -> Array:
    """The largest weighted errors of each target's position and rotation on each robot [m], shape [S, K, 2]."""
    grid = at.problem.grid
    return np.array([largest_errors(run.robot.objective, grid, run.run, weighted=True) for run in at.runs])


def bound_of(start: Evaluation, allowed: float) -> Array:
    """Weighted errors that the nominal robot may have [m], shape [K, 2]; infinite where nothing weighs.

    They are those of a position that is off by what is allowed: where the rotation alone weighs, at the target whose
    position weighs most. Where the search begins with more, it is that.
    """
    grid, weights = start.problem.grid, start.problem.objective.weights[..., ::3]
    roots = (weights[grid.judged] / np.sqrt(grid.quadrature[grid.judged])[:, None, None]).max(axis=0)
    positions = roots[:, :1]
    scales = np.where(positions > 0.0, positions, positions.max(initial=0.0) or 1.0)
    return np.where(roots > 0.0, np.maximum(allowed * scales, errors_of(start)[0]), np.inf)


def largest_of(at: Evaluation) -> float:
    """The largest weighted error of all robots but the nominal one [m]; of that where there is no other."""
    errors = errors_of(at)
    return float(errors[1:].max() if len(errors) > 1 else errors[0].max())


def _within(start: Evaluation, found: Evaluation, bound: Array) -> Evaluation:
    """The point nearest to what was found, on the way from the start, at which bound and limits are kept, or kept as
    well as at the start; the start where nothing is won."""

    def excess(at: Evaluation) -> float:
        assert at.problem.limits is not None
        return at.problem.limits.excess(at.limited)

    most = max(MARGIN, excess(start))

    def kept(at: Evaluation | None) -> bool:
        return at is not None and bool(np.all(errors_of(at)[0] <= bound)) and excess(at) <= most

    best, inside, outside = found, 0.0, 1.0
    if not kept(found):
        best = start
        for _ in range(LeastMaximum.BISECTIONS):
            middle = 0.5 * (inside + outside)
            there = found.problem.tried(start.x + middle * (found.x - start.x), best)
            if there is not None and kept(there):
                inside, best = middle, there
            else:
                outside = middle
    return best if largest_of(best) < largest_of(start) else start


def _tracks(shot: CompiledShot, at: Evaluation) -> tuple[Track, ...]:
    """The curves at a point."""
    animation = shot.animation
    curves, _ = found_curves(at.problem, len(shot.character.motors), at.x)
    return tuple(
        Track(animation.frame_times, curve.frame_values) if curve.changed else track
        for curve, track in zip(curves, animation.tracks, strict=True)
    )


def _posed(
    shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], scenarios: Sequence[Scenario]
) -> tuple[Evaluation, BoolArray]:
    """The point of some curves in the problem of all robots, with limits that act, and which unknowns do not change."""
    prepared = prepare(shot.with_tracks(tracks), options)
    grid, curves = prepared.grid, sample_curves(shot.animation.tracks, prepared.grid)
    intended = intended_motion(prepared, curves.angles, curves.rates)
    nominal, start, _ = pose(prepared, curves, intended, replace(options, adjoint="discrete"))
    alike = [Scenario(scenario.factors, 1.0 / len(scenarios)) for scenario in scenarios]
    problem = replace(nominal.for_robots(robots_of(prepared, nominal, alike, options)), by_responses=True)
    at = problem.at(np.zeros(problem.size))
    at = with_terms(with_kept_feet(prepared, at), prepared.character, options.terms)
    limits = at.problem.limits or LimitTerms({}, grid.judged, grid.h, 1.0)
    limits = replace(limits, on=True, rho=limits.penalty_beside(at.objective_value))
    fixed = locked_coefficients(shot.animation, problem.space.basis, problem.space.motors, grid.end)
    return replace(at.problem, limits=limits).at(start, at), fixed


def power_mean(problem: RetargetProblem, order: int, factors: Array) -> PowerMean:
    """The power mean of the weighted errors over robots of equal weights, instants, and positions and rotations.

    Args:
        problem: Of the robots, the nominal one first.
        factors: With which errors of the nominal robot count, shape [K, 2].
    """
    quadrature, weights = problem.grid.quadrature, problem.objective.weights
    squares = weights.reshape(len(weights), -1, 3)[..., 0] ** 2
    by_time = np.where(quadrature > 0.0, quadrature, np.inf)
    counted, robots = np.flatnonzero(squares.any(axis=0)), len(problem.robots)
    units = np.sqrt(float((squares / by_time[:, None]).max()) * by_time / robots)
    shares = quadrature / (quadrature.sum() * max(len(counted), 1) * robots)
    every = np.ones((robots, len(weights), squares.shape[1]))
    every[0] = factors.ravel()
    units, shares = (np.tile(part, robots)[:, None] for part in (units, shares))
    return PowerMean(order, units, shares, every.reshape(-1, squares.shape[1]))
