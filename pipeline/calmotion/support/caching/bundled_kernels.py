"""Compiled kernels that a platform wheel brings, and hashes of the sources that they must not outlive."""

import hashlib
import os
import pickle
import re
from collections.abc import Callable, Iterable
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numba

from calmotion.support.caching.verified_files import DamagedFileError, read_verified, sealed

PACKAGE = Path(__file__).parents[2]
_IMPORT = re.compile(
    rb"^[ \t]*(?:from (calmotion[\w.]*) import (\([^)]*\)|[^\n]*)|import (calmotion[\w.]*))", re.MULTILINE
)
_NAME = re.compile(rb"\w+")


@cache
def source_digest(*rooms: str) -> str:
    """Hash of all modules in some folders of the package, such as `multibody`; cached in the process."""
    paths = [path for room in rooms for path in sorted((PACKAGE / room).rglob("*.py"))]
    return digest_of(paths)


def digest_of(paths: Iterable[Path]) -> str:
    """Hash of the names and contents of some files, in their order."""
    digest = hashlib.sha256()
    for path in paths:
        content = path.read_bytes()
        digest.update(f"{path.name} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()


def with_imports(paths: Iterable[Path], root: Path = PACKAGE.parent) -> list[Path]:
    """Some modules and all modules of the package that they import, directly or not, sorted.

    Args:
        paths: Files below `root`.
        root: The folder that holds the package.
    """
    found: set[Path] = set()
    queue, names_in = list(paths), cache(_names_in)
    while queue:
        path = queue.pop()
        if path in found:
            continue
        found.add(path)
        for source, names, plain in _IMPORT.findall(path.read_bytes()):
            module = (source or plain).decode()
            candidates = [module, *(f"{module}.{name.decode()}" for name in _NAME.findall(names))]
            queue += [file for name in candidates for file in _files_of(root, name, names_in)]
    return sorted(found)


def _files_of(root: Path, module: str, names_in: Callable[[Path], frozenset[str]]) -> list[Path]:
    """As folders list them: a file system without capitals has `animation.py` for `Animation`, a class, as well."""
    place = root.joinpath(*module.split("."))
    names = names_in(place.parent)
    found = [place.with_suffix(".py")] if f"{place.name}.py" in names else []
    return [*found, place / "__init__.py"] if place.name in names and (place / "__init__.py").is_file() else found


def _names_in(folder: Path) -> frozenset[str]:
    return frozenset(os.listdir(folder)) if folder.is_dir() else frozenset()


FOLDER = PACKAGE / "bundled" / "kernels"


class BundledKernels:
    """The compiled forms of one function.

    Args:
        folder: Of the kernels of its package.
        name: Of its files.
    """

    def __init__(self, folder: Path, name: str):
        self._folder, self._name = folder, name

    def load(self, key: Any, form: str = "") -> Any:
        """What was compiled for a key of numba's cache on a processor that this one can stand in for, or None.

        Args:
            key: Types of arguments; triple, name and features of the processor; hashes of the function.
            form: Of the machine code, where it has a key of its own.
        """
        signature, processor, hashes = key
        for stored, name in self._index.items():
            (found, built_for, same), kind = (stored, "") if len(stored) == 3 else stored
            if (found, same, kind) == (signature, hashes, form) and runs_on(built_for, processor):
                return self._read(name)
        return None

    @cached_property
    def _index(self) -> dict[Any, str]:
        found = self._read(f"{self._name}.nbi")
        return {} if found is None or found[0] != numba.__version__ else found[2]

    def _read(self, name: str) -> Any:
        try:
            path = self._folder / name
            return pickle.loads(read_verified(path, name=name_of(path)))  # nosec B301  # of the installation
        except (DamagedFileError, OSError):
            return None


def name_of(path: Path) -> str:
    """The name with which a file of kernels is sealed: key of the sources, package and function."""
    return "/".join(path.parts[-3:])


def runs_on(built_for: tuple[str, str, str], processor: tuple[str, str, str]) -> bool:
    """Whether code for one processor runs on another; both as triple, name and features (`+avx,-sha`).

    Code that names no features may need any.
    """
    needed, had = ({text for text in features.split(",") if text[:1] == "+"} for *_, features in (built_for, processor))
    return built_for[0] == processor[0] and bool(needed) and needed <= had


def export(source: Path, target: Path) -> int:
    """Copy the kernels of a cache folder for a wheel; their number.

    Args:
        source: Folder of the kernels of these sources and options, see `compilation.kernel_folder`.
        target: Becomes `FOLDER` in the wheel.
    """
    count = 0
    for folder in sorted(source.glob("calmotion*")):
        place = target / source.name / folder.name
        place.mkdir(parents=True, exist_ok=True)
        for file in sorted(folder.glob("*.nb?")):
            content = read_verified(file, name_of(file), own=True)
            (place / file.name).write_bytes(sealed(content, name=name_of(place / file.name)))
            count += file.suffix == ".nbc"
    return count
