"""The tempo of a performance for pictures, videos and recordings: how fast it is, and what makes it slower."""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Character, Result, Retimed
from calmotion.views.style import titles

MOST_REASONS = 2  # that are named at a stretch


@dataclass(frozen=True, eq=False)
class SlowPart:
    """A part of a performance at another tempo.

    Attributes:
        start, end: In the performance [s].
        factor: How many times as long it takes.
        because: What forces it, as text; the limits reached at most of its instants first.
    """

    start: float
    end: float
    factor: float
    because: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Pace:
    """The tempo of a performance over its time.

    Attributes:
        times: Of the performance [s], shape [n].
        percent: Of the animation's tempo, shape [n].
        parts: Those at another tempo.
    """

    times: Array
    percent: Array
    parts: tuple[SlowPart, ...]

    def text(self, time: float) -> str:
        """The tempo at a time of the performance, and what forces it there; empty where it is the animation's."""
        for part in self.parts:
            if part.start <= time <= part.end:
                reasons = f": {', '.join(part.because)}" if part.because else ""
                return f"tempo {float(np.interp(time, self.times, self.percent)):.0f}%{reasons}"
        return ""


def pace_of(character: Character, result: Result | Retimed | None, count: int = 2000) -> Pace | None:
    """The tempo of a result; None where it is the animation's.

    Args:
        character: Whose motors forced it.
        result: That has it.
        count: Number of instants.
    """
    retimed = result.retimed if isinstance(result, Result) else result
    if retimed is None or (tempo := retimed.animation.tempo) is None:
        return None
    names = titles([motor.path for motor in character.motors])
    parts = []
    for part in retimed.report.stretches:
        start, end = tempo.performed(np.array([part.start, part.end])).tolist()
        because = [f"{name} of {names[character.motors[motor].path]}" for motor, name in part.because[:MOST_REASONS]]
        parts.append(SlowPart(start, end, part.factor, tuple(because)))
    times = np.linspace(0.0, float(tempo.animation[-1]), count)
    return Pace(tempo.performed(times), 100.0 / tempo.stretch(times), tuple(parts))
