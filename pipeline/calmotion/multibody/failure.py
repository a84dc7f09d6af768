"""The exception of a simulation that cannot continue."""

from __future__ import annotations

from enum import StrEnum

from calmotion.multibody.model.system import State


class Reason(StrEnum):
    """Why a simulation cannot continue."""

    SINGULAR = "singular"
    DIVERGED = "diverged"
    REFINED = "refined"  # only smaller steps were possible, which have no derivatives
    NO_EQUILIBRIUM = "no static equilibrium"
    NOT_PERIODIC = "no periodic motion"


class SimulationFailure(Exception):
    """A step that could not be solved.

    Attributes:
        time_s: Time of the step, from the start of the simulation [s].
        component: The component with the largest correction.
        reason: Why.
        state: The last converged state, or None.
        share: Largest fraction of gravity with an equilibrium; 1 after the start.
    """

    def __init__(self, time_s: float, component: int, reason: Reason, state: State | None = None, share: float = 1.0):
        self.time_s, self.component, self.reason, self.state, self.share = time_s, component, reason, state, share
        super().__init__(f"{reason} at t = {time_s:.4f} s, component {component}")
