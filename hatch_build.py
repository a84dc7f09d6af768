"""Puts the bundled plugins, the USD schemas and the shot of the demo into the wheel as package data.

With `CALMOTION_WHEEL_KERNELS=FOLDER` (`make wheel`) the compiled kernels of that folder as well; the wheel is then for
one platform and version of Python.
"""

import os
import platform
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

TARGET = "calmotion/bundled"
# The kernels are data that numba loads, linked to no library of the system: the wheel runs where numba's own runs.
LINUX = "manylinux_2_28_x86_64"


class BundledFiles(BuildHookInterface):
    """An editable install needs no copy: the package finds both folders in the checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        demo = "samples/bartender/bartender.usda"  # what `calmotion demo` optimises
        included = {"usd_schemas": f"{TARGET}/usd_schemas", demo: f"{TARGET}/samples/bartender.usda"}
        # plugins/blender is an extension of Blender, not of ours, and under another licence
        for manifest in sorted(Path(self.root, "plugins").glob("*/plugin.toml")):
            name = manifest.parent.name
            included[f"plugins/{name}"] = f"calmotion_plugins/{name}"
        if kernels := os.environ.get("CALMOTION_WHEEL_KERNELS"):
            included[kernels] = f"{TARGET}/kernels"
            build_data["pure_python"] = False
            if sys.platform == "linux" and platform.machine() == "x86_64":
                python = f"cp{sys.version_info.major}{sys.version_info.minor}"
                build_data["tag"] = f"{python}-{python}-{LINUX}"
            else:
                build_data["infer_tag"] = True
        build_data["force_include"].update(included)
