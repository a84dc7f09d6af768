"""The materials of a user: those that are shipped, those of the configuration folder, and those of given files."""

from __future__ import annotations

from collections.abc import Iterable

from calmotion.rigging.materials import Material, materials
from calmotion.support.caching.cache_folder import configuration_folder
from calmotion.workflow.shot import Path

FILE_NAME = "materials.toml"


def known_materials(files: Iterable[Path] = ()) -> dict[str, Material]:
    """The materials by name; later ones replace earlier ones of the same name.

    Args:
        files: TOML files with a table for each material.

    Raises:
        ShotError: A file cannot be read, or a material in it is not complete.
    """
    own = configuration_folder() / FILE_NAME
    return materials([*([own] if own.is_file() else []), *map(str, files)])
