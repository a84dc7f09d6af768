"""What a search leaves to the next one of almost the same shot: its knots, its directions, and its preconditioner."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import IntArray
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.solver.gauss_newton import Search
from calmotion.retargeting.solver.preconditioner import Sharpened
from calmotion.retargeting.solver.recycling import Recycled


@dataclass(frozen=True, eq=False)
class SearchMemory:
    """The end of a search.

    Attributes:
        breaks, motors: Of its unknowns.
        recycled: Directions of its linear systems.
        sharpened: Preconditioner by the responses of the flexible robot, with their point; None where it had none.
    """

    breaks: IntArray
    motors: IntArray
    recycled: Recycled
    sharpened: Sharpened | None

    @classmethod
    def of(cls, problem: RetargetProblem, search: Search) -> SearchMemory:
        """What the search of a problem leaves."""
        return cls(problem.space.basis.breaks, problem.space.motors, search.recycled, search.sharpened)

    def begun(self, problem: RetargetProblem, search: Search) -> Search:
        """A search that has not begun, with what fits its problem."""
        space = problem.space
        if not np.array_equal(self.motors, space.motors) or not np.array_equal(self.breaks, space.basis.breaks):
            return search
        if self.recycled.p.shape[1] != len(search.x):
            return search
        return replace(search, recycled=self.recycled, sharpened=self.sharpened)
