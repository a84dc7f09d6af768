"""Tables of measurements in files."""

from dataclasses import dataclass

import pytest
from calmotion.errors import ShotError
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


def test_a_table_with_other_columns_or_values_is_refused(tmp_path):
    table = tmp_path / "rows.csv"
    table.write_text("name,count\na,1\n")
    with pytest.raises(ShotError, match="columns"):
        read_rows(str(table), Row)
    write_rows(str(table), Row, ROWS)
    table.write_text(table.read_text().replace("True", "yes", 1))
    with pytest.raises(ShotError, match="line 2") as refused:
        read_rows(str(table), Row)
    assert refused.value.attribute == "kept"
