"""Writes targets and motors of a run as a CSV table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import Host, Operator, RunContext
from calmotion.shot import Character, Result
from calmotion.shot.outputs import CsvFile
from calmotion.shot.run import OutputPaths


class WriteTable(Operator):
    """One row a time step, from the first frame of the shot on; a pre-roll is not written."""

    idname = "table.write"
    label = "Write the table"
    requires = (Character, Result, OutputPaths)
    provides = (CsvFile,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        return None if data[OutputPaths].csv else "no table was asked for"

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.shot.table import columns

        from .table import write_table

        path = context.get(OutputPaths).csv
        assert path is not None  # poll
        write_table(path, columns(context.get(Character), context.get(Result)))
        return (CsvFile(path),)


def register(host: Host) -> None:
    host.register_operator(WriteTable)


def unregister(host: Host) -> None:
    host.unregister_operator(WriteTable)
