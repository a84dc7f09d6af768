"""Which plugins the user has disabled, kept in a file of the user's configuration folder."""

from __future__ import annotations

import os
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path

from calmotion.host.errors import SettingError
from calmotion.support.files import write_text

FOLDER_VARIABLE = "CALMOTION_CONFIG"
FILE_NAME = "plugins.toml"


def configuration_folder(environment: Mapping[str, str] | None = None) -> Path:
    """The folder of the user's choices: the one that the environment names, else where the system keeps such things."""
    variables = os.environ if environment is None else environment
    if variables.get(FOLDER_VARIABLE):
        return Path(variables[FOLDER_VARIABLE]).expanduser()
    if sys.platform == "win32" and variables.get("APPDATA"):
        return Path(variables["APPDATA"]) / "calmotion"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "calmotion"
    return Path(variables.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "calmotion"


def disabled_plugins(environment: Mapping[str, str] | None = None) -> frozenset[str]:
    """Ids of the plugins that the user has disabled.

    Raises:
        SettingError: The file cannot be read, or is not what `disable` writes.
    """
    file = configuration_folder(environment) / FILE_NAME
    try:
        ids = tomllib.loads(file.read_text(encoding="utf-8")).get("disabled", [])
    except (FileNotFoundError, NotADirectoryError):
        return frozenset()
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
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
    kept = disabled_plugins(environment)
    kept = kept - {plugin_id} if enabled else kept | {plugin_id}
    file = configuration_folder(environment) / FILE_NAME
    names = ", ".join(f'"{name}"' for name in sorted(kept))
    head = "# Plugins that are not loaded; `calmotion plugins enable ID` removes one from the list.\n"
    try:
        write_text(file, f"{head}disabled = [{names}]\n")
    except OSError as error:
        raise SettingError(
            "the list of disabled plugins cannot be saved",
            path=str(file),
            found=error.strerror,
            remedy=f"Make the folder writable, or name another one with {FOLDER_VARIABLE}.",
        ) from error
    return file
