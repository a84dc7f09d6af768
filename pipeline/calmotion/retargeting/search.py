"""The search for offsets: Gauss-Newton on knots that are refined, without inactive intervals and worthless offsets."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calmotion.retargeting.checkpoint import Checkpoint
from calmotion.retargeting.problem.adaptive_knots import carried, wanted_breaks
from calmotion.retargeting.problem.offset_basis import OffsetBasis, basis_on
from calmotion.retargeting.problem.posing import locked_coefficients
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.simplification.idle_motors import idle_gain, idle_motors
from calmotion.retargeting.simplification.inactive_intervals import (
    InactiveInterval,
    first_change,
    inactive_intervals,
    left_out_on,
    with_gains,
)
from calmotion.retargeting.simplification.pruning import block_energies, worthless
from calmotion.retargeting.simplification.report_rows import FINER, PRUNED
from calmotion.retargeting.solver.damping_homotopy import damping_homotopy
from calmotion.retargeting.solver.gauss_newton import Search, minimize
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.shot import Animation, Character
from calmotion.shot.character import Array, BoolArray
from calmotion.shot.model_choice import OFF
from calmotion.simulation.prepare import Options
from calmotion.simulation.simulate import Progress

WORTH = 0.005  # of the tolerance: what an iteration must be expected to gain
MISSED = 0.01  # of the tolerance: what changes in inactive intervals may gain together


@dataclass(eq=False)
class RetargetSearch:
    """A search and all that it changes on its way.

    Attributes:
        problem: On the knots of the moment.
        search: Where the search stands.
        inactive: Intervals in which no motor changes.
        character, animation, options: Of the shot.
        tolerance: Acceptable error [m].
        frequency: The lowest of the character [Hz].
        adaptive: Whether knots are refined.
        checkpoint: Where the search is kept.
        progress: Is told of each iteration.
        idle_gain: Gain that idle motors promise at the end [m]; None where there are none.
        interrupted: Whether the user ended it.
    """

    problem: RetargetProblem
    search: Search
    inactive: tuple[InactiveInterval, ...]
    character: Character
    animation: Animation
    options: Options
    tolerance: float
    frequency: float
    adaptive: bool
    checkpoint: Checkpoint
    progress: Progress
    idle_gain: float | None = None
    interrupted: bool = False

    def run(self, start: Array) -> None:
        """Search from a point, or go on from the checkpoint; an interrupt (Ctrl-C) ends it where it is.

        Args:
            start: Shape [n].
        """
        self.inactive = inactive_intervals(self.problem, start, self.frequency, self.tolerance, self.options.ranges)
        self.search = Search.start(np.where(self._fixed_on(self.problem.space.basis), 0.0, start))
        resumed = self._resume()
        fixed = self.hold()
        try:
            if not resumed and not np.any(start):
                self.search = damping_homotopy(self.problem, start, fixed, self.frequency)
            self._descend(fixed)
            if len(idle_motors(self.character)):
                self._look_at_idle_motors()
            fixed = self.hold()
            self.progress(0.9, "removing offsets that gain nothing")
            self._prune(fixed)
        except KeyboardInterrupt:
            self.interrupted = True
            self.progress(0.95, "interrupted: writing the best so far")

    def hold(self) -> BoolArray:
        """Coefficients that stay as they are, shape [n]; the simulation before the first of the others is kept."""
        self.problem.hold(first_change(self.problem.grid, self.problem.space.basis, self._fixed_on))
        return self._fixed_on(self.problem.space.basis)

    def locked_on(self, basis: OffsetBasis) -> BoolArray:
        """Coefficients on some basis that the shot locks, shape [n]."""
        return locked_coefficients(self.animation, basis, self.problem.space.motors, self.problem.grid.end)

    def _fixed_on(self, basis: OffsetBasis) -> BoolArray:
        return self.locked_on(basis) | left_out_on(basis, self.inactive, len(self.problem.space.motors))

    def _resume(self) -> bool:
        """Go on from the checkpoint; whether there is one."""
        resumed = self.checkpoint.load(self.problem.limits)
        if resumed is None:
            return False
        self.search, breaks = resumed
        basis = basis_on(self.problem.grid, breaks, self.problem.space.basis.kept_ends)
        self.problem = self.problem.on_basis(basis, self.search.x)
        if np.any(self.search.x[left_out_on(basis, self.inactive, len(self.problem.space.motors))]):
            self.inactive = ()  # it had gone on with them
        return True

    def _descend(self, fixed: BoolArray) -> None:
        """Minimise on knots that are refined, then with the inactive intervals where they promise too much."""
        while True:
            if not self.search.reason:
                self.search = minimize(
                    self.problem, self.search, fixed, WORTH * self.tolerance, self.options.max_iterations,
                    on_iterate=self._on_iterate,
                )  # fmt: skip
                self._keep()
            if self.search.reason == "iteration limit":
                return
            if not (self.adaptive and self._refine()):
                if self.inactive:
                    self.inactive, self.search = with_gains(self.problem, self.search, self.inactive, self.locked_on)
                missed = sum(interval.gain for interval in self.inactive)
                if self.options.ranges == OFF or missed <= MISSED * self.tolerance:
                    return
                self.inactive, self.search = (), _restarted(self.search, self.search.x)
            fixed = self.hold()

    def _on_iterate(self, search: Search) -> None:
        self.search = search
        self._keep()
        done = min(0.9, 0.1 + 0.12 * len(search.history))
        error = 1e3 * self.problem.error
        self.progress(done, f"optimising: weighted error {error:.3f} mm, {search.evaluations} simulations")

    def _keep(self) -> None:
        self.checkpoint.save(self.search, self.problem.limits, self.problem.space.basis.breaks)

    def _refine(self) -> bool:
        """Go over to finer knots where they promise enough; whether they do."""
        if not self.problem.linearized_at(self.search.x):
            self._linearize()
        breaks = wanted_breaks(self.problem, self.search.x, self._fixed_on, FINER * self.tolerance)
        if breaks is None:
            return False
        space = self.problem.space
        basis = basis_on(self.problem.grid, breaks, space.basis.kept_ends)
        # what does not change stays exactly so
        x = np.where(
            self._fixed_on(basis), 0.0, carried(space.basis, basis, self.search.x, len(space.motors))
        )  # fmt: skip
        self.problem, self.search = self.problem.on_basis(basis, x), _restarted(self.search, x)
        return True

    def _look_at_idle_motors(self) -> None:
        """The gain that idle motors promise where the search ended; they act at any time of the shot."""
        self.problem.hold(0)
        self._linearize()
        self.idle_gain = idle_gain(self.problem, self.character)

    def _linearize(self) -> None:
        self.problem.value(self.search.x)
        self.problem.linearize()
        evaluations, gradients = self.search.evaluations + 1, self.search.gradients + 1
        self.search = replace(self.search, evaluations=evaluations, gradients=gradients)

    def _prune(self, fixed: BoolArray) -> None:
        """Set offsets that gain next to nothing to zero; all stay where that costs too much."""
        problem, search, motors = self.problem, self.search, len(self.problem.space.motors)
        value = problem.value(search.x)
        problem.linearize()
        budget = problem.worth(PRUNED * self.tolerance)
        energy = block_energies(search.x, motors, problem.product(search.x))
        dropped = worthless(search.x, motors, energy, budget) & ~fixed
        if not np.any(search.x[dropped]):
            return
        held = fixed | dropped
        begin = replace(search, x=np.where(held, 0.0, search.x), reason="", radius=np.inf)
        pruned = minimize(
            problem, begin, held, WORTH * self.tolerance, max_iterations=self.options.max_iterations + 3
        )  # fmt: skip
        after = problem.value(pruned.x)
        limits = problem.limits
        if after <= value + 2.0 * budget and (limits is None or limits.kept(problem.limited)):
            self.search = replace(pruned, reason=search.reason)
        else:
            self.search = replace(
                search, evaluations=pruned.evaluations, gradients=pruned.gradients, products=pruned.products
            )


def _restarted(search: Search, x: Array) -> Search:
    """A search that goes on over other coefficients."""
    return replace(search, x=x, radius=np.inf, recycled=Recycled.none(len(x)), reason="")
