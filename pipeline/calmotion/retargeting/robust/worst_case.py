"""Curves with the smallest largest error over some robots, where the nominal one is not far off.

Each round linearises the robots, finds the smallest p-norm of the linear errors (`least_maximum`), and simulates. An
error of the nominal robot counts f times, so that it comes to what is allowed where the largest one of the others is f
times as large; f follows from a few such minima.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array
from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.model import Track
from calmotion.model.robust.robots import Scenario
from calmotion.model.run import RunSettings
from calmotion.multibody.parallel import in_parallel
from calmotion.multibody.sensitivity.linearization import spare_memory
from calmotion.retargeting.found_curves import found_curves
from calmotion.retargeting.kept_feet import keep_feet
from calmotion.retargeting.problem.limits import FIRST_PENALTY
from calmotion.retargeting.problem.posing import locked_coefficients, pose
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.problem.response_gram import COST, dense_responses
from calmotion.retargeting.problem.rigid_approximation import rigid_response
from calmotion.retargeting.problem.robot import Robot
from calmotion.retargeting.robust import least_possible as bound
from calmotion.retargeting.robust.least_maximum import ORDERS, STEPS, Rest, least_maximum
from calmotion.retargeting.robust.linear_errors import LinearErrors, lengths, merit, weights_of
from calmotion.retargeting.robust.measure import largest_of
from calmotion.retargeting.robust.rest_of_merit import RestOfMerit
from calmotion.retargeting.robust.robots import robots_of
from calmotion.retargeting.robust.weighted_errors import WeightedErrors
from calmotion.retargeting.robust.work import Work
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulate import Progress, intended_motion
from calmotion.support import interrupts

ROUNDS = 16  # most linear models and trust regions for one allowed error
FACTORS, MET = 5, (0.9, 1.05)  # most minima by which f is found, and what they have to meet of the allowed error
FIRST_FACTOR = 0.4  # of the largest error over the allowed one: the others' errors fall as well
FALLING, AS_PREDICTED = 0.1, 0.25  # a smaller relative decrease of the merit ends, a smaller share of it is refused
FORETOLD = 0.25  # relative error of a predicted decrease up to which the linear model serves once more
DAMPED = 10.0  # growth of the damping after a refused step
_FREE = 1e-3  # of the merit over the squared step: a smaller damping does not hold it back
_LARGEST, _SHARE = 3000, 0.5  # most unknowns, and most of the free memory


class WorstCase:
    """The robots of some scenarios, and the curves found so far.

    Args:
        shot: The shot as animated.
        options: Of the search, with its time step.
        tracks: Where it begins.
        scenarios: The robots, the nominal one first, kept as `scenarios`.
    """

    def __init__(
        self, shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], scenarios: Sequence[Scenario]
    ):  # fmt: skip
        prepared = prepare(shot.with_tracks(tracks), options)
        curves = sample_curves(prepared.shot.animation.tracks, prepared.grid)
        intended = intended_motion(prepared, curves.angles, curves.rates)
        problem, self._x, _ = pose(prepared, curves, intended, options)
        self.scenarios, self._animation = tuple(scenarios), shot.animation
        self._prepared, self._options = prepared, options
        self._motors = len(shot.character.motors)
        self._problem = problem.for_robots(self._robots(problem, scenarios))
        space = problem.space
        self._fixed = locked_coefficients(shot.animation, space.basis, space.motors, prepared.grid.end)
        self._inertia = rigid_response(problem.model, problem.grid, curves, problem.world, space.coupling).inertia
        self._weighted = WeightedErrors.of_objective(problem.objective, problem.grid, len(scenarios), problem.size)
        self._factors = np.ones((len(scenarios), len(self._weighted.places)))
        self._linear: tuple[LinearErrors, RestOfMerit] | None = None
        self._made_at: Array = np.zeros(0)  # the point of its derivatives
        self._damping = 0.0  # that it needed last
        self.work = Work()
        self._own: Array = np.zeros(0)  # errors of the nominal robot where it began, shape [G]
        self._performed: Array = np.zeros(0)  # the point that all robots performed last

    @cached_property
    def possible(self) -> bool:
        """Whether derivatives of all errors by all unknowns can be made and stored, and nothing else is asked for.

        What feet ask of the ground, and the play of gears, have no such derivatives.
        """
        problem = self._problem
        if self._options.avoid_reversals or not self._performs(self._x):
            return False
        keep_feet(self._prepared, problem)
        if any(robot.ground is not None for robot in problem.robots):
            return False
        if not (self._fit(len(self.scenarios)) and problem.size <= _LARGEST and self._weighted.dense_enough):
            return False
        problem.linearize()
        return all(robot.simulator.can_be_blocked() for robot in problem.robots)

    def take_in(self, scenarios: Sequence[Scenario]) -> bool:
        """Take in further robots: only their linear models are made. False, without them, where this cannot be."""
        known, _ = self._linearized()
        robots = self._robots(self._problem, scenarios)
        problem = self._problem.for_robots([*self._problem.robots, *robots])
        if not (self._fit(len(problem.robots)) and np.isfinite(problem.value(self._x))):
            return False
        in_parallel(Robot.linearize, robots)
        if not all(robot.simulator.can_be_blocked() for robot in robots):
            return False
        self.scenarios, self._problem = (*self.scenarios, *scenarios), problem
        self._performed = self._x.copy()
        self._factors = np.concatenate([self._factors, np.ones((len(robots), self._factors.shape[1]))])
        linear = known.with_robots(self._errors(), self._changes(robots))
        self._start_limits(linear)
        self._moved(linear)
        return True

    def _robots(self, problem: RetargetProblem, scenarios: Sequence[Scenario]) -> list[Robot]:
        """The robots of scenarios, of equal weights."""
        alike = [Scenario(scenario.factors) for scenario in scenarios]
        return robots_of(self._prepared, problem, alike, self._options)

    def _fit(self, robots: int) -> bool:
        """Whether the derivatives for so many robots fit in memory."""
        rows = robots * self._factors.shape[1] * len(self._weighted.at)
        return 24.0 * rows * self._problem.size <= _SHARE * spare_memory()

    def minimize(self, allowed: float, progress: Progress) -> None:
        """Minimise the largest error while the nominal robot's targets are off by at most so much.

        Args:
            allowed: Error of the position of a target on the nominal robot [m]; where it began with more, as much.
            progress: Called with a fraction and a message.
        """
        problem, damping, orders, refused = self._problem, self._damping, ORDERS, False
        linear, rest = self._linearized()
        if not len(self._own):
            self._own = largest_of(linear.errors[0])
        most = self._most(linear, np.maximum(allowed, self._own), FIRST_FACTOR)
        for number in range(ROUNDS):
            interrupts.check()
            now = 1e3 * float(np.linalg.norm(linear.errors, axis=3).max())
            progress(number / ROUNDS, f"largest weighted error on {len(self.scenarios)} robots: {now:.3f} mm")
            rest = replace(rest, damping=damping)
            d = self._minimum(linear, rest, most, orders)
            before = self._merit(linear, linear.errors, rest.value(np.zeros_like(d)))
            foretold = before - self._merit(linear, linear.at(d), rest.value(d))
            kept = problem.limits is None or problem.limits.kept(rest.limited)
            fresh, least = np.array_equal(self._made_at, self._x), before / max(rest.squared(d), 1e-300)
            if not np.any(d):
                break
            if foretold < FALLING * before and kept:
                if fresh if refused else damping <= _FREE * least:
                    break
                if refused:
                    linear, rest = self._linearize()  # the model of other curves misled
                damping, refused = damping / DAMPED, False
                continue
            gained = 0.0
            self.work.evaluations += 1
            if self._performs(self._x + d):
                gained = before - self._merit(linear, self._errors(), self._rest(damping, d))
            if gained < AS_PREDICTED * foretold or gained <= 0.0:
                damping = max(DAMPED * damping, least)
                if refused and foretold > FALLING * before and not fresh:
                    linear, rest = self._linearize()  # damped, the model of other curves misleads as well
                refused = True
                continue
            self._x, small = self._x + d, gained < FALLING * before
            right = abs(gained - foretold) < FORETOLD * foretold
            linear, rest = self._moved(linear) if small or right else self._linearized()
            if small and np.all(largest_of(linear.errors[0]) <= MET[1] * most) and not problem.tighten():
                break
            # the next model has a smaller damping unless this one needed it
            self._damping = damping = damping if refused else damping / DAMPED
            refused, orders = False, ORDERS[-1:]

    def least_possible(self, allowed: float) -> float:
        """A bound below which no curves can bring the largest weighted error on these robots [m] (`least_possible`).

        Args:
            allowed: As of `minimize`; where the curves found have more, as much.
        """
        linear, rest = self._linearized()
        most = self._most(linear, np.maximum(allowed, largest_of(linear.errors[0])), bound.FIRST_FACTOR)
        even = bound.EvenErrors.of(linear, rest)
        d = self._minimum(linear, even, most, bound.ORDERS, bound.MET, bound.STEPS)
        return bound.least_possible(linear, self._factors, most, even, self._fixed, d, self._problem.grid.end)

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The curves found so far."""
        curves, _ = found_curves(self._problem, self._motors, self._x)
        times = self._animation.frame_times
        return tuple(
            Track(times, curve.frame_values) if curve.changed else track
            for curve, track in zip(curves, self._animation.tracks, strict=True)
        )

    def errors(self) -> Array:
        """The largest error of each target on each robot for the curves found, which are simulated for it, shape [S, K]
        [m]."""
        self._performs(self._x)
        at, robots = self._problem.grid.judged, self._problem.robots
        motions = [(robot.run.target_positions, robot.objective.intended.target_positions) for robot in robots]
        return np.array([largest_of((performed - intended)[at]) for performed, intended in motions])

    def weighted(self) -> tuple[Scenario, ...]:
        """The robots with the weights of their squared errors in the sum that is smallest for the curves found, which
        are simulated for it."""
        self._performs(self._x)
        m = lengths(self._errors(), self._factors)
        totals = weights_of(m, self._factors, ORDERS[-1]).sum(axis=(1, 2))
        return tuple(
            replace(scenario, weight=float(total))
            for scenario, total in zip(self.scenarios, totals / totals.sum(), strict=True)
        )

    def _most(self, linear: LinearErrors, allowed: Array, factor: float) -> Array:
        """Largest errors of the nominal robot, shape [G]; its first factors are a share of the others' over these."""
        most = np.where(self._weighted.of_position, allowed, np.inf)
        largest = float(np.linalg.norm(linear.errors[1:], axis=3).max(initial=0.0))
        self._factors[0] = np.maximum(factor * largest / most, 1.0)
        return most

    def _minimum(
        self, linear: LinearErrors, rest: Rest, most: Array, orders: tuple[int, ...],
        met: tuple[float, float] = MET, steps: int = STEPS,
    ) -> Array:  # fmt: skip
        """The least maximum of the linear model, and the factors with which it keeps the allowed error."""
        d = np.zeros_like(self._x)
        for left in reversed(range(FACTORS)):
            with one_blas_thread():  # products by a vector take twice as long with two
                d = least_maximum(linear, self._factors, rest, self._fixed, d, orders, steps)
            nominal = largest_of(linear.at(d)[0])
            free = np.all(self._factors[0] <= 1.0) or np.any(nominal >= met[0] * most)
            if not left or np.all(nominal <= met[1] * most) and free:
                break
            self._factors[0] = np.maximum(self._factors[0] * np.clip(nominal / most, 0.6, 1.6), 1.0)
            orders = orders[-1:]
        return d

    def _performs(self, x: Array) -> bool:
        """Whether all robots can perform a point, which they do unless they have just done it."""
        if not np.array_equal(self._performed, x):
            self._performed = x.copy() if np.isfinite(self._problem.value(x)) else np.zeros(0)
        return len(self._performed) > 0

    def _merit(self, linear: LinearErrors, errors: Array, rest: float) -> float:
        return merit(linear.scale, lengths(errors, self._factors), ORDERS[-1], rest)

    def _errors(self) -> Array:
        """The errors of all robots at the point evaluated last, shape [S, t, G, 3] [m]."""
        return np.array([self._weighted.of(robot.residuals) for robot in self._problem.robots])

    def _rest(self, damping: float, d: Array) -> float:
        """The rest of the merit at the point evaluated last, a change d from the one before."""
        problem = self._problem
        here = RestOfMerit(problem.space, problem.x, problem.limits, problem.limited, self._inertia, damping)
        return here.value(np.zeros_like(d)) + 0.5 * damping * here.squared(d)

    def _linearized(self) -> tuple[LinearErrors, RestOfMerit]:
        """The errors and the rest of the merit about the curves found so far."""
        if self._linear is None or not np.array_equal(self._linear[1].x, self._x):
            return self._linearize()
        return self._linear

    def _linearize(self) -> tuple[LinearErrors, RestOfMerit]:
        """The same with derivatives made here."""
        problem = self._problem
        self._linear, self._made_at = None, self._x.copy()  # the memory of the model before is needed
        if not problem.linearized_at(self._x):
            self._performs(self._x)
            problem.linearize()
        self.work.linearizations += 1
        self.work.sweeps += round(2.0 * COST * problem.size)
        linear = LinearErrors.of(self._errors(), self._changes(problem.robots), self._weighted.scale)
        self._start_limits(linear)
        return self._moved(linear)

    def _changes(self, robots: Sequence[Robot]) -> NDArray[np.float32]:
        """The derivatives of the errors of robots where they are linearised, shape [S, t, G, 3, n]."""
        weighted, space = self._weighted, self._problem.space
        changes = np.empty((len(robots), len(weighted.at), len(weighted.places), 3, space.size), np.float32)

        def responded(k: int) -> None:
            changes[k] = weighted.thinned(dense_responses(robots[k], space, weighted.at))

        in_parallel(responded, range(len(robots)))
        return changes

    def _moved(self, linear: LinearErrors) -> tuple[LinearErrors, RestOfMerit]:
        """The errors and the rest of the merit at the point evaluated last, with the derivatives of a model near it."""
        problem = self._problem
        rest = RestOfMerit(problem.space, self._x, problem.limits, problem.limited, self._inertia)
        self._linear = replace(linear, errors=self._errors()), rest
        return self._linear

    def _start_limits(self, linear: LinearErrors) -> None:
        """Limits act from the beginning, with a penalty in proportion to the errors."""
        limits, grid = self._problem.limits, self._problem.grid
        if limits is not None and not limits.on:
            limits.on = True
            limits.rho = FIRST_PENALTY * self._merit(linear, linear.errors, 0.0) / grid.end
