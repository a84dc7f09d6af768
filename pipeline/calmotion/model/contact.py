"""When a foot stands: the times at which a joint to the world comes and goes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Contact:
    """When a joint to the world holds: a foot that stands, a hand that holds on.

    Attributes:
        times: [s] after the first frame of the shot, strictly increasing, shape [k].
        active: Whether it holds from each time on, and before the first as from it, shape [k], bool.
        friction: Coefficient of friction with the ground; -1: not known.
    """

    times: NDArray[np.float64]
    active: NDArray[np.bool_]
    friction: float = -1.0

    def holds_at(self, time: float) -> bool:
        """Whether it holds from a time [s] on."""
        return bool(self.held(np.array([time + 1e-9]))[0])

    def held(self, times: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether it holds at each of some times [s], none of which is one at which it comes or goes."""
        at = np.maximum(np.searchsorted(self.times, times, "right") - 1, 0)
        held: NDArray[np.bool_] = self.active[at]
        return held
