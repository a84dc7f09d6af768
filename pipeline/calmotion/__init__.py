"""Calmotion: vibration-minimising motion retargeting for robotic characters.

    import calmotion as cm

    shot = cm.open_shot("bartender.usda")
    result = cm.optimize(shot, tolerance="1mm")
    result.write("calm.usda")

Each name is imported when it is first used. A command of a plugin that is also a function has its name here:
`cm.calibrate` is that of `calmotion calibrate`.
"""

from calmotion.public_names import public_names
from calmotion.version import __version__ as __version__

_public, __dir__ = public_names(__name__)


def __getattr__(name: str) -> object:
    try:
        return _public(name)
    except AttributeError:
        if name.startswith("_"):
            raise
        from calmotion.host.discovery import plugin_function

        found = plugin_function(name)
        if found is None:
            raise
        return found
