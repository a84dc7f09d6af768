"""Motor curves for controllers and programs of animation: `calmotion export`, and `export` in Python.

Plugins with formats of their own take `CommandFormat` and what it works with from here.
"""

from calmotion.host import registration
from calmotion.public_names import public_names

from .animation import BvhFile, GltfFile, Keyframes
from .controllers import BottangoCurves, CsvTable, Ros2Bag, Ros2Trajectory, ServoTicks, UrScript

register, unregister = registration(
    Ros2Trajectory, Ros2Bag, CsvTable, ServoTicks, UrScript, BottangoCurves, Keyframes, BvhFile, GltfFile
)

__getattr__, __dir__ = public_names(__name__)
