"""The user's caches, which there are and their folder, and the folder of the user's choices."""

import os
import sys
from collections.abc import Mapping
from pathlib import Path

KERNELS, MESHES, REDUCTIONS = "kernels", "meshes", "reductions"
# Folder of each cache, its content, and its largest size [bytes].
CACHES = {
    KERNELS: ("compiled kernels", 500 * 10**6),
    MESHES: ("tetrahedral meshes", 10**9),
    REDUCTIONS: ("reduced bodies", 2 * 10**9),
}

CONFIGURATION_VARIABLE = "CALMOTION_CONFIG"


def cache_folder() -> Path:
    """The user's cache folder of calmotion: `$CALMOTION_CACHE`, else `calmotion` in the system's cache folder."""
    chosen = os.environ.get("CALMOTION_CACHE")
    if chosen:
        return Path(chosen)
    base = _absolute(os.environ, "XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or Path.home() / ".cache"
    return Path(base) / "calmotion"


def configuration_folder(environment: Mapping[str, str] | None = None) -> Path:
    """The folder of the user's choices: the one that the environment names, else where the system keeps such things."""
    variables = os.environ if environment is None else environment
    if variables.get(CONFIGURATION_VARIABLE):
        return Path(variables[CONFIGURATION_VARIABLE]).expanduser()
    if sys.platform == "win32" and variables.get("APPDATA"):
        return Path(variables["APPDATA"]) / "calmotion"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "calmotion"
    return Path(_absolute(variables, "XDG_CONFIG_HOME") or Path.home() / ".config") / "calmotion"


def _absolute(variables: Mapping[str, str], name: str) -> str:
    """A folder that the environment names; relative ones do not count, as the XDG base directories have it: they would
    be another in each working folder."""
    value = variables.get(name, "")
    return value if os.path.isabs(value) else ""
