"""Shots from robots in URDF, MJCF or USD: the command `calmotion import`, and `import_robot` in Python."""

from calmotion.host import registration
from calmotion.public_names import public_names

register, unregister = registration()

__getattr__, __dir__ = public_names(__name__)
