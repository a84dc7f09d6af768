"""Motor curves for a controller: run with `--run curves.export --set curves.export.file=FILE`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from calmotion.host import Operator, Property, RunContext
from calmotion.shot import Animation, Character, Provenance, Result


@dataclass(frozen=True)
class ControllerCurves:
    """Path of the table, and how many rows it has."""

    path: str
    rows: int


class ExportCurves(Operator):
    """One row for each instant, one column for each motor; the header tells rate, units and limits."""

    idname = "curves.export"
    label = "Export the motor curves"
    requires = (Character, Animation, Provenance, Result)
    provides = (ControllerCurves,)
    properties = (
        Property("file", str, "", description="File to write"),
        Property("rate", float, 500.0, unit="Hz", minimum=1.0, maximum=1e5, description="Rows a second"),
        Property("angles", str, "rad", choices=("rad", "deg"), description="Unit of angles; lengths are in m"),
    )

    def execute(self, context: RunContext) -> Sequence[object]:
        """Write the table; its path."""
        from .table import write_table

        values = context.properties
        rows = write_table(
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


def register(host: Any) -> None:
    """Register the operator."""
    host.register_operator(ExportCurves)


def unregister(host: Any) -> None:
    """Undo `register`."""
    host.unregister_operator(ExportCurves)
