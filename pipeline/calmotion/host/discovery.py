"""Discovery and import of plugins and of their commands. Files beside a shot are never read or imported."""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
import traceback
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

import calmotion_plugins

from calmotion.host.errors import PluginError, SettingError
from calmotion.host.manifest import FILE_NAME, CommandEntry, Manifest, check_requirements, read_manifest
from calmotion.host.settings import disabled_plugins
from calmotion.version import __version__

ENTRY_POINT_GROUP = "calmotion.plugins"
FOLDERS_VARIABLE = "CALMOTION_PLUGINS"


@dataclass(frozen=True)
class Location:
    """A place of a plugin.

    Attributes:
        folder: The folder with `plugin.toml`.
        origin: Where it comes from, for the user.
        module: Import name of a plugin that is installed as a package; empty for a folder.
    """

    folder: Path
    origin: str
    module: str = ""


def bundled_folder() -> Path:
    """The folder of the bundled plugins, which are the packages of `calmotion_plugins`."""
    return Path(calmotion_plugins.__path__[0]).resolve()


def find_in_folder(folder: Path, origin: str) -> list[Location]:
    """The plugin that `folder` is, else the plugins that are its direct sub-folders, by name."""
    if (folder / FILE_NAME).is_file():
        return [Location(folder.resolve(), origin)]
    subfolders = sorted(path for path in folder.iterdir() if (path / FILE_NAME).is_file())
    return [Location(path.resolve(), origin) for path in subfolders]


def find_entry_points() -> list[Location]:
    """Plugins of installed distributions: entry points whose value is a package that holds `plugin.toml`."""
    from importlib.metadata import entry_points

    locations = []
    for point in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda point: point.name):
        origin = f"entry point {point.name}" + (f" of {point.dist.name}" if point.dist else "")
        locations.append(Location(_package_folder(point.module) or Path(point.name), origin, point.module))
    return locations


def _package_folder(module: str) -> Path | None:
    # find_spec of a dotted name imports its parents, so only the first part is looked up by it.
    from importlib.util import find_spec

    first, *rest = module.split(".")
    try:
        spec = find_spec(first)
    except (ImportError, ValueError):
        return None
    for root in (spec.submodule_search_locations or ()) if spec else ():
        if (folder := Path(root, *rest)).is_dir():
            return folder.resolve()
    return None


def discover(folders: Iterable[str | Path] = (), environment: Mapping[str, str] | None = None) -> list[Location]:
    """All places with plugins: bundled, entry points, folders named by the environment, folders named here.

    Args:
        folders: Folders that the user names.
        environment: Environment variables; the process's own when None.

    Raises:
        SettingError: When a named folder does not exist or holds no plugin.
    """
    variables = os.environ if environment is None else environment
    locations = find_in_folder(bundled_folder(), "bundled")
    locations += find_entry_points()
    for text in variables.get(FOLDERS_VARIABLE, "").split(os.pathsep):
        locations += _named(Path(text), FOLDERS_VARIABLE) if text.strip() else []
    for folder in folders:
        locations += _named(Path(folder), "--plugins")
    unique = {location.folder: location for location in reversed(locations)}
    return [location for location in locations if unique.pop(location.folder, None)]


def _named(folder: Path, origin: str) -> list[Location]:
    folder = folder.expanduser()
    locations = find_in_folder(folder, f"{origin} {folder}") if folder.is_dir() else []
    if not locations:
        raise SettingError(
            f"{origin} names a folder without a plugin",
            path=str(folder),
            remedy=f"Name a folder that holds {FILE_NAME}, or whose sub-folders do.",
        )
    return locations


def import_plugin(plugin_id: str, location: Location) -> ModuleType:
    """Import the module of a plugin, as a package, so that it can import its own sub-modules.

    A bundled plugin is `calmotion_plugins.<id>`, which other processes import too: its functions can be sent to them.
    Any other folder gets a name with a checksum of its path, so two folders of the same name never mix.

    Raises:
        PluginError: When the module or its `register`/`unregister` is missing.
        Exception: Whatever the module raises; nothing of it stays imported then.
    """
    module = _import_package(location.module) if location.module else _import_folder(plugin_id, location.folder)
    for function in ("register", "unregister"):
        if not callable(getattr(module, function, None)):
            raise PluginError(
                f"the module has no function {function}", path=str(location.folder), remedy=f"Add {function}(host)."
            )
    return module


def _import_package(name: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except BaseException:
        _forget(name)
        raise


def _import_folder(plugin_id: str, folder: Path) -> ModuleType:
    file = folder / "__init__.py"
    if not file.is_file():
        raise PluginError("the plugin has no module", path=str(folder), remedy="Add __init__.py.")
    if folder.parent == bundled_folder():
        return _import_package(f"{calmotion_plugins.__name__}.{plugin_id}")
    name = f"calmotion_plugin_{plugin_id}_{zlib.crc32(str(folder).encode()):08x}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, file, submodule_search_locations=[str(folder)])
    assert spec and spec.loader  # a file that ends in .py always has both
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        _forget(name)
        raise
    return module


def _forget(name: str) -> None:
    """Take a package and its sub-modules out of those that are imported."""
    for imported in [key for key in sys.modules if key == name or key.startswith(name + ".")]:
        del sys.modules[imported]


@dataclass(frozen=True)
class PluginCommand:
    """A command of a plugin.

    Attributes:
        entry: Its name, module and help.
        manifest: Of the plugin.
        location: Where the plugin is.
        disabled: Whether the user has disabled the plugin.
        rival: Another plugin that brings a command of this name, or None.
    """

    entry: CommandEntry
    manifest: Manifest
    location: Location
    disabled: bool = False
    rival: PluginCommand | None = None

    @property
    def help(self) -> str:
        """What it does, in a line."""
        return self.entry.help

    def load(self) -> ModuleType:
        """Its module, with `add_arguments(parser)` and `run(arguments, output)`.

        Raises:
            SettingError: The plugin is disabled.
            PluginError: Two plugins bring the command, or the module cannot be imported or lacks one of the functions.
        """
        name, plugin = self.entry.name, self.manifest.id
        if self.disabled:
            raise SettingError(
                f"the command {name} is brought by the plugin {plugin}, which is disabled",
                path=str(self.location.folder),
                remedy=f"Enable it: calmotion plugins enable {plugin}.",
            )
        if self.rival:
            raise PluginError(
                f"the plugins {self.manifest.id} and {self.rival.manifest.id} both bring the command {name}",
                path=str(self.location.folder),
                found=self.rival.location.folder,
                remedy=f"Disable one of the two: calmotion plugins disable {self.rival.manifest.id}.",
            )
        check_requirements(self.manifest, __version__)
        try:
            package = import_plugin(plugin, self.location).__name__
            module = importlib.import_module(f"{package}.{self.entry.module}")
        except (Exception, SystemExit) as error:
            if isinstance(error, PluginError):
                raise
            raise PluginError(
                f"the plugin {plugin}, which brings the command {name}, cannot be imported",
                path=str(self.location.folder),
                found="".join(traceback.format_exception_only(error)).strip(),
                remedy=f"See calmotion plugins check {self.location.folder}.",
            ) from error
        for function in ("add_arguments", "run"):
            if not callable(getattr(module, function, None)):
                raise PluginError(
                    f"the module of the command {name} has no function {function}",
                    path=str(self.location.folder),
                    attribute=f"{self.entry.module}.{function}",
                    remedy="Add add_arguments(parser) and run(arguments, output).",
                )
        return module


def plugin_commands() -> dict[str, PluginCommand]:
    """Name to command, of bundled plugins, installed ones and those in the folders of CALMOTION_PLUGINS.

    A plugin whose manifest cannot be read has none; where an enabled and a disabled plugin bring a command, it is that
    of the enabled one.

    Raises:
        SettingError: A named folder holds no plugin, or the file with the user's choices cannot be read.
    """
    disabled = disabled_plugins()
    found: dict[str, PluginCommand] = {}
    for location in discover():
        try:
            manifest = read_manifest(location.folder)
        except PluginError:
            continue
        for entry in manifest.commands:
            command = PluginCommand(entry, manifest, location, manifest.id in disabled)
            other = found.get(entry.name)
            if other is None or other.disabled:
                found[entry.name] = command
            elif not command.disabled:
                found[entry.name] = replace(other, rival=command)
    return found


def plugin_function(name: str) -> object | None:
    """What a plugin that brings a command of this name offers in Python under it; None where there is no such thing.

    Raises:
        PluginError: The plugin cannot be imported.
    """
    command = plugin_commands().get(name.replace("_", "-"))
    if command is None or command.disabled:
        return None
    return getattr(import_plugin(command.manifest.id, command.location), name, None)
