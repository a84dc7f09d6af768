"""Hashes of the package's sources, for caches that must not outlive the code that made them."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

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
    queue = list(paths)
    while queue:
        path = queue.pop()
        if path in found:
            continue
        found.add(path)
        for source, names, plain in _IMPORT.findall(path.read_bytes()):
            module = (source or plain).decode()
            candidates = [module, *(f"{module}.{name.decode()}" for name in _NAME.findall(names))]
            queue += [file for name in candidates for file in _files_of(root, name)]
    return sorted(found)


def _files_of(root: Path, module: str) -> list[Path]:
    place = root.joinpath(*module.split("."))
    return [file for file in (place.with_suffix(".py"), place / "__init__.py") if file.is_file()]
