"""What the user overrides of a run; it imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from calmotion.shot.model_choice import ModelChoices
from calmotion.shot.run import Source


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


def requested_options(source: Source | None, choices: ModelChoices | None = None, **more: Any) -> Options:
    """What the user asked for.

    Args:
        source: The user's request; None: nothing is overridden.
        choices: Simplifications, some of which the user may have forced.
        more: Fields of `Options` that no request holds.
    """
    if choices is not None:
        more |= {kind: choices.choice(kind) for kind in ("directions", "motors", "ranges")}
    if source is not None:
        asked = {name: getattr(source, name) for name in ("tolerance", "step", "pre_roll", "integrator")}
        more = asked | more
    return Options(**more)
