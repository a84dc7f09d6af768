"""Shots from robots in URDF, MJCF or USD: the command `calmotion import`, and `import_robot` in Python."""

from typing import TYPE_CHECKING, Any

from calmotion.host import registration

if TYPE_CHECKING:
    from .robot import ImportedRobot, import_robot

__all__ = ["ImportedRobot", "import_robot", "register", "unregister"]

register, unregister = registration()


def __getattr__(name: str) -> Any:
    from calmotion.public_names import imported

    return imported(__name__, {".robot": ("ImportedRobot", "import_robot")}, name)
