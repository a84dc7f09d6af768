"""Texts that users name: never a file for whose content a reader would wait for ever."""

import os
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError
from calmotion.support.files import refuse_special
from calmotion.support.operating_system import SHARED_MEMORY, SYSTEM_FOLDERS


def read_text(path: str | Path) -> str:
    """The content of a UTF-8 text file.

    Raises:
        OSError: It cannot be read, or is a named pipe, a socket or a device.
        UnicodeDecodeError: It is not UTF-8.
    """
    refuse_special(path)
    return Path(path).read_text(encoding="utf-8")


def read_toml(path: str | Path) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        OSError: It cannot be read, or is a named pipe, a socket or a device.
        ValueError: It is not UTF-8, not TOML, or nested too deeply.
    """
    text = read_text(path)
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))  # which editors of Windows write
    except RecursionError:
        raise ValueError("its values are nested too deeply") from None


_HEAD = 4096  # bytes that tell the kind of a file
_LFS = b"version https://git-lfs.github.com/spec/"  # first line of a pointer (git-lfs, docs/spec.md)
_PULL = "Run `git lfs pull` in the repository that it comes from, which fetches the file itself"
_SHOWN = 4  # files in a message
_KINDS = {
    "lfs": ("a Git LFS pointer, not the file itself", _PULL),
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
        "Name it with --motion, beside the shot of a robot; `--set bvh.read.map=...` names the channels of motors",
    ),
}

# Schemes by which a program would fetch a file or talk to a machine. Others belong to asset resolvers that the user has
# installed.
_SCHEMES = ("http", "https", "ftp", "ftps", "sftp", "ssh", "scp", "smb", "cifs", "nfs", "dav", "davs", "webdav", "file",
            "data", "ldap", "telnet", "git", "ws", "wss")  # fmt: skip


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
        if not place.startswith(SHARED_MEMORY) and any(
            place == folder or place.startswith(f"{folder}/") for folder in SYSTEM_FOLDERS
        ):
            return "devices and files of the system are not opened"
    return None


def kind_of(path: str | os.PathLike[str]) -> str | None:
    """`lfs` (a pointer of Git LFS), `urdf`, `mjcf`, `table` (written by `--csv`), `usd`, `bvh`, or None for anything
    else."""
    if not os.path.isfile(path):
        return None
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return None
    if head.startswith(_LFS):
        return "lfs"
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


def refuse_lfs_pointers(files: Iterable[str | os.PathLike[str]], *, path: str = "", attribute: str = "") -> None:
    """Refuse the small text files that stand for the files themselves in a clone of a repository without Git LFS.

    Args:
        files: That are to be read; those that do not exist are none.
        path: Prim, or file that names them; empty: the first of them.
        attribute: That names them.

    Raises:
        ShotError: One is a pointer; it names four of them.
    """
    pointers = [str(file) for file in dict.fromkeys(files) if kind_of(file) == "lfs"]
    if pointers:
        more = f", and {len(pointers) - _SHOWN} more" if len(pointers) > _SHOWN else ""
        raise ShotError(
            f"this is {_KINDS['lfs'][0]}",
            path=path or pointers[0],
            attribute=attribute,
            found=", ".join(pointers[:_SHOWN]) + more,
            remedy=_PULL,
        )
