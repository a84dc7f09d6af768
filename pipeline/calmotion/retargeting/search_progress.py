"""How far a search is, and the memory that it takes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calmotion.arrays import IntArray
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.solver.gauss_newton import Search
from calmotion.retargeting.solver.preconditioner import Sharpened
from calmotion.retargeting.solver.recycling import Recycled

FIRST_RATIO = 0.3  # of the gain after the first iteration to the one before it, until it is known
PASS = 0.7  # share of a minimisation in what is left: others, on finer knots, may follow
BEGIN, END = 0.1, 0.9  # fractions of the minimisations
SEARCH = 0.8  # share of a search in what is left: others, with a finer step, may follow

Progress = Callable[[float, str], None]


def share_of_pass(gains: Sequence[float], enough: float) -> float:
    """How far a minimisation is, 0..1: gains fall by about the same factor from iteration to iteration.

    Args:
        gains: Predicted before each of its iterations [m].
        enough: A smaller gain ends it [m].
    """
    known = [gain for gain in gains if math.isfinite(gain) and gain > 0.0]
    if not known:
        return 0.0
    if known[0] <= enough:
        return 1.0
    ratio = known[-1] / known[-2] if len(known) > 1 else FIRST_RATIO
    coming = known[-1] * min(max(ratio, 1e-3), 0.9)
    return min(max(math.log(known[0] / coming) / math.log(known[0] / enough), 0.0), 1.0)


class SearchProgress:
    """The fraction of a search, which never falls.

    Args:
        enough: A smaller predicted gain ends a minimisation [m].
    """

    def __init__(self, enough: float):
        self._enough, self._first, self._left, self._shown = enough, 0, 1.0, 0.0

    def next_pass(self, iterations: int) -> None:
        """A minimisation has ended, and another one begins after this number of iterations."""
        self._first, self._left = iterations, (1.0 - PASS) * self._left

    def fraction(self, gains: Sequence[float]) -> float:
        """The fraction, from the gains that were predicted before all iterations so far [m]."""
        done = 1.0 - self._left + PASS * self._left * share_of_pass(gains[self._first :], self._enough)
        self._shown = max(self._shown, BEGIN + (END - BEGIN) * done)
        return self._shown


class SuccessiveSearches:
    """The progress of searches of which each may be followed by another one.

    Args:
        progress: Called with the fraction of all of them.
    """

    def __init__(self, progress: Progress):
        self._progress, self._before = progress, 0.0

    def __call__(self, fraction: float, message: str) -> None:
        """The fraction of the search that runs."""
        self._progress(self._before + SEARCH * (1.0 - self._before) * fraction, message)

    def ended(self) -> None:
        """The search has ended."""
        self._before += SEARCH * (1.0 - self._before)


@dataclass(frozen=True, eq=False)
class SearchMemory:
    """The end of a search.

    Attributes:
        breaks, motors: Of its unknowns.
        recycled: Directions of its linear systems.
        sharpened: Preconditioner by the responses of the flexible robot, with their point; None where it had none.
        responses: Derivatives under limits; None where it had none.
    """

    breaks: IntArray
    motors: IntArray
    recycled: Recycled
    sharpened: Sharpened | None
    responses: Any

    @classmethod
    def of(cls, problem: RetargetProblem, search: Search) -> SearchMemory:
        """What the search of a problem leaves."""
        return cls(
            problem.space.basis.breaks, problem.space.motors, search.recycled, search.sharpened, search.responses
        )

    def begun(self, problem: RetargetProblem, search: Search) -> Search:
        """A search that has not begun, with what fits its problem."""
        space = problem.space
        if not np.array_equal(self.motors, space.motors) or not np.array_equal(self.breaks, space.basis.breaks):
            return search
        if self.recycled.p.shape[1] != len(search.x):
            return search
        return replace(search, recycled=self.recycled, sharpened=self.sharpened, responses=self.responses)
