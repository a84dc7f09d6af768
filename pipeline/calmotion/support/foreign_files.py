"""Files of other kinds in the place of a shot, a motion or settings: what they are and what to do with them."""

from __future__ import annotations

import os

_HEAD = 4096  # bytes that tell the kind of a file
_KINDS = {
    "urdf": (
        "a URDF robot",
        "Convert it to USD, for example with urdf-usd-converter or in Isaac Sim, and animate it there",
    ),
    "mjcf": (
        "an MJCF robot",
        "Convert it to USD, for example with mujoco-usd-converter or in Isaac Sim, and animate it there",
    ),
    "table": (
        "a table that `--csv` wrote",
        "It is a result, for plots and spreadsheets; name the USD file of the shot, or the layer that `-o` wrote",
    ),
}


def kind_of(path: str | os.PathLike[str]) -> str | None:
    """`urdf`, `mjcf`, `table` (written by `--csv`), or None for anything else."""
    if not os.path.isfile(path):
        return None
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return None
    if head.removeprefix(b"\xef\xbb\xbf").startswith(b"time_s,"):
        return "table"
    if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        return "mjcf" if b"<mujoco" in head else "urdf" if b"<robot" in head else None
    return None


def remedy_for(path: str | os.PathLike[str]) -> str | None:
    """What to do with a file in the wrong place, as a sentence; None where its kind is not known."""
    kind = kind_of(path)
    return None if kind is None else f"This is {_KINDS[kind][0]}. {_KINDS[kind][1]}"
