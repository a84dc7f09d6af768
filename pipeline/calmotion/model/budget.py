"""The error budget of a result: what each approximation may cost at the targets, and what it is estimated to cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

MESH, REDUCTION, SUBSPACE = "mesh", "reduction", "POD subspace"
CHOICES, STEP, SEARCH = "model", "time step", "search"
MEASURED = "measured error"  # stands for all others where a result was verified
SEARCH_SHARE = 0.1  # of the tolerance: a search does not pursue a smaller gain


@dataclass(frozen=True)
class BudgetEntry:
    """One approximation.

    Attributes:
        source: One of the constants of this module.
        allowed_m: What it may cost at the targets [m].
        estimated_m: What it is estimated to cost [m]; None where that is not known.
        choice: What was chosen.
        reason: Why.
        counted: Whether the verdict on the tolerance counts it; that of meshes which are finer than what is known of a
            modulus is told beside it, where nobody asked for a tolerance.
    """

    source: str
    allowed_m: float
    estimated_m: float | None
    choice: str
    reason: str
    counted: bool = True


@dataclass(frozen=True)
class Verdict:
    """Whether a result keeps its tolerance.

    Attributes:
        kept: Whether it does, as far as is known.
        error_m: Error of the simulation: measured where it was verified, else estimated [m]; None
            where neither was done.
        short: Source of the entry that fell short most, or empty.
    """

    kept: bool
    error_m: float | None
    short: str


def verdict_on(budget: Sequence[BudgetEntry], tolerance: float, measured: float | None = None) -> Verdict:
    """Whether the errors of a budget keep a tolerance [m].

    The search has no part in it: what it leaves is an error of the performance, not of its prediction.

    Args:
        measured: Distance to a finer run on finer meshes, and the error of these [m], in place of all estimates.
    """
    if not budget and measured is None:
        return Verdict(False, None, "")
    counted = [entry for entry in budget if entry.source != SEARCH and entry.counted]
    error = sum(entry.estimated_m or 0.0 for entry in counted) if measured is None else measured
    if error <= tolerance:
        return Verdict(True, error, "")
    over = {entry.source: (entry.estimated_m or 0.0) - entry.allowed_m for entry in counted}
    if measured is not None:
        over = {MEASURED: measured - tolerance}
    return Verdict(False, error, max(over, key=lambda source: over[source], default=""))
