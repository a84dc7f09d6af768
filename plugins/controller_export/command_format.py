"""Formats of commands for motor controllers: operators that write them and read them back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from calmotion.errors import ShotError
from calmotion.host import NotAsked, Operator, PropertyValues, RunContext

from .commands import HIGHEST_RATE, Commands, ExportRequest, MotorCurves, WrittenCommands


class CommandFormat(Operator):
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
        commands = self.sampled(curves, request.rate, properties)
        try:
            files = self.write(request.file, commands, curves, request.rate, properties)
        except OSError as error:
            raise ShotError(
                "the commands cannot be written", path=request.file, found=error.strerror, remedy="Choose another file"
            ) from error
        return (WrittenCommands(files, commands, self.read(files, curves, properties), self.notes(commands, curves)),)

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Commands for curves at a rate [Hz], not rounded."""
        raise NotImplementedError

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write commands; the paths of all files, `file` first.

        Raises:
            OSError: A file cannot be written.
            ShotError: The format cannot express them.
        """
        raise NotImplementedError

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read commands back from the files, in the order of the motors of the curves."""
        raise NotImplementedError

    def notes(self, commands: Commands, curves: MotorCurves) -> tuple[str, ...]:
        """What the user of the files must know, as sentences."""
        return ()
