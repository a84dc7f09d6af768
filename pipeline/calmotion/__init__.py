"""Calmotion: vibration-minimising motion retargeting for robotic characters."""

from calmotion.errors import ShotError

__version__ = "0.1.0"
__all__ = ["ShotError", "__version__"]
