"""The search for offsets: Gauss-Newton on adaptive knots."""

from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model import Animation, Character, OptimizerStep, SearchRecord
from calmotion.model.result import GOAL_REACHED
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import goal_of
from calmotion.retargeting.checkpoint import Checkpoint, StoredPoint
from calmotion.retargeting.feasible_start import on_sufficient_knots, onto_limits, with_moving_end, with_possible_limits
from calmotion.retargeting.left_out import FINER, first_change, idle_gain, idle_motors
from calmotion.retargeting.problem.adaptive_knots import converted, refined_breaks
from calmotion.retargeting.problem.linear_problem import LinearProblem
from calmotion.retargeting.problem.offset_basis import OffsetBasis
from calmotion.retargeting.problem.posing import locked_coefficients
from calmotion.retargeting.problem.problem import Evaluation, RetargetProblem
from calmotion.retargeting.search_progress import SearchMemory, SearchProgress
from calmotion.retargeting.solver.damping_homotopy import damping_homotopy
from calmotion.retargeting.solver.gauss_newton import Ends, Search, minimize
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.simulation.simulate import Progress
from calmotion.support import interrupts

AS_THEY_ARE = "converged"  # reason of the end where nothing is searched: another search has found the curves
NEAR = 2.0  # where a largest error is beyond the goal, else the tolerance, but not by this factor, smaller gains count,
# and however far it is under limits of feet, of which a step from one point says little
_SPENT = "history", "evaluations", "gradients", "products", "reason"  # what a search has done, wherever it ends
GAIN_NEAR = 0.2  # share of the least gain, which is one of a mean over time, that counts there


@dataclass(eq=False)
class RetargetSearch:
    """A search and its state.

    Attributes:
        input: The animator's curves; its problem is the one at the start.
        search: State of the minimisation.
        character, animation, options: Of the shot.
        tolerance: Accuracy of the simulation [m].
        frequency: Lowest frequency of the character [Hz].
        adaptive: Whether knots are refined.
        checkpoint: Stores the best point after each iteration.
        progress: Called after each iteration.
        idle_gain: Gain that idle motors would bring at the end [m]; None where there are none.
        interrupted: Whether the user ended it.
        resumed_iterations: Iterations of the checkpoint from which it resumed.
        took_over: Whether it began with the directions of the search before.
    """

    input: Evaluation
    search: Search
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

    def __post_init__(self) -> None:
        self.problem: RetargetProblem = self.input.problem  # on the current knots, with the limits as they are now
        # a robust search has an end of its own
        self._goal = None if self.options.robust else goal_of(self.character, self.options.goal)
        # a smaller predicted gain ends the search [m]
        self._least = self.options.least_gain * min(self.tolerance, self._goal or np.inf)
        self._best: tuple[tuple[float, float], RetargetProblem, Search] | None = None  # see `_remember`
        self._done = SearchProgress(self._least)

    def run(self, start: Array, last: SearchMemory | None = None) -> None:
        """Search from a point, or resume from the checkpoint; an interrupt (Ctrl-C) ends the search.

        Without any iteration allowed, the curves stay as they are.

        Args:
            start: Shape [n].
            last: What the search of almost the same shot left.
        """
        self.problem, start = with_moving_end(self.input, start)
        if self.adaptive:
            self.problem, start = on_sufficient_knots(self.problem, start, self.locked_on)
        fixed = self.locked_on(self.problem.space.basis)
        self.problem = with_possible_limits(self.problem, fixed)
        self.search = Search.start(np.where(fixed, 0.0, start), self.input)
        if not self.options.max_iterations:
            self.search = replace(self.search, reason=AS_THEY_ARE)
            return
        if last is not None:
            begun = last.begun(self.problem, self.search)
            self.took_over, self.search = begun is not self.search, begun
        resumed = self._resume()
        fixed = self.hold()
        if last is not None and not resumed:
            self._begin_within_limits(fixed)
        if self.problem.limits is not None:
            begin = self.problem.at(self.search.x, self.input) if np.any(self.search.x) else self.input
            self._remember(replace(self.search, at=begin))
        try:
            if not resumed and (not np.any(start) or self.animation.current is self.animation.tracks):
                self.search = damping_homotopy(self.problem.at(start, self.input), fixed, self.frequency)
            self._descend(fixed)
            if len(idle_motors(self.character)):
                self._estimate_idle_gain()
                self.hold()
        except KeyboardInterrupt:
            interrupts.answer()
            self.interrupted = True
            self.progress(0.95, "interrupted: writing the best so far")
        self._fall_back()

    def _remember(self, search: Search) -> None:
        """Keep the point that exceeds limits least, of those that err no more than the first one does."""
        if search.at.problem.limits is None:
            return
        rank = _excess(search.at), search.at.objective_value
        if self._best is None:
            self._first_value = rank[1]
        elif rank[1] > self._first_value or rank >= self._best[0]:
            return
        self._best = rank, self.problem, search

    def _fall_back(self) -> None:
        """Take that point where the search ends with curves that err more and exceed limits no less: those of feet may
        be so far from linear that a search does not come back to them."""
        if self._best is None:
            return
        (excess, value), problem, best = self._best
        found, over = self.search, _excess(self.search.at)
        if over and excess <= over and value < found.at.objective_value:
            spent = {name: getattr(found, name) for name in _SPENT}
            self.problem, self.search = problem, replace(best, at=problem.at(best.x, best.at), **spent)

    def _begin_within_limits(self, fixed: BoolArray) -> None:
        """Begin with the limits that the start exceeds: another search has found that it is a minimum without them."""
        at = self.problem.at(self.search.x, self.input)
        tightened = None if at.limits_act else at.tightened()
        if tightened is not None:
            self.problem, x = onto_limits(tightened, fixed)
            self.search = replace(self.search, x=x, at=at.of(self.problem))

    def record(self) -> SearchRecord:
        """The work so far, with the simulations of the input and of the result."""
        search = self.search
        gain = search.history[-1].gain if search.history else np.nan
        return SearchRecord(
            steps=tuple(OptimizerStep(i.value, i.gradient_norm, i.evaluations, 2 * i.products) for i in search.history),
            parameters=self.problem.size,
            iterations=len(search.history),
            forward_simulations=search.evaluations + 2,
            gradients=search.gradients,
            linearized_sweeps=2 * search.products + search.gradients,
            stopped="interrupted" if self.interrupted else search.reason,
            expected_gain_m=gain if np.isfinite(gain) else None,
            interrupted=self.interrupted,
            idle_gain_m=self.idle_gain,
            resumed_iterations=self.resumed_iterations,
        )

    def hold(self) -> BoolArray:
        """The fixed coefficients, shape [n], bool; curves stay as they are before the first free one acts."""
        self._held(first_change(self.problem.grid, self.problem.space.basis, self.locked_on))
        return self.locked_on(self.problem.space.basis)

    def _held(self, first: int) -> None:
        """Curves stay as they are before an instant."""
        if first < self.problem.first:
            # responses from a later instant on say nothing of the coefficients that are free from now on
            self.search = replace(self.search, sharpened=None, responses=None)
        self.problem = replace(self.problem, first=first)

    def locked_on(self, basis: OffsetBasis) -> BoolArray:
        """Coefficients of a basis that the shot locks, shape [n], bool."""
        return locked_coefficients(self.animation, basis, self.problem.space.motors, self.problem.grid.end)

    def _resume(self) -> bool:
        """Begin at the point of the checkpoint; whether there is one that has the recorded objective."""
        stored = self.checkpoint.load()
        if stored is None:
            return False
        problem, motors = self.problem, len(self.problem.space.motors)
        if not stored.fits(problem.space.basis):
            self.checkpoint.refuse("has other knots than the shot")
            return False
        basis = problem.space.basis.on(problem.grid, stored.breaks)
        if len(stored.x) != basis.count * motors:
            self.checkpoint.refuse("has a wrong number of coefficients")
            return False
        resumed = problem.on_basis(basis)
        there = resumed.tried(stored.x)
        if there is None or not stored.matches(there.objective_value):
            found = "nothing" if there is None else f"{there.objective_value:.6g}"
            self.checkpoint.refuse(f"does not fit the shot (objective {stored.objective:.6g}, simulated {found})")
            return False
        self.problem, self.search = resumed, Search.start(stored.x, there)
        self.resumed_iterations = stored.iterations
        self.progress(0.1, f"resuming after {stored.iterations} iterations of an interrupted search")
        return True

    def _descend(self, fixed: BoolArray) -> None:
        """Minimise, and refine the knots while that gains enough."""
        while True:
            if not self.search.reason:
                self.search = self._minimized(self.search, fixed)
                self._keep()
            over = self.search.reason in ("iteration limit", GOAL_REACHED)
            if over or not (self.adaptive and self._refine()):
                return
            self._done.next_pass(len(self.search.history))
            fixed = self.hold()

    def _minimized(self, search: Search, fixed: BoolArray) -> Search:
        found, enough = self._to_gain(search, fixed, self._least), self._goal or self.tolerance
        off = self._largest_error(found.at) / enough if found.reason == "converged" else 0.0
        if 1.0 < off and (off < NEAR or found.at.is_stiff):
            found = self._to_gain(replace(found, reason=""), fixed, GAIN_NEAR * self._least)
        return found

    def _reached(self, at: Evaluation) -> bool:
        """Whether no target that counts is farther off than the goal, and all limits are kept."""
        if self._goal is None or self._largest_error(at) > self._goal:
            return False
        return not _excess(at)

    def _to_gain(self, search: Search, fixed: BoolArray, gain: float) -> Search:
        """Minimise until less is to be gained [m]."""
        ends = Ends(gain, self.options.max_iterations, reached=self._reached)
        found = minimize(self.problem, search, fixed, ends, self._on_iterate, lambda at: onto_limits(at, fixed))
        self.problem = found.at.problem
        return found

    def _largest_error(self, at: Evaluation) -> float:
        """At any target that counts [m]."""
        weighs = np.any(at.problem.objective.weights[..., 0] > 0.0, axis=0)
        off = at.run.target_positions - at.problem.objective.intended.target_positions
        return float(np.linalg.norm(off, axis=2)[at.problem.grid.judged][:, weighs].max(initial=0.0))

    def _on_iterate(self, search: Search) -> None:
        self.search, self.problem = search, search.at.problem
        self._keep()
        self._remember(search)
        done = self._done.fraction([iterate.gain for iterate in search.history])
        error = 1e3 * search.at.error
        self.progress(done, f"optimising: weighted error {error:.3f} mm, {search.evaluations} simulations")

    def _keep(self) -> None:
        at, done = self.search.at, self.resumed_iterations + len(self.search.history)
        self.checkpoint.save(StoredPoint(self.search.x, at.problem.space.basis.breaks, at.objective_value, done))

    def _refine(self) -> bool:
        """Continue on finer knots if these gain enough; whether they do."""
        at, linear = self._linearized()
        breaks = refined_breaks(at, linear, self.locked_on, FINER * self._least)
        if breaks is None:
            return False
        space = self.problem.space
        basis = space.basis.on(self.problem.grid, breaks)
        # fixed coefficients stay exactly zero
        x = np.where(self.locked_on(basis), 0.0, converted(space.basis, basis, self.search.x, len(space.motors)))
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


def _excess(at: Evaluation) -> float:
    """Of the limits; 0 where all are kept."""
    limits = at.problem.limits
    return 0.0 if limits is None or limits.kept(at.limited) else limits.excess(at.limited)


def _restarted(search: Search, x: Array) -> Search:
    """The search restarted over other coefficients, with its counts and history."""
    return replace(search, x=x, radius=np.inf, recycled=Recycled.none(len(x)), reason="")
