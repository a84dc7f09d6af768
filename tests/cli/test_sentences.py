"""Sentences are wrapped between words."""

import io

import pytest
from calmotion.cli.sentences import unbroken, width_of, wrapped

PATH = "/Robot/" + "link/" * 20 + "tip"


def test_a_path_is_never_broken():
    lines = wrapped(f"note: {PATH} and 3 others: a long-drawn remark about these prims", 40).split("\n")
    assert f"  {PATH}" in lines and all(len(line) <= 40 or line == f"  {PATH}" for line in lines)


@pytest.mark.parametrize("unit", ["mm", "Hz", "N m", "kg", "ms", "cm^3"])
@pytest.mark.parametrize("width", range(20, 40))
def test_a_number_keeps_its_unit(unit, width):
    lines = wrapped(f"the error of the simulation is 12.5 {unit} at its largest", width).split("\n")
    assert any(f"12.5 {unit}" in line for line in lines)


def test_indents_stay_and_lines_are_kept():
    text = "short\n    indented words that go on"
    assert wrapped(text, 20, "..") == "short\n    indented words\n    ..that go on"
    assert wrapped(text, None) == text


def test_a_file_has_no_width_unless_columns_says_so(monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert width_of(io.StringIO()) is None
    monkeypatch.setenv("COLUMNS", "80")
    assert width_of(io.StringIO()) == 80
    closed = io.StringIO()
    closed.close()
    assert width_of(closed) is None


def test_the_name_of_a_file_with_spaces_stays_on_a_line():
    assert wrapped(f"wrote {unbroken('/a b/c d.usda')}", 20) == "wrote /a b/c d.usda"
    assert wrapped(f"the layer: {unbroken('/a b/c d.usda')}", 20) == "the layer:\n  /a b/c d.usda"
