"""Public names of a package that are imported when they are first used, so that importing the package costs nothing."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any


def imported(package: str, homes: Mapping[str, tuple[str, ...]], name: str) -> Any:
    """The object of a public name, for the `__getattr__` of a package.

    Args:
        homes: Module, without `calmotion.`, to the names that it defines; `.module` is one of the package itself.

    Raises:
        AttributeError: The package has no such name.
    """
    for module, names in homes.items():
        if name in names:
            return getattr(import_module(module if module.startswith(".") else f"calmotion.{module}", package), name)
    raise AttributeError(f"module {package!r} has no attribute {name!r}")
