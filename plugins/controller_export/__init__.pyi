"""Public names of `calmotion_plugins.controller_export`: each is imported when it is first used."""

from collections.abc import Callable

from calmotion.host import Host

from .command_format import CommandFormat as CommandFormat
from .commands import BEZIER as BEZIER
from .commands import CUBIC as CUBIC
from .commands import FOLLOW as FOLLOW
from .commands import HOLD as HOLD
from .commands import LINEAR as LINEAR
from .commands import QUINTIC as QUINTIC
from .commands import Commands as Commands
from .commands import ExportRequest as ExportRequest
from .commands import Follower as Follower
from .commands import MotorCurves as MotorCurves
from .commands import WrittenCommands as WrittenCommands
from .commands import instants as instants
from .exporting import Export as Export
from .exporting import export as export
from .exporting import write_curves as write_curves
from .formats.bottango import BottangoCurves as BottangoCurves
from .formats.csv_table import CsvTable as CsvTable
from .formats.ros2 import Ros2Trajectory as Ros2Trajectory
from .formats.ticks import ServoTicks as ServoTicks
from .formats.ur_script import UrScript as UrScript
from .sampling import bezier_commands as bezier_commands
from .sampling import followed_commands as followed_commands
from .sampling import held_commands as held_commands
from .sampling import smooth_commands as smooth_commands

register: Callable[[Host], None]
unregister: Callable[[Host], None]
