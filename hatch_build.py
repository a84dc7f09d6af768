"""Puts the bundled plugins and the USD schemas into the wheel as package data."""

from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

BUNDLED = {"plugins": "calmotion/bundled/plugins", "usd_schemas": "calmotion/bundled/usd_schemas"}


class BundledFiles(BuildHookInterface):
    """An editable install needs no copy: the package finds both folders in the checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version != "editable":
            build_data["force_include"].update(BUNDLED)
