"""Tables of measurements in files."""

from dataclasses import dataclass

from calmotion_plugins.benchmarks.common.tables import read_rows, write_rows


@dataclass(frozen=True)
class Row:
    """A row of a table."""

    name: str
    count: int
    kept: bool


ROWS = [Row("a", 1, True), Row("b", 2, False)]


def test_rows_are_read_again(tmp_path):
    write_rows(str(tmp_path / "rows.csv"), Row, ROWS)
    assert read_rows(str(tmp_path / "rows.csv"), Row) == ROWS
    assert read_rows(str(tmp_path / "none.csv"), Row) == []
