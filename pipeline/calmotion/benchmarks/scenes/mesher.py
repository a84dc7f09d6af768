"""The bundled mesher, as the host loads it."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def mesher() -> Any:
    """The module of the bundled mesher that makes meshes."""
    from calmotion.host import open_host

    operator = open_host().operators["fe.mesh"]
    return import_module(operator.__module__.rsplit(".", 1)[0] + ".body_mesh")
