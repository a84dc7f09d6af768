"""Formats of commands for motor controllers: operators that write them and read them back."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from calmotion.errors import file_access
from calmotion.host import NotAsked, Operator, PluginError, PropertyValues, RunContext

from .commands import HIGHEST_RATE, Commands, ExportRequest, MotorCurves, WrittenCommands


class CommandFormat(Operator, ABC):
    """Base of the formats of `calmotion export`: samples curves, writes commands, and reads them back.

    What is read back is simulated as its player plays it, so that `read` shall parse the files, and not return what
    `write` was given.

    Attributes:
        format: Name for `--to`.
        suffix: Of its files, with the dot.
        highest_rate: Commands a second that its player takes at most [Hz].
    """

    format: ClassVar[str] = ""
    suffix: ClassVar[str] = ""
    highest_rate: ClassVar[float] = HIGHEST_RATE
    named = ("format", "suffix")
    requires = (MotorCurves, ExportRequest)
    provides = (WrittenCommands,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """Only for its own format."""
        request = data.get(ExportRequest)
        return NotAsked("this format is not requested") if request is None or request.format != cls.format else None

    def execute(self, context: RunContext) -> Sequence[object]:
        """Sample, write and read back."""
        curves, request, properties = context.get(MotorCurves), context.get(ExportRequest), context.properties
        commands = self._checked("sampled", self.sampled(curves, request.rate, properties), curves)
        with file_access("the commands cannot be written", request.file, "Choose another file"):
            files = self.write(request.file, commands, curves, request.rate, properties)
        if not isinstance(files, tuple) or not all(isinstance(file, str) for file in files):
            raise self._fault("write", "returns no tuple of paths", files)
        read = self._checked("read", self.read(files, curves, properties), curves)
        return (WrittenCommands(files, commands, read, self.notes(commands, curves)),)

    def _checked(self, method: str, commands: Commands, curves: MotorCurves) -> Commands:
        fault = commands.fault(len(curves.motors)) if isinstance(commands, Commands) else "they are no Commands"
        if fault:
            raise self._fault(method, "returns commands that no player can play", fault)
        return commands

    def _fault(self, method: str, problem: str, found: object) -> PluginError:
        return PluginError(
            f"{method} of the format {self.format} {problem}", path=f"operator {self.idname}", found=found,
            remedy="See the docstrings of calmotion_plugins.controller_export.CommandFormat and Commands.",
        )  # fmt: skip

    @abstractmethod
    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Commands for curves at a rate [Hz], not rounded."""

    @abstractmethod
    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write commands; the paths of all files, `file` first.

        Raises:
            OSError: A file cannot be written.
            ShotError: The format cannot express them.
        """

    @abstractmethod
    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read commands back from the files, in the order of the motors of the curves."""

    def notes(self, commands: Commands, curves: MotorCurves) -> tuple[str, ...]:
        """What the user of the files must know, as sentences."""
        return ()
