"""Motor curves for controllers: `calmotion export`, and `export` in Python.

Plugins with formats of their own take `CommandFormat` and what it works with from here.
"""

from calmotion.host import registration
from calmotion.public_names import public_names

from .formats.bottango import BottangoCurves
from .formats.csv_table import CsvTable
from .formats.ros2 import Ros2Trajectory
from .formats.ticks import ServoTicks
from .formats.ur_script import UrScript

register, unregister = registration(Ros2Trajectory, CsvTable, ServoTicks, UrScript, BottangoCurves)

__getattr__, __dir__ = public_names(__name__)
