"""Settings that a user gives: a TOML file (`--settings`) and assignments (`--set fe.mesh.element_size=5mm`)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from calmotion.host.errors import SettingError
from calmotion.support.foreign_files import remedy_for
from calmotion.support.reading import read_toml

Settings = dict[str, dict[str, object]]
"""Operator idname -> property name -> string or typed value, not yet checked against the declarations."""


def read_settings_file(path: str | Path) -> Settings:
    """Settings from a TOML file with a table for each operator, such as `[fe.mesh]`.

    Raises:
        SettingError: When the file cannot be read or holds a value outside a table.
    """
    try:
        tree = read_toml(path)
    except OSError as error:
        raise SettingError(
            "the settings file cannot be read", path=str(path), found=error.strerror,
            remedy="Name a TOML file with a table for each operator, such as [fe.mesh].",
        ) from error  # fmt: skip
    except ValueError as error:
        raise SettingError(
            "the settings file is not valid TOML", path=str(path), found=error,
            remedy=remedy_for(path) or "Correct it there; a table is [fe.mesh], and a line in it element_size = '5mm'.",
        ) from error  # fmt: skip
    return merge(_flat(tree, (), str(path)))


def _flat(tree: Mapping[str, object], place: tuple[str, ...], file: str) -> Iterable[Settings]:
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _flat(value, (*place, key), file)
        elif not place:
            raise SettingError(
                "a setting stands outside a table",
                path=file,
                found=key,
                remedy="Put it below the operator's idname, such as [fe.mesh].",
            )
        else:
            yield {".".join(place): {key: value}}


def read_assignment(text: str) -> Settings:
    """One assignment `<idname>.<property>=<value>`.

    Raises:
        SettingError: When it is not of that form.
    """
    target, equals, value = text.partition("=")
    idname, dot, name = target.strip().rpartition(".")
    if not (equals and dot and idname and name):
        raise SettingError(
            "this is not a setting", found=repr(text), remedy="Write it like --set fe.mesh.element_size=5mm."
        )
    return {idname: {name: value.strip()}}


def merge(layers: Iterable[Settings]) -> Settings:
    """All settings in one; a later one beats an earlier one."""
    merged: Settings = {}
    for layer in layers:
        for idname, values in layer.items():
            merged.setdefault(idname, {}).update(values)
    return merged
