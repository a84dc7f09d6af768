"""The search for offsets: Gauss-Newton on adaptive knots, with inactive intervals and pruning of small offsets."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model import Animation, Character
from calmotion.model.model_choice import OFF
from calmotion.model.result import GOAL_REACHED
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import goal_of
from calmotion.retargeting.checkpoint import Checkpoint
from calmotion.retargeting.feasible_start import on_sufficient_knots, onto_limits, with_moving_end, with_possible_limits
from calmotion.retargeting.problem.adaptive_knots import converted, refined_breaks
from calmotion.retargeting.problem.linear_problem import LinearProblem
from calmotion.retargeting.problem.offset_basis import OffsetBasis
from calmotion.retargeting.problem.posing import locked_coefficients
from calmotion.retargeting.problem.problem import Evaluation, RetargetProblem
from calmotion.retargeting.search_memory import SearchMemory
from calmotion.retargeting.search_progress import SearchProgress
from calmotion.retargeting.simplification.idle_motors import idle_gain, idle_motors
from calmotion.retargeting.simplification.inactive_intervals import (
    InactiveInterval,
    first_change,
    inactive_coefficients,
    inactive_intervals,
    with_gains,
)
from calmotion.retargeting.simplification.pruning import block_energies, negligible_coefficients
from calmotion.retargeting.simplification.report_rows import FINER, PRUNED
from calmotion.retargeting.solver.damping_homotopy import damping_homotopy
from calmotion.retargeting.solver.gauss_newton import Search, minimize
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.simulation.simulate import Progress
from calmotion.support import interrupts

AS_THEY_ARE = "converged"  # reason of the end where nothing is searched: another search has found the curves
NEAR = 2.0  # where a largest error is beyond the goal, else the tolerance, but not by this factor, smaller gains count
GAIN_NEAR = 0.2  # share of the least gain, which is one of a mean over time, that counts there
MISSED = 0.5  # share of the least gain that changes in the inactive intervals may gain together


@dataclass(eq=False)
class RetargetSearch:
    """A search and its state.

    Attributes:
        input: The animator's curves; its problem is the one at the start.
        search: State of the minimisation.
        inactive: Intervals in which no motor changes.
        character, animation, options: Of the shot.
        tolerance: Accuracy of the simulation [m].
        frequency: Lowest frequency of the character [Hz].
        adaptive: Whether knots are refined.
        checkpoint: Stores the search after each iteration.
        progress: Called after each iteration.
        idle_gain: Gain that idle motors would bring at the end [m]; None where there are none.
        interrupted: Whether the user ended it.
        resumed_iterations: Iterations of the checkpoint from which it resumed.
        took_over: Whether it began with the directions of the search before.
    """

    input: Evaluation
    search: Search
    inactive: tuple[InactiveInterval, ...]
    character: Character
    animation: Animation
    options: RunSettings
    tolerance: float
    frequency: float
    adaptive: bool
    checkpoint: Checkpoint
    progress: Progress
    idle_gain: float | None = None
    interrupted: bool = False
    resumed_iterations: int = 0
    took_over: bool = False

    _unconfirmed: bool = False  # whether the state is that of a file

    def __post_init__(self) -> None:
        self.problem: RetargetProblem = self.input.problem  # on the current knots, with the limits as they are now
        # a robust search has an end of its own
        self._goal = None if self.options.robust else goal_of(self.character, self.options.goal)
        # a smaller predicted gain ends the search [m]
        self._least = self.options.least_gain * min(self.tolerance, self._goal or np.inf)
        self._done = SearchProgress(self._least)

    def run(self, start: Array, last: SearchMemory | None = None) -> None:
        """Search from a point, or resume from the checkpoint; an interrupt (Ctrl-C) ends the search.

        Without any iteration allowed, the curves stay as they are.

        Args:
            start: Shape [n].
            last: What the search of almost the same shot left.
        """
        self.problem, start = with_moving_end(self.input, start)
        begin = self.input
        if self.problem is not begin.problem:
            begin = replace(begin, problem=self.problem, x=np.zeros(self.problem.size))
        self.inactive = inactive_intervals(begin, start, self.frequency, self.tolerance, self.options.ranges)
        if self.adaptive:
            self.problem, start = on_sufficient_knots(self.problem, start, self._fixed_on)
        fixed = self._fixed_on(self.problem.space.basis)
        self.problem = with_possible_limits(self.problem, fixed)
        self.search = Search.start(np.where(fixed, 0.0, start), self.input)
        if not self.options.max_iterations:
            self.inactive, self.search = (), replace(self.search, reason=AS_THEY_ARE)
            return
        if last is not None:
            begun = last.begun(self.problem, self.search)
            self.took_over, self.search = begun is not self.search, begun
        resumed = self._resume()
        fixed = self.hold()
        try:
            if not resumed and (not np.any(start) or self.animation.current is self.animation.tracks):
                self.search = damping_homotopy(self.problem.at(start, self.input), fixed, self.frequency)
            self._descend(fixed)
            if len(idle_motors(self.character)):
                self._estimate_idle_gain()
            fixed = self.hold()
            self.progress(0.9, "removing negligible offsets")
            self._prune(fixed)
        except KeyboardInterrupt:
            interrupts.answer()
            self.interrupted = True
            self.progress(0.95, "interrupted: writing the best so far")

    def hold(self) -> BoolArray:
        """The fixed coefficients, shape [n], bool; curves stay as they are before the first free one acts."""
        self._held(first_change(self.problem.grid, self.problem.space.basis, self._fixed_on))
        return self._fixed_on(self.problem.space.basis)

    def _held(self, first: int) -> None:
        """Curves stay as they are before an instant."""
        if first < self.problem.first:
            # responses from a later instant on say nothing of the coefficients that are free from now on
            self.search = replace(self.search, sharpened=None)
        self.problem = replace(self.problem, first=first)

    def locked_on(self, basis: OffsetBasis) -> BoolArray:
        """Coefficients of a basis that the shot locks, shape [n], bool."""
        return locked_coefficients(self.animation, basis, self.problem.space.motors, self.problem.grid.end)

    def _fixed_on(self, basis: OffsetBasis) -> BoolArray:
        return self.locked_on(basis) | inactive_coefficients(basis, self.inactive, len(self.problem.space.motors))

    def _resume(self) -> bool:
        """Resume from the checkpoint; whether there is one whose point has the recorded merit."""
        stored = self.checkpoint.load(self.problem.limits)
        if stored is None:
            return False
        problem, x = self.problem, stored.search.x
        breaks, motors = stored.breaks, len(problem.space.motors)
        first, last = problem.space.basis.breaks[[0, -1]]
        if breaks.dtype.kind != "i" or np.any(np.diff(breaks) <= 0) or breaks[0] != first or breaks[-1] != last:
            self.checkpoint.refuse("has other knots than the shot")
            return False
        basis = problem.space.basis.on(problem.grid, breaks)
        if len(x) != basis.count * motors:
            self.checkpoint.refuse("has a wrong number of coefficients")
            return False
        resumed = replace(problem.on_basis(basis), limits=stored.restored(problem.limits))
        there = resumed.tried(x)
        if there is None or not stored.matches(there.merit):
            merit = "nothing" if there is None else f"{there.merit:.6g}"
            self.checkpoint.refuse(f"does not fit the shot (objective {stored.merit:.6g}, simulated {merit})")
            return False
        self.problem, self.search, self._unconfirmed = resumed, replace(stored.search, at=there), True
        self.resumed_iterations = len(self.search.history)
        self.progress(0.1, f"resuming after {self.resumed_iterations} iterations of an interrupted search")
        if np.any(x[inactive_coefficients(basis, self.inactive, motors)]):
            self.inactive = ()  # the stored search had already continued with all coefficients
        return True

    def _descend(self, fixed: BoolArray) -> None:
        """Minimise and refine the knots; then include the inactive intervals if they would gain too much."""
        while True:
            if not self.search.reason:
                self.search = self._minimized(self.search, fixed)
                self._keep()
            if self._unconfirmed:
                self._confirm(fixed)
            if self.search.reason in ("iteration limit", GOAL_REACHED):
                return
            if not (self.adaptive and self._refine()):
                if self.inactive:
                    self._held(first_change(self.problem.grid, self.problem.space.basis, self.locked_on))
                    self.inactive, self.search = with_gains(self.problem, self.search, self.inactive, self.locked_on)
                missed = sum(interval.gain for interval in self.inactive)
                if self.options.ranges == OFF or missed <= MISSED * self._least:
                    return
                self.inactive, self.search = (), _restarted(self.search, self.search.x)
            self._done.next_pass(len(self.search.history))
            fixed = self.hold()

    def _minimized(self, search: Search, fixed: BoolArray) -> Search:
        found, enough = self._to_gain(search, fixed, self._least), self._goal or self.tolerance
        if found.reason == "converged" and 1.0 < self._largest_error(found.at) / enough < NEAR:
            found = self._to_gain(replace(found, reason=""), fixed, GAIN_NEAR * self._least)
        return found

    def _reached(self, at: Evaluation) -> bool:
        """Whether no target that counts is farther off than the goal, and all limits are kept."""
        if self._goal is None or self._largest_error(at) > self._goal:
            return False
        return at.problem.limits is None or at.problem.limits.kept(at.limited)

    def _to_gain(self, search: Search, fixed: BoolArray, gain: float) -> Search:
        """Minimise until less is to be gained [m]."""
        found = minimize(
            self.problem,
            search,
            fixed,
            gain,
            self.options.max_iterations,
            on_iterate=self._on_iterate,
            onto_limits=lambda at: onto_limits(at, fixed),
            reached=self._reached,
        )
        self.problem = found.at.problem
        return found

    def _largest_error(self, at: Evaluation) -> float:
        """At any target that counts [m]."""
        weighs = np.any(at.problem.objective.weights[..., 0] > 0.0, axis=0)
        off = at.run.target_positions - at.problem.objective.intended.target_positions
        return float(np.linalg.norm(off, axis=2)[at.problem.grid.judged][:, weighs].max(initial=0.0))

    def _confirm(self, fixed: BoolArray) -> None:
        """Look for the minimum once more where the state was read from a file: its trust region, its directions and the
        reason of its end are not known to be right, although its point is."""
        self._unconfirmed, ended = False, self.search
        if len(ended.history) >= self.options.max_iterations:
            return
        found = self._minimized(_restarted(ended, ended.x), fixed)
        if np.array_equal(found.x, ended.x):  # it was the minimum
            self.search = replace(ended, reason=found.reason, evaluations=found.evaluations, gradients=found.gradients,
                                  products=found.products)  # fmt: skip
        else:
            self.search = found
        self._keep()

    def _on_iterate(self, search: Search) -> None:
        self.search, self.problem = search, search.at.problem
        self._keep()
        done = self._done.fraction([iterate.gain for iterate in search.history])
        error = 1e3 * search.at.error
        self.progress(done, f"optimising: weighted error {error:.3f} mm, {search.evaluations} simulations")

    def _keep(self) -> None:
        at = self.search.at
        self.checkpoint.save(self.search, at.problem.limits, at.problem.space.basis.breaks, at.merit)

    def _refine(self) -> bool:
        """Continue on finer knots if these gain enough; whether they do."""
        at, linear = self._linearized()
        breaks = refined_breaks(at, linear, self._fixed_on, FINER * self._least)
        if breaks is None:
            return False
        space = self.problem.space
        basis = space.basis.on(self.problem.grid, breaks)
        # fixed coefficients stay exactly zero
        x = np.where(
            self._fixed_on(basis), 0.0, converted(space.basis, basis, self.search.x, len(space.motors))
        )  # fmt: skip
        self.problem, self.search = self.problem.on_basis(basis), _restarted(self.search, x)
        return True

    def _estimate_idle_gain(self) -> None:
        """Estimate the gain of idle motors at the end of the search; their offsets act at any time of the shot."""
        self._held(0)
        self.idle_gain = idle_gain(*self._linearized(), self.character)

    def _linearized(self) -> tuple[Evaluation, LinearProblem]:
        """The point of the search, and the problem linearised there."""
        evaluations, gradients = self.search.evaluations + 1, self.search.gradients + 1
        at = self.problem.at(self.search.x, self.search.at)
        self.search = replace(self.search, evaluations=evaluations, gradients=gradients, at=at)
        return at, at.linearized()

    def _prune(self, fixed: BoolArray) -> None:
        """Set negligible offsets to zero; keep all if that costs too much."""
        problem, search, motors = self.problem, self.search, len(self.problem.space.motors)
        at = problem.at(search.x, search.at)
        budget = at.merit_of_gain(PRUNED * self._least)
        energy = block_energies(search.x, motors, at.linearized().product(search.x))
        dropped = negligible_coefficients(search.x, motors, energy, budget) & ~fixed
        if not np.any(search.x[dropped]):
            return
        fixed = fixed | dropped
        begin = replace(search, x=np.where(fixed, 0.0, search.x), reason="", radius=np.inf)
        pruned = minimize(
            problem, begin, fixed, self._least, max_iterations=self.options.max_iterations + 3
        )  # fmt: skip
        limits = pruned.at.problem.limits
        kept = (limits is None or limits.kept(pruned.at.limited)) and self._reached(at) <= self._reached(pruned.at)
        if kept and pruned.at.merit <= at.merit + 2.0 * budget:
            self.search, self.problem = replace(pruned, reason=search.reason), pruned.at.problem
        else:
            self.search = replace(
                search, evaluations=pruned.evaluations, gradients=pruned.gradients, products=pruned.products
            )


def _restarted(search: Search, x: Array) -> Search:
    """The search restarted over other coefficients, with its counts and history."""
    return replace(search, x=x, radius=np.inf, recycled=Recycled.none(len(x)), reason="")
