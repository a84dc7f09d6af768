"""Public names of `calmotion_plugins.robot_import`: each is imported when it is first used."""

from collections.abc import Callable

from calmotion.host import Host

from .robot import ImportedRobot as ImportedRobot
from .robot import import_robot as import_robot

register: Callable[[Host], None]
unregister: Callable[[Host], None]
