"""What a simulation raises when it cannot go on."""

from __future__ import annotations

from calmotion.multibody.model.system import State


class SimulationFailure(Exception):
    """A step that could not be solved.

    Attributes:
        time_s: When [s].
        component: Where the correction was largest.
        reason: "singular", "diverged", "refined" or "no static equilibrium".
        state: The last state that was found, or None.
        share: Part of gravity up to which there was an equilibrium; 1 once there was one.
    """

    def __init__(self, time_s: float, component: int, reason: str, state: State | None = None, share: float = 1.0):
        self.time_s, self.component, self.reason, self.state, self.share = time_s, component, reason, state, share
        super().__init__(f"{reason} at t = {time_s:.4f} s, component {component}")
