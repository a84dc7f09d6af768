"""The beginning of a plugin: a folder that can be installed, with an operator, a manifest and a test that passes."""

import re
import shutil
from pathlib import Path

from calmotion.host.errors import PluginError
from calmotion.version import __version__

_TEXTS = Path(__file__).with_name("plugin_template")
_FILES = {
    "pyproject.toml": "pyproject.txt",
    "README.md": "readme.txt",
    "{name}/plugin.toml": "manifest.txt",
    "{name}/__init__.py": "module.txt",
    "tests/test_{name}.py": "test.txt",
}


def write_template(name: str, parent: Path) -> Path:
    """Write a new plugin into a new folder of its name; returns that folder.

    Raises:
        PluginError: The name is none for a plugin, or the folder is there already, or cannot be made.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise PluginError("is not a valid name for a plugin", path=name, remedy="Use a-z, 0-9 and _, a letter first.")
    folder = parent / name
    values = {
        "name": name,
        "title": name.replace("_", " ").capitalize(),
        "distribution": f"calmotion-{name.replace('_', '-')}",
        "calmotion": ".".join(__version__.split(".")[:2]),
    }
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise PluginError("the folder exists already", path=str(folder), remedy="Choose another name.") from None
    except OSError as error:
        raise PluginError("the folder cannot be made", path=str(folder), found=error.strerror) from error
    try:
        for file, text in _FILES.items():
            path = folder / file.format(**values)
            path.parent.mkdir(exist_ok=True)
            path.write_text((_TEXTS / text).read_text(encoding="utf-8").format(**values), encoding="utf-8")
    except OSError as error:
        shutil.rmtree(folder, ignore_errors=True)  # a half-made plugin would be found, and be in the way of the next
        raise PluginError("the folder cannot be made", path=str(folder), found=error.strerror) from error
    return folder
