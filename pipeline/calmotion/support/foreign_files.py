"""Files that others name: those of other kinds in the place of a shot, a motion or settings, and places that are never
opened because a shot names them."""

from __future__ import annotations

import os

_HEAD = 4096  # bytes that tell the kind of a file
_KINDS = {
    "urdf": (
        "a URDF robot",
        "Make a shot of it: `calmotion import ROBOT.urdf --motion FILE -o robot.usda`",
    ),
    "mjcf": (
        "an MJCF robot",
        "Make a shot of it: `calmotion import ROBOT.xml --motion FILE -o robot.usda`",
    ),
    "table": (
        "a table that `--csv` wrote",
        "It is a result, for plots and spreadsheets; name the USD file of the shot, or the layer that `-o` wrote",
    ),
    "usd": (
        "a USD file",
        "It needs no import, and holds neither a motion nor settings: name it as the shot, as in `calmotion inspect "
        "FILE`",
    ),
    "bvh": (
        "a BVH motion",
        "Name it with --motion, beside the shot of a robot; `--set bvh.read.map=...` tells which channels are motors",
    ),
}

# Schemes by which a program would fetch a file or talk to a machine. Others belong to asset resolvers that the user has
# installed.
_SCHEMES = ("http", "https", "ftp", "ftps", "sftp", "ssh", "scp", "smb", "cifs", "nfs", "dav", "davs", "webdav", "file",
            "data", "ldap", "telnet", "git", "ws", "wss")  # fmt: skip
_SYSTEM = ("/dev", "/proc", "/sys")  # devices and processes
_SHARED = "/dev/shm/"  # nosec B108  # memory that is used like a disk


def forbidden_place(path: str) -> str | None:
    """What is wrong with a place that a shot names; None for one that may be opened.

    Args:
        path: As it is authored, or resolved; a symbolic link counts as what it leads to.
    """
    text = path.strip().replace("\\", "/")
    scheme, colon, rest = text.partition(":")
    if colon and scheme.lower() in _SCHEMES:
        return "a file on the network or by its address is not opened"
    if text.startswith("//"):
        return "a file of another machine is not opened"
    real = os.path.realpath(text) if os.path.isabs(text) else text
    for place in (os.path.normpath(text), real):
        if not place.startswith(_SHARED) and any(
            place == folder or place.startswith(f"{folder}/") for folder in _SYSTEM
        ):
            return "devices and files of the system are not opened"
    return None


def kind_of(path: str | os.PathLike[str]) -> str | None:
    """`urdf`, `mjcf`, `table` (written by `--csv`), `usd`, `bvh`, or None for anything else."""
    if not os.path.isfile(path):
        return None
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return None
    if head.removeprefix(b"\xef\xbb\xbf").startswith(b"time_s,"):
        return "table"
    if head.startswith((b"#usda", b"PXR-USDC")) or (head.startswith(b"PK") and str(path).lower().endswith(".usdz")):
        return "usd"
    if head.lstrip().upper().startswith(b"HIERARCHY"):
        return "bvh"
    if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        return "mjcf" if b"<mujoco" in head else "urdf" if b"<robot" in head else None
    return None


def remedy_for(path: str | os.PathLike[str], place: str = "") -> str | None:
    """What to do with a file in the wrong place, as a sentence; None where its kind is not known, or that of the
    place."""
    kind = kind_of(path)
    return None if kind is None or kind == place else f"This is {_KINDS[kind][0]}. {_KINDS[kind][1]}"
