"""Calmotion: vibration-minimising motion retargeting for robotic characters.

    import calmotion as cm

    shot = cm.open_shot("bartender.usda")
    result = cm.optimize(shot, tolerance="1mm")
    result.write("calm.usda")

Each name is imported when it is first used.
"""

from calmotion.public_names import public_names
from calmotion.version import __version__ as __version__

__getattr__, __dir__ = public_names(__name__)
