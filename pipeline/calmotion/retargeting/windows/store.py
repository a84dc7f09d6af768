"""The windows that are done, on disk: a search goes on behind them, and an edit searches only what it touches.

A window is known by its inputs: the character, the settings and the animation within its frames; not by its reduced
model, which depends on the loads of the whole shot, and keeps the tolerance in any case.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Animation, Character, Track
from calmotion.model.run import RunSettings
from calmotion.multibody.model.system import State
from calmotion.reduction.cache import cache_key
from calmotion.retargeting.windows.continued import Beginning
from calmotion.retargeting.windows.plan import Window
from calmotion.support.caching.sources import source_digest
from calmotion.support.caching.verified_files import DamagedFileError, read_arrays, write_arrays

_ROOMS = ("linear_algebra", "multibody", "retargeting", "simulation", "support")
_AROUND = 0.5  # samples within this time of a window shape its curves [s]
LOG = logging.getLogger("calmotion")


def windows_path(layer: str) -> Path:
    """The file beside a layer that holds its windows."""
    path = Path(layer)
    return path.with_name(f".{path.name}.windows.npz")


def window_keys(
    character: Character, animation: Animation, options: RunSettings, h: float, windows: Sequence[Window],
    offsets: Array,
) -> list[str]:  # fmt: skip
    """A hash of the inputs of each window.

    Args:
        h: Step [s].
        offsets: With which the search begins, at the frames, shape [f, M].
    """
    settings = repr((options, h, source_digest(*_ROOMS)))
    common = f"{cache_key(character)} {hashlib.sha256(settings.encode()).hexdigest()}"
    return [cache_key((common, _inputs(animation, window, offsets))) for window in windows]


def _inputs(animation: Animation, window: Window, offsets: Array) -> list[object]:
    """What the animation has within a window."""
    times = animation.frame_times[[window.first, window.last]] + np.array([-_AROUND, _AROUND])
    parts: list[object] = [window.first, window.kept, window.last, window.is_last, times]
    parts += [offsets[window.first : window.last + 1]]
    for track in animation.tracks:
        parts += _track(track, times)
    for frame in animation.moving:
        rows = _rows(frame.times, times)
        parts += [frame.joint, frame.times[rows], frame.positions[rows], frame.rotations[rows]]
    for weight in animation.weights:
        rows = _rows(weight.times, times)
        parts += [weight.target, weight.rotation, weight.times[rows], weight.values[rows]]
    for free in animation.free:
        parts += [free.motor, [list(span) for span in free.locked(times[1]) if span[1] > times[0]]]
    return parts


def _track(track: Track, times: Array) -> list[object]:
    rows = _rows(track.times, times)
    corners = track.corners[(track.corners >= times[0]) & (track.corners <= times[1])]
    return [track.times[rows], track.values[rows], corners]


def _rows(samples: Array, times: Array) -> slice:
    """The samples in a range and one beyond each of its ends."""
    first, last = np.searchsorted(samples, times)
    return slice(max(0, int(first) - 1), int(last) + 1)


@dataclass
class WindowStore:
    """Windows that are done, in one verified file; without a path nothing is written.

    Attributes:
        path: The file.
        keys: Of all windows of this search.
        offsets: Of all motors at the frames after the windows that are done, shape [f, M]; None where none is.
        done: Which windows are.
        beginning: The states from which the window after the last one that was searched goes on; None: not known.
        after: That last one; -1: none.
    """

    path: Path | None
    keys: Sequence[str]
    offsets: Array | None = None
    done: list[bool] = field(default_factory=list)
    beginning: Beginning | None = None
    after: int = -1

    def __post_init__(self) -> None:
        self.done = [False] * len(self.keys)

    def load(self, shape: tuple[int, ...]) -> None:
        """Read what an earlier search has found, where it fits.

        Args:
            shape: Of the offsets.
        """
        if self.path is None:
            return
        try:
            found = read_arrays(self.path)
            keys = [bytes(row).decode() for row in found["keys"]]
            offsets, after = found["offsets"], int(found["after"])
            states = [found[f"state {k}"] for k in range(len(State._fields))]
            margins = found["margins"]
        except FileNotFoundError:
            return
        except (DamagedFileError, OSError, KeyError, ValueError, TypeError):
            LOG.warning("The windows in %s are not usable; the search begins anew.", self.path)
            return
        wrong = offsets.dtype != np.float64 or offsets.ndim != 2 or offsets.shape[1:] != shape[1:]
        if wrong or not np.all(np.isfinite(offsets)):
            return
        self.done = [k < len(keys) and keys[k] == key for k, key in enumerate(self.keys)]
        if not any(self.done):
            return
        self.offsets = np.zeros(shape)
        rows = min(len(offsets), shape[0])
        self.offsets[:rows] = offsets[:rows]
        if 0 <= after < len(self.keys) and self.done[after] and len(margins):
            self.beginning, self.after = Beginning(State(*states), margins), after

    def keep(self, k: int, offsets: Array, beginning: Beginning | None) -> None:
        """A window is done.

        Args:
            k: Its number.
            offsets: After it, shape [f, M].
            beginning: Of the next window; None for the last one.
        """
        self.done[k], self.offsets = True, offsets
        self.beginning, self.after = beginning, k if beginning is not None else -1
        if self.path is None:
            return
        keys = [key if done else "" for key, done in zip(self.keys, self.done, strict=True)]
        width = max(map(len, self.keys))
        states = beginning.states if beginning is not None else [np.zeros(0)] * len(State._fields)
        arrays: dict[str, Any] = {f"state {n}": part for n, part in enumerate(states)}
        arrays |= {
            "keys": np.frombuffer("".join(key.ljust(width, " ") for key in keys).encode(), np.uint8).reshape(-1, width),
            "offsets": offsets, "after": np.array(self.after),
            "margins": beginning.margins if beginning is not None else np.zeros(0),
        }  # fmt: skip
        with contextlib.suppress(OSError):
            write_arrays(self.path, arrays)
