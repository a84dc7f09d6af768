"""Importing a plugin's module from its folder."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import zlib
from types import ModuleType

from calmotion.host.discovery import Location
from calmotion.host.errors import PluginError


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
