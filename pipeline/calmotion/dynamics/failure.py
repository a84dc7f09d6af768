"""What a simulation raises when it cannot go on."""

from __future__ import annotations


class SimulationFailure(Exception):
    """A step that could not be solved: time [s] and component, and why ("singular", "diverged", "refined" or "no static
    equilibrium")."""

    def __init__(self, time_s: float, component: int, reason: str):
        self.time_s, self.component, self.reason = time_s, component, reason
        super().__init__(f"{reason} at t = {time_s:.4f} s, component {component}")
