"""Public names of a package that are imported when they are first used, so that importing the package costs nothing.

The stub of the package (`__init__.pyi`) says where each name is defined, for type checkers and at run time.
"""

import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any


@cache
def homes(package: str) -> dict[str, str]:
    """Public name to the module that defines it, as the stub of the package says."""
    import ast
    from pathlib import Path

    file = sys.modules[package].__file__
    assert file is not None
    statements = ast.parse(Path(file).with_suffix(".pyi").read_text(encoding="utf-8")).body
    return {
        alias.name: f"{package}.{statement.module}" if statement.level else statement.module
        for statement in statements
        if isinstance(statement, ast.ImportFrom) and statement.module is not None
        for alias in statement.names
        if alias.asname  # `name as name` is public, other imports serve annotations
    }


def public_names(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The functions `__getattr__` and `__dir__` of a package that has a stub; `__all__` is found by the first.

    The function for attributes raises AttributeError for a name that the stub does not have.
    """

    def attribute(name: str) -> Any:
        if name == "__all__":
            return sorted(homes(package))
        if name.startswith("__") or name not in homes(package):
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(homes(package)[name]), name)

    def names() -> list[str]:
        return sorted(homes(package))

    return attribute, names
