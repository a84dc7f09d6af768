"""Settings that a user gives, and which plugins the user has disabled."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from calmotion.host.errors import SettingError
from calmotion.support.caching.cache_folder import CONFIGURATION_VARIABLE, configuration_folder
from calmotion.support.files import write_text
from calmotion.support.foreign_files import read_toml, remedy_for
from calmotion.support.operating_system import locked

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
            "the settings file cannot be read",
            path=str(path),
            found=error.strerror,
            remedy="Name a TOML file with a table for each operator, such as [fe.mesh].",
        ) from error
    except ValueError as error:
        raise SettingError(
            "the settings file is not valid TOML",
            path=str(path),
            found=error,
            remedy=remedy_for(path) or "Correct it there; a table is [fe.mesh], and a line in it element_size = '5mm'.",
        ) from error
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


FILE_NAME = "plugins.toml"


def disabled_plugins(environment: Mapping[str, str] | None = None) -> frozenset[str]:
    """Ids of the plugins that the user has disabled.

    Raises:
        SettingError: The file cannot be read, or is not what `disable` writes.
    """
    file = configuration_folder(environment) / FILE_NAME
    try:
        ids = read_toml(file).get("disabled", [])
    except (FileNotFoundError, NotADirectoryError):
        return frozenset()
    except (OSError, ValueError) as error:
        raise SettingError(
            "the list of disabled plugins cannot be read",
            path=str(file),
            found=error,
            remedy="Correct or remove the file.",
        ) from error
    if not (isinstance(ids, list) and all(isinstance(name, str) for name in ids)):
        raise SettingError(
            "must be a list of ids",
            path=str(file),
            attribute="disabled",
            found=repr(ids),
            remedy="Correct or remove the file.",
        )
    return frozenset(ids)


def choose(plugin_id: str, enabled: bool, environment: Mapping[str, str] | None = None) -> Path:
    """Keep whether a plugin is enabled; returns the file.

    Raises:
        SettingError: The file cannot be read or written.
    """
    file = configuration_folder(environment) / FILE_NAME
    head = "# Plugins that are not loaded; `calmotion plugins enable ID` removes one from the list.\n"
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with locked(file.parent):  # two that choose at once are both kept
            kept = disabled_plugins(environment)
            kept = kept - {plugin_id} if enabled else kept | {plugin_id}
            names = ", ".join(f'"{name}"' for name in sorted(kept))
            write_text(file, f"{head}disabled = [{names}]\n")
    except OSError as error:
        raise SettingError(
            "the list of disabled plugins cannot be saved",
            path=str(file),
            found=error.strerror,
            remedy=f"Make the folder writable, or name another one with {CONFIGURATION_VARIABLE}.",
        ) from error
    return file
