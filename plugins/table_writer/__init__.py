"""Tables of a result: targets and motors at each time step."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import NotAsked, Operator, RunContext, registration
from calmotion.model import Character, CsvFile, OutputPaths, Result


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
        from calmotion.model import columns

        from .table import write_table

        path = context.get(OutputPaths).csv
        assert path is not None  # poll
        write_table(path, columns(context.get(Character), context.get(Result)))
        return (CsvFile(path),)


register, unregister = registration(WriteTable)
