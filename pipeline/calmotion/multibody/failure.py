"""The exception of a simulation that cannot continue."""

from enum import StrEnum

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.model.system import State


class Reason(StrEnum):
    """Why a simulation cannot continue."""

    SINGULAR = "singular"
    DIVERGED = "diverged"
    REFINED = "refined"  # only smaller steps were possible, which have no derivatives
    NO_EQUILIBRIUM = "no static equilibrium"
    OPEN = "joints that do not meet"
    NOT_PERIODIC = "no periodic motion"


NOWHERE = -1  # a component that is not known


class SimulationFailure(Exception):
    """A step that could not be solved.

    Attributes:
        time_s: Time of the step, from the start of the simulation [s].
        component: The component with the largest correction, NOWHERE where that is not known.
        reason: Why.
        state: The last converged state, or None.
        share: Largest fraction of gravity with an equilibrium; 1 after the start.
        gap: Of the joint that stays open the most, shape [6] [m, rad]; `component` is then its number, those that close
            chains after those of the tree.
    """

    def __init__(
        self, time_s: float, component: int, reason: Reason, state: State | None = None, share: float = 1.0,
        gap: Array | None = None,
    ):  # fmt: skip
        self.time_s, self.component, self.reason, self.state, self.share = time_s, component, reason, state, share
        self.gap = np.zeros(6) if gap is None else gap
        super().__init__(f"{reason} at t = {time_s:.4f} s, component {component}")
