"""Which plugins the user has disabled, kept in a file of the user's configuration folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from calmotion.host.errors import SettingError
from calmotion.support.caching.cache_folder import CONFIGURATION_VARIABLE, configuration_folder
from calmotion.support.files import write_text
from calmotion.support.operating_system import locked
from calmotion.support.reading import read_toml

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
