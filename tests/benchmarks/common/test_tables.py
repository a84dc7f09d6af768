"""Tables of measurements in files."""

from dataclasses import dataclass

from calmotion.benchmarks.common.tables import read_rows, write_table


@dataclass(frozen=True)
class Row:
    """A row of a table."""

    name: str
    count: int
    kept: bool


ROWS = [Row("a", 1, True), Row("b", 2, False)]


def test_the_suffix_says_whether_rows_can_be_read_again(tmp_path):
    for name in ("rows.csv", "ROWS.CSV"):
        write_table(str(tmp_path / name), Row, ROWS, lambda rows: "not used")
        assert read_rows(str(tmp_path / name), Row) == ROWS
    write_table(str(tmp_path / "rows.md"), Row, ROWS, lambda rows: " ".join(row.name for row in rows))
    assert (tmp_path / "rows.md").read_text() == "a b"
