"""The static description of a plugin, `plugin.toml`, read without importing anything of the plugin."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from calmotion.host.errors import PluginError
from calmotion.support.foreign_files import read_toml

FILE_NAME = "plugin.toml"
_TEXTS = ("id", "version", "name", "tagline", "maintainer", "license", "calmotion")
_LISTS = ("tags", "requires")
_COMMANDS = "commands"
_COMMAND_FIELDS = ("module", "help")
_NO_RANGE = "is not a range of versions"


@dataclass(frozen=True)
class CommandEntry:
    """A command of the command line, a table `[commands.NAME]` of `plugin.toml`.

    Attributes:
        name: As it is typed.
        module: The module inside the plugin that holds it, such as `command`.
        help: What it does, for the list of commands.
    """

    name: str
    module: str
    help: str


@dataclass(frozen=True)
class Manifest:
    """The content of `plugin.toml`.

    Attributes:
        id: Name of the plugin's folder.
        version: Its version.
        name, tagline: For lists.
        maintainer, license: Whom to ask, and the SPDX identifier.
        tags: For lists.
        calmotion: Range of Calmotion versions it works with, such as `>=0.1`.
        requires: Python distributions it needs, such as `trimesh>=4`.
        commands: What it adds to the command line.
    """

    id: str
    version: str
    name: str
    tagline: str
    maintainer: str
    license: str
    tags: tuple[str, ...]
    calmotion: str
    requires: tuple[str, ...]
    commands: tuple[CommandEntry, ...] = ()


def read_manifest(folder: Path) -> Manifest:
    """The manifest of the plugin in `folder`.

    Raises:
        PluginError: When the file is missing, is not TOML, or a field is missing, unknown or wrong.
    """
    file = folder / FILE_NAME
    try:
        fields = read_toml(file)
    except OSError as error:
        raise PluginError("the manifest cannot be read", path=str(file), found=error.strerror) from error
    except ValueError as error:
        raise PluginError("the manifest is not valid TOML", path=str(file), found=error) from error
    _check_fields(fields, file)
    others: dict[str, Any] = {key: tuple(fields[key]) for key in _LISTS}
    others[_COMMANDS] = _commands(fields.get(_COMMANDS, {}), file)
    manifest = Manifest(**fields | others)
    _check_values(manifest, file)
    return manifest


def _check_fields(fields: dict[str, Any], file: Path) -> None:
    for key in fields:
        if key not in (*_TEXTS, *_LISTS, _COMMANDS):
            known = ", ".join((*_TEXTS, *_LISTS, _COMMANDS))
            raise PluginError("unknown field", path=str(file), attribute=key, remedy=f"The fields are {known}.")
    for key in _TEXTS + _LISTS:
        if key not in fields:
            raise PluginError("a field is missing", path=str(file), attribute=key, remedy="Add it.")
        value = fields[key]
        if key in _TEXTS and not (isinstance(value, str) and value.strip()):
            raise PluginError("must be a text that is not empty", path=str(file), attribute=key, found=repr(value))
        if key in _LISTS and not (isinstance(value, list) and all(isinstance(v, str) for v in value)):
            raise PluginError("must be a list of texts", path=str(file), attribute=key, found=repr(value))


def _commands(tables: Any, file: Path) -> tuple[CommandEntry, ...]:
    """What the tables `[commands.NAME]` hold.

    Raises:
        PluginError: A name, a field or a module is missing, unknown or wrong.
    """
    example = 'Write [commands.NAME] with module = "MODULE" and help = "what it does".'
    if not isinstance(tables, dict):
        raise PluginError("must be tables", path=str(file), attribute=_COMMANDS, found=repr(tables), remedy=example)
    for name, table in tables.items():
        place = f"{_COMMANDS}.{name}"
        if not re.fullmatch(r"[a-z][a-z0-9-]*", name):
            raise PluginError("must be a lower-case name", path=str(file), attribute=place, remedy="Use a-z, 0-9, -.")
        if not isinstance(table, dict) or set(table) != set(_COMMAND_FIELDS):
            raise PluginError(
                "must be a table of module and help", path=str(file), attribute=place, found=repr(table), remedy=example
            )
        for key, value in table.items():
            if not (isinstance(value, str) and value.strip() and "\n" not in value):
                raise PluginError(
                    "must be a line of text",
                    path=str(file),
                    attribute=f"{place}.{key}",
                    found=repr(value),
                    remedy=example,
                )
        inside = file.parent.joinpath(*table["module"].split("."))
        if not (inside.with_name(f"{inside.name}.py").is_file() or (inside / "__init__.py").is_file()):
            raise PluginError(
                "the plugin has no such module",
                path=str(file),
                attribute=f"{place}.module",
                found=table["module"],
                remedy=f"Name a module in the folder {file.parent.name}, such as command for command.py.",
            )
    return tuple(CommandEntry(name, **table) for name, table in tables.items())


def _check_values(manifest: Manifest, file: Path) -> None:
    from packaging.requirements import Requirement
    from packaging.specifiers import SpecifierSet
    from packaging.version import Version

    name, wrong = manifest.id, [text for text in manifest.requires if not _can_be(Requirement, text)]
    rules = (
        ("id", name, re.fullmatch(r"[a-z][a-z0-9_]*", name), "must be a lower-case name", "Use a-z, 0-9, _."),
        ("id", name, name == file.parent.name, f"must be the folder's name, {file.parent.name}", ""),
        ("tagline", repr(manifest.tagline), "\n" not in manifest.tagline, "must be one line", ""),
        ("version", manifest.version, _can_be(Version, manifest.version), "is not a version", "Write 0.1.0."),
        ("calmotion", (text := manifest.calmotion), _can_be(SpecifierSet, text), _NO_RANGE, 'Write ">=0.1".'),
        ("requires", ", ".join(wrong), not wrong, "is not a Python requirement", 'Write "trimesh>=4".'),
    )
    for attribute, found, holds, problem, remedy in rules:
        if not holds:
            raise PluginError(problem, path=str(file), attribute=attribute, found=found, remedy=remedy)


def _can_be(kind: Callable[[str], object], text: str) -> bool:
    """Whether a text is a version, a range of versions or a requirement."""
    try:
        kind(text)
    except ValueError:  # all errors of `packaging` are
        return False
    return True


def check_requirements(manifest: Manifest, calmotion_version: str) -> None:
    """Check what the plugin needs against what is installed, without importing it.

    Raises:
        PluginError: When this Calmotion or an installed distribution does not fit, or one is missing.
    """
    from importlib.metadata import PackageNotFoundError

    from packaging.requirements import Requirement
    from packaging.specifiers import SpecifierSet

    if not SpecifierSet(manifest.calmotion).contains(calmotion_version, prereleases=True):
        raise PluginError(
            f"the plugin needs Calmotion {manifest.calmotion}",
            path=manifest.id,
            found=calmotion_version,
            remedy="Install versions of the two that fit.",
        )
    for text in manifest.requires:
        requirement = Requirement(text)
        if requirement.marker and not requirement.marker.evaluate():
            continue
        remedy = f"Install it: pip install '{text}'."
        try:
            found = _installed(requirement.name)
            if not requirement.specifier.contains(found, prereleases=True):
                _installed.cache_clear()  # another one may have been installed since it was read
                found = _installed(requirement.name)
        except PackageNotFoundError:
            raise PluginError(
                f"the plugin needs {text}", path=manifest.id, found="not installed", remedy=remedy
            ) from None
        if not requirement.specifier.contains(found, prereleases=True):
            raise PluginError(f"the plugin needs {text}", path=manifest.id, found=found, remedy=remedy)


@cache
def _installed(name: str) -> str:
    """The version of a distribution, read once: its metadata is long, and plugins of each host need the same few.

    Raises:
        PackageNotFoundError: It is not installed; the next call looks again.
    """
    from importlib.metadata import version

    return version(name)
