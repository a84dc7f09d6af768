"""The report of a crash: a file that a user can send, without paths, names of users or prims of the shot."""

from __future__ import annotations

import os
import platform
import re
import sys
import sysconfig
import traceback
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from calmotion.errors import ShotError
from calmotion.host.discovery import bundled_folder
from calmotion.support.caching.cache_folder import cache_folder
from calmotion.support.files import system_temporary, write_text
from calmotion.version import __version__
from calmotion.workflow.problems import Problem

KEPT = 10  # reports; older ones are removed
_PACKAGE = Path(__file__).resolve().parents[2]
_LIBRARIES = (
    "numpy", "scipy", "numba", "llvmlite", "scikit-fem", "trimesh", "manifold3d", "meshio", "pytetwild", "usd-core",
    "rerun-sdk", "matplotlib",
)  # fmt: skip
# A path of any system, or of a prim; an option may precede it (`--set a.b=/home/x`).
_PATH = re.compile(r"(?:[A-Za-z]:)?(?:[\\/]+|~[\\/])[^\s'\"<>|:;,=()\[\]@]+|\b[\w.-]+[\\/][^\s'\"<>|:;,=()\[\]@]+")
_KNOWN_WORDS = re.compile(r"^--?[a-z-]+$|^[a-z]+\.[a-z_.]+=|^[\d.]+[a-z]*$|^[a-z]+$")


class Names:
    """Replaces private names by numbered ones, the same name by the same number."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def replaced(self, name: str) -> str:
        """`<path 1>` with the suffix of the name."""
        suffix = Path(name).suffix if re.fullmatch(r"\.[A-Za-z0-9]{1,5}", Path(name).suffix) else ""
        return f"<path {self._numbers.setdefault(name, len(self._numbers) + 1)}>{suffix}"

    def text(self, text: str) -> str:
        """A text without its paths, and without the names of the user and the machine."""
        text = _PATH.sub(lambda match: self.replaced(match[0]), text)
        private = {platform.node(), os.environ.get("USER", ""), os.environ.get("USERNAME", ""), Path.home().name}
        for name in sorted(private - {"", "/"}, key=len, reverse=True):
            text = re.sub(rf"\b{re.escape(name)}\b", "<name>", text) if len(name) > 2 else text
        return text

    def argument(self, text: str) -> str:
        """An argument of the command line; a word that is neither an option nor a plain word is taken for a path."""
        if os.path.sep in text or "/" in text or "\\" in text:
            name, equals, value = text.partition("=")
            if equals and "/" not in name and "\\" not in name:
                return f"{name}={self.argument(value)}"
            return self.replaced(text)
        return text if _KNOWN_WORDS.match(text) and not os.path.exists(text) else self.replaced(text)


def write_crash_report(error: BaseException, arguments: Sequence[str]) -> Path | None:
    """Write the report of an unexpected exception; its file, or None where no folder can be written.

    Args:
        error: The exception, with its traceback and causes.
        arguments: The command line after the program's name.
    """
    text = report_text(error, arguments)
    name = f"crash-{datetime.now(UTC):%Y%m%d-%H%M%S}-{os.getpid()}.txt"
    for folder in (cache_folder() / "crashes", system_temporary()):
        try:
            write_text(folder / name, text)
        except OSError:
            continue
        if folder.name == "crashes":
            _remove_old(folder)
        return folder / name
    return None


def report_text(error: BaseException, arguments: Sequence[str]) -> str:
    """The text of a report."""
    names = Names()
    lines = [
        f"calmotion {__version__}: unexpected {type(error).__name__}",
        "",
        "This file has no paths, file names, prim paths or user names; read it before you send it.",
        "",
        "Command",
        f"  calmotion {' '.join(names.argument(text) for text in arguments)}",
        "",
        "Versions",
        f"  Python {platform.python_version()}, {platform.system()} {platform.release()}, {platform.machine()}",
        *(f"  {name} {_version(name)}" for name in _LIBRARIES),
        "",
        "Traceback",
        *_traceback(error, names),
        "",
    ]
    return "\n".join(lines)


def _traceback(error: BaseException, names: Names) -> list[str]:
    """The frames of an exception and its causes, without the lines of sources that are not ours."""
    lines: list[str] = []
    cause = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
    if cause is not None:
        lines += [*_traceback(cause, names), "  which led to:"]
    for frame in traceback.extract_tb(error.__traceback__):
        place = _place(frame.filename)
        lines.append(f"  {place}:{frame.lineno} in {frame.name}")
        if place.startswith("calmotion") and frame.line:
            lines.append(f"      {frame.line}")
    lines.append(f"  {type(error).__name__}: {names.text(str(error))}")
    return lines


def _place(file: str) -> str:
    """A source file relative to its package."""
    path = Path(file)
    roots = [(_PACKAGE, "calmotion"), (bundled_folder(), "calmotion_plugins")]
    roots += [(Path(sysconfig.get_path(name)), "site-packages") for name in ("purelib", "platlib")]
    roots += [(Path(sysconfig.get_path("stdlib")), "python")]
    for root, name in roots:
        if path.is_relative_to(root):
            return f"{name}/{path.relative_to(root).as_posix()}"
    return file if file.startswith("<") else f"<elsewhere>/{path.name}"


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "is not installed"


def _remove_old(folder: Path) -> None:
    for path in sorted(folder.glob("crash-*.txt"))[:-KEPT]:
        try:
            path.unlink()
        except OSError:
            pass


def crash(error: BaseException, arguments: Sequence[str] | None = None) -> ShotError:
    """Write the report of an unexpected exception; the error that tells the user where it lies.

    Args:
        error: The exception.
        arguments: The command line after the program's name; that of this process when None.
    """
    path = write_crash_report(error, sys.argv[1:] if arguments is None else arguments)
    return ShotError(
        "the program has a fault",
        found=f"{type(error).__name__}: {error}" if str(error) else type(error).__name__,
        remedy=f"Send us {path}, which has no names of yours" if path else "No folder for a report can be written",
    )


def reported(problem: Problem) -> Problem:
    """A problem that the user cannot solve, with the report of its crash in place of the traceback.

    Where a plugin that is not bundled takes part, its author needs the traceback, which stays.
    """
    error = problem.error.__cause__
    if not problem.traceback or error is None or not _is_ours(error):
        return problem
    return replace(problem, error=crash(error), traceback="")


def _is_ours(error: BaseException) -> bool:
    """Whether all frames of an exception lie in the program, its bundled plugins and libraries."""
    return not any(
        _place(frame.filename).startswith("<elsewhere>") for frame in traceback.extract_tb(error.__traceback__)
    )
