"""Compiled kernels that a platform wheel brings, so that an installation compiles nothing.

`make wheel` compiles them for a baseline processor, and a kernel that is in no cache of the user is looked up here. It
is taken where the processor has all features for which it was compiled, and numba is the version that compiled it;
otherwise it is compiled, as with any other wheel. The folder is part of the installation and as trustworthy as its
source; files are verified against damage all the same.
"""

from __future__ import annotations

import pickle
from functools import cached_property
from pathlib import Path
from typing import Any

import numba

from calmotion.support.caching.verified_files import DamagedFileError, read_verified, sealed

PACKAGE = Path(__file__).parents[2]
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
