"""The commands: those of the engine, and those that plugins bring. Each is imported when it is called.

The module of a command has `add_arguments(parser)` and `run(arguments, output)`, and may have `EXAMPLES`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from calmotion.host.discovery import PluginCommand

Command: TypeAlias = "BuiltIn | Absent | PluginCommand"


@dataclass(frozen=True)
class BuiltIn:
    """A command of the engine.

    Attributes:
        module: Its module in `calmotion.cli.commands`.
        help: What it does, in a line.
    """

    module: str
    help: str
    disabled: bool = False

    def load(self) -> ModuleType:
        """Its module."""
        return import_module(f"calmotion.cli.commands.{self.module}")


BUILT_IN = {
    "inspect": BuiltIn("inspect", "show the content of the shot and the model simplifications"),
    "simulate": BuiltIn("simulate", "simulate the shot as animated"),
    "watch": BuiltIn("watch", "simulate or optimise a shot again whenever it is saved"),
    "optimize": BuiltIn("optimize", "change the motor curves so that the robot does not shake"),
    "rig": BuiltIn("rig", "make a robot from a skinned character, or from parts that are animated one by one"),
    "motors": BuiltIn("motors", "list real motors that a joint can name, with their sources"),
    "materials": BuiltIn("materials", "list materials for flexible links, with their sources"),
    "plugins": BuiltIn("plugins", "list, check, disable and create plugins"),
    "demo": BuiltIn("demo", "optimise a sample, and show the result"),
    "warmup": BuiltIn("warmup", "compile the kernels ahead of the first shot"),
    "cache": BuiltIn("cache", "show, clear or prune the caches of kernels, meshes and links"),
    "doctor": BuiltIn("doctor", "check the installation and the machine, and say what to do"),
}
# The bundled plugins that bring commands: whoever deletes one is told where its command went.
BROUGHT_BY: dict[str, str] = {
    "export": "controller_export",
    "batch": "shows",
    "sequence": "shows",
    "submit": "shows",
    "bench": "benchmarks",
    "import": "robot_import",
    "calibrate": "calibration",
    "live": "live",
    "diagnose": "diagnosis",
    "excite": "calibration",
    "refine": "calibration",
}


@dataclass(frozen=True)
class Absent:
    """A command of a bundled plugin that was deleted.

    Attributes:
        name: Of the command.
        plugin: Its plugin.
    """

    name: str
    plugin: str
    help: str = ""
    disabled: bool = True

    def load(self) -> ModuleType:
        """Nothing.

        Raises:
            SettingError: Always.
        """
        from calmotion.host.discovery import bundled_folder
        from calmotion.host.errors import SettingError

        raise SettingError(
            f"the command {self.name} is brought by the plugin {self.plugin}, which is not there",
            path=str(bundled_folder() / self.plugin),
            remedy="Put its folder back, or install Calmotion again.",
        )


def all_commands() -> Mapping[str, Command]:
    """Name to command, in the order in which they are listed; one of a plugin never takes the place of a built-in one.

    Raises:
        SettingError: A folder of CALMOTION_PLUGINS holds no plugin, or the file with the user's choices cannot be read.
    """
    from calmotion.host.discovery import plugin_commands

    absent = {name: Absent(name, plugin) for name, plugin in BROUGHT_BY.items()}
    return {**BUILT_IN, **absent, **plugin_commands(), **BUILT_IN}
