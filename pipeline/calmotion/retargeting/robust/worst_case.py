"""Curves with the smallest largest error over some robots, where the nominal one is off by no more than is allowed.

The largest error is made smooth by a power mean (`solver.norm`). Each round linearises all robots, finds the minimum of
the model under the limits (`solver.limited_step`), and simulates. An error of the nominal robot counts f times, so that
it comes to what is allowed where the largest one of the others is f times as large.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model import Track
from calmotion.model.robust.robots import Scenario
from calmotion.model.run import RunSettings
from calmotion.retargeting.avoided_reversals import count_reversals, play_of
from calmotion.retargeting.found_curves import found_curves
from calmotion.retargeting.kept_feet import keep_feet
from calmotion.retargeting.problem.limits import FIRST_PENALTY, MARGIN, LimitTerms
from calmotion.retargeting.problem.posing import locked_coefficients, pose
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.problem.response_gram import COST
from calmotion.retargeting.robust.choice import beyond_simulation, largest_weighted
from calmotion.retargeting.robust.measure import errors_on, largest_of
from calmotion.retargeting.robust.responses import RespondingProblem
from calmotion.retargeting.robust.robots import robots_of
from calmotion.retargeting.solver.limited_step import limited_step
from calmotion.retargeting.solver.norm import PowerMean
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulate import Progress, intended_motion
from calmotion.support import interrupts

ORDERS = (8, 16)  # of the power means, one after the other
ROUNDS = 20  # most models
FIRST_FACTOR = 0.4  # of the largest error over the allowed one: the others' errors fall as well
AIM, CHANGE = 0.97, 1.6  # of the allowed error, where the nominal robot's is to be; most by which f changes at once
FALLING, AS_FORETOLD = 0.05, 0.25  # a smaller share of the merit ends; a smaller one of what was foretold is refused
DAMPED, FREE = 10.0, 1e-3  # growth of the damping after a refused step; share of the merit that does not hold it back
SHARE, ENOUGH, PRODUCTS = 0.01, 3e-4, 60  # of a model's decrease, and of the merit; most products of a system
BISECTIONS = 6  # of the way back to where it began, until the nominal robot is within what is allowed


@dataclass(frozen=True, eq=False)
class LeastMaximum:
    """Curves with the smallest largest error.

    Attributes:
        tracks: The curves; those where it began, where no others are better.
        scenarios: The robots, with the weights of their squared errors in the sum that is stationary at these curves.
        errors: Largest error of each target on each robot [m], shape [S, K].
        evaluations, linearizations, sweeps: Simulations and linearisations of all robots, and the linearised sweeps
            whose cost these had.
    """

    tracks: tuple[Track, ...]
    scenarios: tuple[Scenario, ...]
    errors: Array
    evaluations: int
    linearizations: int
    sweeps: int


def least_maximum(
    shot: CompiledShot,
    options: RunSettings,
    tracks: Sequence[Track],
    scenarios: Sequence[Scenario],
    allowed: float,
    progress: Progress,
) -> LeastMaximum:
    """The smallest largest error over some robots.

    Args:
        shot: The shot as animated.
        options: Of the search, with its time step.
        tracks: Where it begins.
        scenarios: The robots, the nominal one first.
        allowed: Error that a target may have on the nominal robot [m]; where it begins with more, as much.
        progress: Called with a fraction and a message.

    Raises:
        ShotError: A robot cannot be simulated.
    """
    search = _Search(shot, options, tracks, scenarios, allowed)
    search.run(progress)
    search.keep_bound()
    mean = power_mean(search.problem, ORDERS[-1], search.factors)
    weights = mean.weights(search.problem.residuals).reshape(len(scenarios), -1).sum(axis=1)
    weighted = [replace(s, weight=float(w)) for s, w in zip(scenarios, weights / weights.sum(), strict=True)]
    found = tuple(tracks) if search.x is search.start else search.tracks()
    sweeps = search.linearizations * round(2.0 * COST * search.problem.size)
    return LeastMaximum(found, tuple(weighted), search.errors, search.evaluations, search.linearizations, sweeps)


class _Search:
    """The search from some curves; arguments as of `least_maximum`.

    Attributes:
        problem: Of all robots.
        start, x: Where it began, and the best point, evaluated last, shape [n].
        bound: Error that each target may have on the nominal robot [m], shape [K].
        factors: f of each target, shape [K].
    """

    def __init__(
        self,
        shot: CompiledShot,
        options: RunSettings,
        tracks: Sequence[Track],
        scenarios: Sequence[Scenario],
        allowed: float,
    ):
        self.shot, self.evaluations, self.linearizations = shot, 0, 0
        self.problem, self.start, self._fixed = _posed(shot, options, tracks, scenarios)
        if not np.isfinite(self._value(self.start)):
            off = errors_on(shot, options, {"": tracks}, scenarios)[""].max(axis=1)
            raise beyond_simulation(shot, scenarios[int(np.argmax(off))])
        self.x = self.start
        self.bound = np.maximum(allowed, self.errors[0])
        self.factors = np.maximum(FIRST_FACTOR * self._largest() / self.bound, 1.0)
        self._began, self._exceeded = self._largest(), self._excess()

    @property
    def errors(self) -> Array:
        """The largest error of each target on each robot at the point evaluated last [m], shape [S, K]."""
        at, robots = self.problem.grid.judged, self.problem.robots
        motions = [(robot.run.target_positions, robot.objective.intended.target_positions) for robot in robots]
        return np.array([largest_of((performed - intended)[at]) for performed, intended in motions])

    def run(self, progress: Progress) -> None:
        """Minimise."""
        problem, orders, refused = self.problem, list(ORDERS), False
        for number in range(ROUNDS):
            interrupts.check()
            told = f"largest weighted error on {len(problem.robots)} robots: {1e3 * self._largest():.3f} mm"
            progress(number / ROUNDS, told)
            problem.norm = power_mean(problem, orders[0], self.factors)
            self.linearizations += not problem.linearized_at(self.x)
            problem.linearize()
            step = limited_step(problem, self._fixed, SHARE, ENOUGH * problem.merit(), PRODUCTS)
            merit, foretold = problem.merit(), step.predicted(1.0)
            whole = merit / max(problem.squared(step.step), 1e-300)
            if foretold < FALLING * merit:
                if problem.damping > FREE * whole and not refused:
                    problem.damping /= DAMPED
                elif len(orders) > 1:
                    orders.pop(0)
                elif not self._adapted():
                    break
                continue
            gained = merit - self._value(self.x + step.step)
            if not gained > AS_FORETOLD * foretold:
                problem.damping, refused = max(DAMPED * problem.damping, whole), True
                self._value(self.x)
                continue
            self.x = problem.x
            problem.damping, refused = problem.damping if refused else problem.damping / DAMPED, False
            if gained < FALLING * merit and len(orders) > 1:
                orders.pop(0)
            self._adapted()

    def keep_bound(self) -> None:
        """Go back towards the start until bound and limits are kept, and all the way where nothing is won."""
        if not self._kept():
            found, inside, outside = self.x, 0.0, 1.0
            for _ in range(BISECTIONS):
                middle = 0.5 * (inside + outside)
                self._value(self.start + middle * (found - self.start))
                inside, outside = (middle, outside) if self._kept() else (inside, middle)
            self.x = self.start + inside * (found - self.start)
            self._value(self.x)
        if not self._largest() < self._began:
            self.x = self.start
            self._value(self.x)

    def tracks(self) -> tuple[Track, ...]:
        """The curves found."""
        animation = self.shot.animation
        curves, _ = found_curves(self.problem, len(self.shot.character.motors), self.x)
        return tuple(
            Track(animation.frame_times, curve.frame_values) if curve.changed else track
            for curve, track in zip(curves, animation.tracks, strict=True)
        )

    def _value(self, x: Array) -> float:
        """The merit at a point, which is then the one evaluated last."""
        self.evaluations += 1
        return self.problem.value(x)

    def _largest(self) -> float:
        """The largest error of all robots but the nominal one, as it weighs [m]; of that where there is no other."""
        errors = largest_weighted(self.shot, self.errors)
        return float(errors[1:].max() if len(errors) > 1 else errors[0])

    def _excess(self) -> float:
        """Largest excess over limits, as a share."""
        assert self.problem.limits is not None
        return self.problem.limits.excess(self.problem.limited)

    def _kept(self) -> bool:
        """Whether the nominal robot is within its bound, and limits are kept, or as well as where it began."""
        return bool(np.all(self.errors[0] <= self.bound)) and self._excess() <= max(MARGIN, self._exceeded)

    def _adapted(self) -> bool:
        """Let the nominal robot's errors count more or less, by how far they are from their bound; whether they were
        beyond it."""
        nominal = self.errors[0] / self.bound
        change = np.clip(nominal / AIM, 1.0 / CHANGE, CHANGE)
        self.factors = np.maximum(self.factors * change, 1.0)
        return bool(np.any(nominal > 1.0))


def _posed(
    shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], scenarios: Sequence[Scenario]
) -> tuple[RespondingProblem, Array, BoolArray]:
    """The problem of all robots, with limits that act, the point of some curves, and which unknowns do not change."""
    prepared = prepare(shot.with_tracks(tracks), options)
    grid, curves = prepared.grid, sample_curves(shot.animation.tracks, prepared.grid)
    intended = intended_motion(prepared, curves.angles, curves.rates)
    nominal, start, _ = pose(prepared, curves, intended, replace(options, adjoint="discrete"), RespondingProblem)
    alike = [Scenario(scenario.factors, 1.0 / len(scenarios)) for scenario in scenarios]
    assert isinstance(nominal, RespondingProblem)
    problem = nominal.for_robots(robots_of(prepared, nominal, alike, options))
    if not np.isfinite(problem.value(np.zeros(problem.size))):
        off = errors_on(shot, options, {"": shot.animation.tracks}, scenarios)[""].max(axis=1)
        raise beyond_simulation(shot, scenarios[int(np.argmax(off))])
    if options.avoid_reversals:
        count_reversals(problem, play_of(prepared.character), options.avoid_reversals)
    keep_feet(prepared, problem)
    limits = problem.limits = problem.limits or LimitTerms({}, grid.judged, grid.h, 1.0)
    limits.on, limits.rho = True, FIRST_PENALTY * problem.objective_value() / grid.end
    fixed = locked_coefficients(shot.animation, problem.space.basis, problem.space.motors, grid.end)
    return problem, start, fixed


def power_mean(problem: RetargetProblem, order: int, factors: Array) -> PowerMean:
    """The power mean of the weighted errors over robots of equal weights, instants, and positions and rotations.

    Args:
        problem: Of the robots, the nominal one first.
        order: Of the mean.
        factors: With which errors of the nominal robot's positions count, shape [K].
    """
    quadrature, weights = problem.grid.quadrature, problem.objective.weights
    squares = weights.reshape(len(weights), -1, 3)[..., 0] ** 2
    by_time = np.where(quadrature > 0.0, quadrature, np.inf)
    counted, robots = np.flatnonzero(squares.any(axis=0)), len(problem.robots)
    units = np.sqrt(float((squares / by_time[:, None]).max()) * by_time / robots)
    shares = quadrature / (quadrature.sum() * max(len(counted), 1) * robots)
    every = np.ones((robots, len(weights), squares.shape[1]))
    every[0, :, ::2] = factors
    units, shares = (np.tile(part, robots)[:, None] for part in (units, shares))
    return PowerMean(order, units, shares, every.reshape(-1, squares.shape[1]))
