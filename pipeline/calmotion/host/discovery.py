"""Discovery and import of plugins. Files beside a shot are never read or imported."""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from calmotion.host.errors import PluginError, SettingError
from calmotion.host.manifest import FILE_NAME

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


def bundled_folder() -> Path | None:
    """The folder of the bundled plugins: inside the installed package, else the checkout's `plugins/`."""
    package = Path(__file__).resolve().parents[1]
    installed = package / "bundled" / "plugins"
    if installed.is_dir():
        return installed
    repository = package.parents[1]
    if package.parent.name == "pipeline" and (repository / "pyproject.toml").is_file():
        return repository / "plugins"
    return None


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
    bundled = bundled_folder()
    locations = find_in_folder(bundled, "bundled") if bundled and bundled.is_dir() else []
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

    The name in `sys.modules` holds a checksum of the folder, so two folders of the same name never mix.

    Raises:
        PluginError: When the module or its `register`/`unregister` is missing.
        Exception: Whatever the module raises; nothing of it stays imported then.
    """
    if location.module:
        module = importlib.import_module(location.module)
    else:
        name = f"calmotion_plugin_{plugin_id}_{zlib.crc32(str(location.folder).encode()):08x}"
        module = sys.modules.get(name) or _import_folder(name, location)
    for function in ("register", "unregister"):
        if not callable(getattr(module, function, None)):
            raise PluginError(
                f"the module has no function {function}", path=str(location.folder), remedy=f"Add {function}(host)."
            )
    return module


def _import_folder(name: str, location: Location) -> ModuleType:
    file = location.folder / "__init__.py"
    if not file.is_file():
        raise PluginError("the plugin has no module", path=str(location.folder), remedy="Add __init__.py.")
    spec = importlib.util.spec_from_file_location(name, file, submodule_search_locations=[str(location.folder)])
    assert spec and spec.loader  # a file that ends in .py always has both
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        for imported in [key for key in sys.modules if key == name or key.startswith(name + ".")]:
            del sys.modules[imported]
        raise
    return module
