"""What the user overrides of a run; it imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Options:
    """What the user overrides; None keeps the shot's own or the automatic choice. Lengths [m], times [s].

    `adjoint` is discrete or continuous; `ranges` is auto, on (the whole shot is searched) or off (see
    `inactive_intervals`: without looking back); `motors` likewise (see `idle_motors`); `directions` likewise (on:
    bodies keep all coordinates; off: the fewest that are tried, whatever the error; see `pod_subspace`).
    """

    tolerance: float | None = None
    step: float | None = None
    pre_roll: float | None = None
    integrator: str | None = None
    knot_spacing: float | None = None
    smoothness: float | None = None
    max_iterations: int = 30
    adjoint: str = "discrete"
    ranges: str = "auto"
    motors: str = "auto"
    directions: str = "auto"

    @property
    def scheme(self) -> str:
        """The integrator of a simulation for which none is chosen."""
        return self.integrator or "bdf2"
