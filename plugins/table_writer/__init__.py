"""Tables of a result: targets and motors at each time step, and motor curves for a controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.shot import Animation, Character, Provenance, Result
from calmotion.shot.outputs import CsvFile
from calmotion.shot.run import OutputPaths


@dataclass(frozen=True)
class ControllerCurves:
    """Path of the table of curves, and its number of rows."""

    path: str
    rows: int


class WriteTable(Operator):
    """One row for each time step, from the first frame of the shot on; a pre-roll is not written."""

    idname = "table.write"
    label = "Write the table"
    requires = (Character, Result, OutputPaths)
    provides = (CsvFile,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """Skipped where no table is requested."""
        return None if data[OutputPaths].csv else NotAsked("no table is requested (--csv)")

    def execute(self, context: RunContext) -> Sequence[object]:
        """Write the table; its path."""
        from calmotion.shot.table import columns

        from .table import write_table

        path = context.get(OutputPaths).csv
        assert path is not None  # poll
        write_table(path, columns(context.get(Character), context.get(Result)))
        return (CsvFile(path),)


class ExportCurves(Operator):
    """One row for each instant, one column for each motor; the header has rate, units and limits.

    Run it with `--run curves.export --set curves.export.file=FILE`.
    """

    idname = "curves.export"
    label = "Export the motor curves"
    requires = (Character, Animation, Provenance, Result)
    provides = (ControllerCurves,)
    checks = (Character,)
    properties = (
        Property("file", str, "", description="File to write"),
        Property("rate", float, 500.0, unit="Hz", minimum=1.0, maximum=1e5, description="Rows per second"),
        Property("angles", str, "rad", choices=("rad", "deg"), description="Unit of angles; lengths are in m"),
    )

    def check(self, context: RunContext) -> None:
        """A file that is named and can be written, and motors."""
        from .curves import refuse_unwritable

        refuse_unwritable(context.properties.file, context.get(Character))

    def execute(self, context: RunContext) -> Sequence[object]:
        """Write the curves; their path."""
        from .curves import write_curves

        values = context.properties
        rows = write_curves(
            values.file,
            context.get(Character),
            context.get(Animation),
            context.get(Provenance),
            context.get(Result),
            rate=values.rate,
            degrees=values.angles == "deg",
        )
        context.report("info", f"{values.file}: {rows} rows for a controller at {values.rate:g} Hz")
        return (ControllerCurves(values.file, rows),)


register, unregister = registration(WriteTable, ExportCurves)
