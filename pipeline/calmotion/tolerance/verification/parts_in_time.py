"""Parts of a long shot in time that can be simulated independently of each other, by as many workers as there are.

A part cannot know the state in which the one before ends. It begins earlier, where the motors move least, eases into
the motion as a shot does that begins in motion, and keeps what follows when the slowest vibration has fallen to `LEFT`.
The part before has the frames until there as well, with a beginning that is far longer ago: the distance between both
tells what the beginning has left.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Animation
from calmotion.model.curves import held_curve
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.excerpts import later
from calmotion.simulation.preparation import pose_modes
from calmotion.support.worker_processes import Fault
from calmotion.tolerance.step_error import distance

LEFT = 0.02  # of the slowest vibration, where a part begins to be kept
LEAST, MOST = 2.0, 60.0  # time from its beginning to there [s]
CALM = 2.0  # time in which the calmest instant for a beginning is looked for [s]
COMPARED = 1.0  # before a part is kept, in which it is compared with the one before [s]

Perform = Callable[[Callable[..., Any], Sequence[tuple[Any, ...]]], Iterable[tuple[int, Any]]]
Found = TypeVar("Found")


@dataclass(frozen=True)
class TimePart:
    """A part of a shot, by its frames: it is simulated from `begin` to `last`, and kept from `first` on."""

    begin: int
    first: int
    last: int


def parts_in_time(animation: Animation, length: float, lead: float) -> tuple[TimePart, ...]:
    """The parts of a shot; one where it is shorter than two of them.

    Args:
        length: Of what is kept of each, at least [s].
        lead: From the beginning of a part to what is kept of it, at least [s].
    """
    times = animation.frame_times
    frame, last = float(times[1] - times[0]), len(times) - 1
    count = max(1, math.floor(times[-1] / max(length, lead) + 1e-9))
    starts = [round(k * last / count) for k in range(count)]
    speeds = _speeds(animation)
    parts = []
    for first, end in zip(starts, [*starts[1:], last], strict=True):
        latest = first - math.ceil(lead / frame)
        earliest = max(0, latest - round(CALM / frame))
        begin = 0 if latest <= 0 else earliest + int(np.argmin(speeds[earliest : latest + 1]))
        parts.append(TimePart(begin, first, end))
    return tuple(parts)


def lead_time(shot: CompiledShot) -> float:
    """How long before it is kept a part begins [s]: until the slowest vibration in the first pose has died away."""
    frequencies, damping = pose_modes(shot)
    rates = 2.0 * np.pi * np.asarray(frequencies) * np.asarray(damping)
    slowest = float(np.min(rates[rates > 0.0], initial=math.inf))
    return min(max(LEAST, -math.log(LEFT) / slowest), MOST)


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """Where parts are simulated.

    Attributes:
        perform: Calls a function of a module with each of some arguments, anywhere, and yields indices and results, in
            any order; where one failed, a `ShotError`, or an object that says why.
        length: Of what is kept of each part, at least [s].
    """

    perform: Perform
    length: float


def in_parts(
    shot: CompiledShot, parts: Sequence[TimePart], perform: Perform, function: Callable[..., Found], *arguments: Any
) -> list[Found]:
    """What a function finds of each part of a shot.

    Args:
        parts: Of `parts_in_time`.
        perform: See `Elsewhere`.
        function: Of a module; called with the shot that a part is, and these arguments.

    Raises:
        ShotError: A part was refused, or lost with its worker.
    """
    found: dict[int, Found] = {}
    for index, one in perform(function, [(_excerpt(shot, part), *arguments) for part in parts]):
        if isinstance(one, ShotError):
            raise one
        if isinstance(one, Fault):
            raise ShotError("a part of the shot could not be simulated", path=shot.character.path, found=one.reason)
        found[index] = one
    return [found[index] for index in range(len(parts))]


def joined_positions(parts: Sequence[TimePart], positions: Sequence[Array], frame: float) -> tuple[Array, float]:
    """Positions of the targets at all frames, and the largest distance between two parts where one takes over [m].

    Args:
        positions: Of each part, at its frames from its beginning on, shape [f, K, 3] each.
        frame: Time of a frame [s].
    """
    kept, gap = [], 0.0
    for k, (part, own) in enumerate(zip(parts, positions, strict=True)):
        end = None if k == len(parts) - 1 else -1  # the last frame is the first one of the next part
        kept.append(own[part.first - part.begin : end])
        if k:
            before, other = parts[k - 1], positions[k - 1]
            since = max(part.begin, before.begin, part.first - round(COMPARED / frame))
            both = own[since - part.begin : part.first - part.begin + 1], other[since - before.begin :]
            gap = max(gap, distance(*both))
    return np.concatenate(kept), gap


def _excerpt(shot: CompiledShot, part: TimePart) -> CompiledShot:
    """The shot between two frames, with its current curves."""
    animation = shot.animation
    times = animation.frame_times[: part.last - part.begin + 1]
    whole = replace(animation, tracks=animation.current)
    return replace(shot, animation=later(whole, float(animation.frame_times[part.begin]), times))


def _speeds(animation: Animation) -> Array:
    """How fast the motors move at the frames, each as a share of its fastest, shape [f]."""
    times = animation.frame_times
    rates = [np.abs(held_curve(track, times[-1])(times, 1)) for track in animation.current]
    return np.asarray(sum(rate / max(float(rate.max()), 1e-12) for rate in rates) + np.zeros(len(times)))
