"""The windows of a long shot: their lengths, and by how much they overlap.

What a command does dies away like exp(-zeta omega t). A search over a window therefore ends later than the part of it
that is kept, by the time in which the slowest mode falls to a tenth. It may be less, a quarter of a window: searches
that follow damp what is left much faster than the robot does (measured: a factor of five in half a second at 4 Hz and
1.2%).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Animation, Character
from calmotion.model.budget import SEARCH_SHARE
from calmotion.model.character import contact_joints
from calmotion.model.run import LONG_SHOT, WINDOW, WINDOW_OVERLAP, RunSettings

FALL = 10.0  # factor by which the slowest mode falls in an overlap
LEAST_OVERLAP = 1.0  # overlap, but not above half a window [s]
SUFFICIENT = 1.5  # overlap that is not shortened to a quarter of a window, but to half of one [s]
FEWEST_FRAMES = 12  # frames of a window
EXACT = 0.0001  # of the tolerance: the least gain of a window at which it agrees with one search within a tenth of it


@dataclass(frozen=True)
class Window:
    """A part of a shot, by its frames.

    Attributes:
        first, kept, last: The window begins at `first` and ends at `last`; what lies after `kept` is searched again by
            the next window.
        frames: Number of frames of the shot.
    """

    first: int
    kept: int
    last: int
    frames: int

    @property
    def is_last(self) -> bool:
        """Whether the shot ends with it."""
        return self.last == self.frames - 1


def window_length(character: Character, animation: Animation, options: RunSettings) -> float | None:
    """Length of the windows of a shot [s]; None where one search covers it.

    Raises:
        ShotError: Windows are requested where there can be none.
    """
    length, wanted = float(animation.frame_times[-1]), options.window
    cyclic, robust, play = character.retarget.cyclic, options.robust is not None, options.avoid_reversals > 0.0
    if wanted is None:
        one = cyclic or robust or play or options.adjoint == "continuous" or bool(contact_joints(character))
        return WINDOW if length > LONG_SHOT and not one else None
    if wanted == 0.0:
        return None
    if options.adjoint == "continuous":
        raise ShotError(
            "windows do not support the continuous adjoint", path=character.path, attribute="retarget.optimize.adjoint",
            found=options.adjoint, remedy="Use the discrete adjoint, or remove --window",
        )  # fmt: skip
    if cyclic or robust:
        raise ShotError(
            "windows do not support " + ("cyclic shots" if cyclic else "robust curves"),
            path=character.path,
            attribute="calm:retarget:cyclic" if cyclic else "--robust",
            found=True if cyclic else options.robust.kind if options.robust else None,
            remedy="Remove --window",
        )
    if play:
        raise ShotError(
            "windows do not support --avoid-reversals: what counts is on which side a gear lies in the first pose",
            path=character.path, attribute="--avoid-reversals", found=options.avoid_reversals, remedy="Remove --window",
        )  # fmt: skip
    contacts = contact_joints(character)
    if contacts:
        raise ShotError(
            "windows do not support contacts", path=character.joints[contacts[0]].path, attribute="--window",
            found=f"{wanted:g} s", remedy="Use --window 0: one search for the whole shot",
        )  # fmt: skip
    frame = float(animation.frame_times[1] - animation.frame_times[0])
    if wanted < FEWEST_FRAMES * frame:
        raise ShotError(
            "the windows are too short", path=character.path, attribute="--window", found=f"{wanted:g} s",
            remedy=f"Use {FEWEST_FRAMES * frame:.3g} s or more: {FEWEST_FRAMES} frames",
        )  # fmt: skip
    return wanted if wanted < length else None


def least_gain(character: Character, animation: Animation, options: RunSettings) -> float:
    """The gain below which a search of a shot ends unless the user says otherwise, a part of the tolerance.

    Searches that gain less than a tenth of the tolerance by root mean squares may still be several times as far from
    the optimum, each elsewhere. What is found of a long shot is not to depend on its windows, so searches in windows
    end later; measured: a tenth more processor time for 0.0003, and 6% more products for `EXACT`. The one search of a
    long shot (`--window 0`) ends where what it would gain in all is what a window may leave: a mean over two minutes
    hides what is wrong in a tenth of a second.
    """
    length = float(animation.frame_times[-1])
    if window_length(character, animation, options) is not None:
        return EXACT
    return EXACT * WINDOW / length if options.window == 0.0 and length > LONG_SHOT else SEARCH_SHARE


def overlap_time(frequencies: Array, damping: Array, length: float) -> float:
    """By how much windows overlap [s].

    Args:
        frequencies, damping: Of the modes [Hz], and their damping ratios.
        length: Of the windows [s].
    """
    rates = 2.0 * np.pi * np.asarray(frequencies) * np.asarray(damping)  # amplitudes fall like exp(-rate t)
    slowest = float(np.min(rates[rates > 0.0], initial=math.inf))
    falling = math.log(FALL) / slowest if math.isfinite(slowest) else LEAST_OVERLAP
    return min(max(LEAST_OVERLAP, falling), max(WINDOW_OVERLAP * length, min(SUFFICIENT, 0.5 * length)))


def plan_windows(frame_times: Array, length: float, overlap: float) -> tuple[Window, ...]:
    """The windows of a shot; the last one takes what would be too short for one of its own.

    Args:
        frame_times: [s], uniform, shape [f].
        length: Of the kept parts [s].
        overlap: [s].
    """
    frames, frame = len(frame_times), float(frame_times[1] - frame_times[0])
    stride, more = max(FEWEST_FRAMES, round(length / frame)), max(FEWEST_FRAMES // 2, math.ceil(overlap / frame - 1e-9))
    starts = list(range(0, frames - 1, stride))
    while len(starts) > 1 and frames - 1 - starts[-1] < max(more, stride // 2):
        starts.pop()
    windows = []
    for first, following in zip(starts, [*starts[1:], frames - 1], strict=True):
        # a tail that would leave a few frames for nobody reaches the end
        last = frames - 1 if following + more + FEWEST_FRAMES // 2 >= frames - 1 else following + more
        windows.append(Window(first, following, last, frames))
    return tuple(windows)
