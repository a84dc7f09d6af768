"""The BVH format: a hierarchy of joints with channels, then a row of numbers for each frame."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError, file_access
from calmotion.support import exact_step, refuse_lfs_pointers, refuse_special, too_large

_EXPANSION = 12.0  # memory of the lines and numbers of a file, by its size
_FRAME_TIME = "Frame Time:"
_AXES = ("Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation")
_CHANNELS = {axis.lower(): axis for axis in _AXES}


@dataclass(frozen=True, eq=False)
class BvhMotion:
    """A motion as it stands in the file.

    Attributes:
        path: The file.
        channels: `Joint.Xrotation` and so on, in the order of the columns.
        frame_time: [s].
        frames: Degrees, or the file's unit of length, shape [frames, channels].
    """

    path: str
    channels: tuple[str, ...]
    frame_time: float
    frames: Array


def read_bvh(path: str) -> BvhMotion:
    """Read a file.

    Raises:
        ShotError: It cannot be read, or is not BVH; with the line.
    """
    with file_access("the motion cannot be read", path, "Check the file"):
        refuse_special(path)
        refuse_lfs_pointers([path])
        if reason := too_large(path, _EXPANSION):
            raise OSError(0, f"it is too large for the memory: {reason}")
        with open(path, encoding="utf-8-sig", errors="replace") as stream:
            lines = stream.read().splitlines()
    head = next((n for n, line in enumerate(lines) if line.strip()), 0)
    if not lines or lines[head].strip().upper() != "HIERARCHY":
        raise _wrong(path, head + 1, "a BVH file begins with HIERARCHY", lines[head][:60] if lines else "nothing")
    motion = next((n for n, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    if motion is None:
        raise _wrong(path, len(lines), "there is no MOTION", lines[-1])
    channels = tuple(_channels(path, lines[:motion]))
    count = _number(path, lines, motion + 1, "Frames:")
    frame_time = _number(path, lines, motion + 2, _FRAME_TIME)
    if not frame_time > 0.0:
        raise _wrong(path, motion + 3, "the frame time must be positive", lines[motion + 2])
    frame_time = exact_step(lines[motion + 2].partition(":")[2].strip())
    rows = [row for row in enumerate(lines[motion + 3 :], motion + 4) if row[1].strip()]
    if len(rows) != int(count) or not rows:
        raise _wrong(
            path, motion + 2, "the number of frames does not match `Frames:`", f"Frames: {count:g}, rows: {len(rows)}",
            "Correct it where the rows are right; each frame is one row. Else the file is cut off: export it again",
        )  # fmt: skip
    return BvhMotion(path, channels, frame_time, np.array([_row(path, n, line, len(channels)) for n, line in rows]))


def _channels(path: str, lines: list[str]) -> Iterator[str]:
    """Names of the channels of all joints."""
    joint, seen = "", set()
    for number, line in enumerate(lines, 1):
        words = line.replace("{", " ").split()
        if not words:
            continue
        if words[0].upper() in ("ROOT", "JOINT"):
            joint = " ".join(words[1:])
            if not joint or joint in seen:
                raise _wrong(path, number, "each joint needs a unique name", line.strip(), "Rename the joint")
            seen.add(joint)
        elif words[0].upper() == "CHANNELS":
            axes = [_CHANNELS.get(axis.lower(), "") for axis in words[2:]]
            if not joint or not all(axes) or len(words) < 2 or words[1] != str(len(axes)):
                raise _wrong(
                    path, number, f"CHANNELS needs the number of channels, and names among {', '.join(_AXES)}", line
                )
            yield from (f"{joint}.{axis}" for axis in axes)


def _number(path: str, lines: list[str], index: int, label: str) -> float:
    text = " ".join(lines[index].split()) if index < len(lines) else ""
    try:
        if not text.lower().startswith(label.lower()):
            raise ValueError
        value = float(text[len(label) :])
        if not np.isfinite(value):
            raise ValueError
    except ValueError:
        remedy = "Write decimals with a point" if "," in text else "Write this line below MOTION, with the number"
        raise _wrong(path, index + 1, f"expected `{label}` and a number", text or "nothing", remedy) from None
    return value


def _row(path: str, number: int, line: str, count: int) -> list[float]:
    try:
        row = [float(word) for word in line.split()]
    except ValueError:
        row = []
    if len(row) != count or not np.all(np.isfinite(row)):
        found = f"{len(line.split())} words: {line.strip()[:60]}"
        remedy = "Write a number for each channel, with spaces between them and decimals with a point"
        raise _wrong(path, number, f"a frame has {count} finite numbers", found, remedy)
    return row


def _wrong(path: str, number: int, problem: str, found: str, remedy: str = "Export the motion again") -> ShotError:
    return ShotError(problem, path=path, attribute=f"line {number}", found=found, remedy=remedy)
