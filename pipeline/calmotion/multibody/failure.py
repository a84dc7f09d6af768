"""The exception of a simulation that cannot continue."""

from __future__ import annotations

from calmotion.multibody.model.system import State


class SimulationFailure(Exception):
    """A step that could not be solved.

    Attributes:
        time_s: Time of the step, from the start of the simulation [s].
        component: The component with the largest correction.
        reason: "singular", "diverged", "refined" or "no static equilibrium".
        state: The last converged state, or None.
        share: Largest fraction of gravity with an equilibrium; 1 after the start.
    """

    def __init__(self, time_s: float, component: int, reason: str, state: State | None = None, share: float = 1.0):
        self.time_s, self.component, self.reason, self.state, self.share = time_s, component, reason, state, share
        super().__init__(f"{reason} at t = {time_s:.4f} s, component {component}")
