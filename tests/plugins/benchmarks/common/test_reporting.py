"""Rows of measurements: kept in files and read again, and shown with the units that their names tell."""

import json
from argparse import Namespace
from dataclasses import dataclass

import pytest
from calmotion.errors import ShotError
from calmotion_plugins.benchmarks.common.reporting import finish, keep, kept_rows, numbered


@dataclass(frozen=True)
class Row:
    """A row of a table."""

    number: int
    name: str
    error_mm: float
    kept: bool


ROWS = [Row(0, "a", 0.5, True), Row(2, "b", float("nan"), False)]


@pytest.fixture
def options(tmp_path):
    return Namespace(csv=str(tmp_path / "rows.csv"), markdown=str(tmp_path / "rows.md"), json=False, resume=True)


def test_rows_are_kept_and_what_is_missing_is_measured(options):
    assert kept_rows(options, Row) == []
    keep(options, Row, ROWS)
    options.first, options.count = 0, 3

    def measure(number):
        if number == 1:
            raise ShotError("is too long")
        return [Row(number, "new", 1.0, True)]

    assert [row.number for row in numbered(options, Row, "number", measure)] == [0, 2]
    options.first = 3
    assert [row.name for row in numbered(options, Row, "number", measure)] == ["a", "b", "new", "new", "new"]
    assert [row.kept for row in kept_rows(options, Row)] == [True, False, True, True, True]


def test_a_table_of_something_else_is_refused(options):
    with open(options.csv, "w") as file:
        file.write("number,name\n1,a\n")
    with pytest.raises(ShotError, match="not a table of this benchmark"):
        kept_rows(options, Row)


def test_a_table_has_units_and_the_object_all_rows(options, capsys):
    finish(options, "Errors", ROWS, lines=["one line"])
    printed = capsys.readouterr().out
    assert "0.5 mm" in printed and "error mm" not in printed and "one line" in printed
    with open(options.markdown) as file:
        assert file.read().startswith("| number | name | error | kept |\n| --- |")
    options.json = True
    finish(options, "Errors", ROWS[:1], more=3)
    assert json.loads(capsys.readouterr().out) == {"rows": [vars(ROWS[0])], "more": 3}
