"""What a search for a tempo makes of a shot."""

from __future__ import annotations

from dataclasses import dataclass

from calmotion.model.animation import Animation
from calmotion.model.character import Character
from calmotion.model.retiming.tempo import TempoReport


@dataclass(frozen=True, eq=False)
class Retimed:
    """An animation at the tempo that was found for it.

    Attributes:
        animation: At that tempo, which it has.
        character: Whose contacts come and go at that tempo.
        report: What the tempo costs.
    """

    animation: Animation
    character: Character
    report: TempoReport
