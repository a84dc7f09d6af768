"""Reduced bodies of a character, with what their reduction found out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from calmotion.accuracy.pod_subspace import ReferenceRun
    from calmotion.reduction.reduced_body import ReducedBody
    from calmotion.shot import ModeTable


@dataclass(frozen=True, eq=False)
class ReducedBodies:
    """Bodies as the dynamics takes them, and the frequencies of the flexible ones.

    Attributes:
        bodies: One for each body of the character.
        modes: One for each flexible body.
        error_m: How far a finer reduction moves a target in the shot [m]; None where that was not found out.
        known: The shot as animated, simulated with these bodies; None where that was not done.
    """

    bodies: tuple[ReducedBody, ...]
    modes: tuple[ModeTable, ...]
    error_m: float | None = None
    known: ReferenceRun | None = None
