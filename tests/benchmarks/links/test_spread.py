"""Frequencies of links on meshes that follow their surfaces less and more closely."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from calmotion.benchmarks.links import spread
from small_shots import LENGTH, WIDTH, write_arm


def test_a_bar_has_the_same_frequencies_within_other_envelopes(tmp_path, capsys):
    shot, file = write_arm(tmp_path / "arm.usda"), tmp_path / "rows.csv"
    command = [f"{shot}:fore", "--factors", "1.5", "--csv", str(file), "--markdown", str(tmp_path / "table.md")]
    assert spread.main([*command, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["rows"]
    assert [(row["link"], row["factor"], row["source"]) for row in told] == [
        ("fore", 1.0, "visual surface"), ("fore", 1.5, "visual surface")
    ]  # fmt: skip
    beam = 3.516 / (2.0 * np.pi) * np.sqrt(1.8e9 * WIDTH**2 / 12.0 / 1200.0) / LENGTH**2
    assert [row["f1"] for row in told] == pytest.approx([beam, beam], rel=0.03)
    with open(file, newline="") as text:
        assert [float(row["f1"]) for row in csv.DictReader(text)] == [row["f1"] for row in told]
    assert "Of 1 links the first frequency changes by no more than 2% in 1 " in (tmp_path / "table.md").read_text()
    # nothing is meshed again
    assert spread.main([*command, "--resume"]) == 0
    assert "envelope" not in capsys.readouterr().err


def test_a_table_has_the_difference_of_each_envelope_and_why_there_is_no_mesh():
    def row(factor, f1, f2, f3, link="arm", nodes=100, note=""):
        return spread.SpreadRow(
            "robot", link, "visual surface", nodes=nodes, f1=f1, f2=f2, f3=f3, estimate=0.7, note=note, factor=factor
        )

    missing = row(0.5, np.nan, np.nan, np.nan, nodes=0, note="takes too long")
    rows = [row(1.5, 101.0, 196.2, 300.0), row(1.0, 100.0, 200.0, 300.0), missing, row(1.0, 5.0, 6.0, 7.0, "lone")]
    assert spread.differences(rows[:3]) == pytest.approx(np.array([[1.0, -1.9, 0.0]]))
    assert spread.differences(rows[:1]).shape == spread.differences(rows[3:]).shape == (0, 3)
    lines = spread.table(rows).splitlines()
    assert lines[2] == (
        "| robot | arm | 100, 200, 300 | 0.70 | 1.5: +1.00, -1.90, +0.00; 0.5: takes too long | 1.00 | 1.90 |"
    )
    assert lines[3] == "| robot | lone | 5, 6, 7 | 0.70 |  | - | - |"
    assert lines[-1] == (
        "Of 1 links the first frequency changes by no more than 2% in 1 (1% in the median), all three in 1 (1.9% in "
        "the median)."
    )


def test_links_that_cannot_be_read_or_meshed_end_with_an_error(tmp_path, capsys):
    assert spread.main([str(tmp_path / "missing.usda")]) == 1
    assert "missing.usda" in capsys.readouterr().err


def test_factors_are_positive(capsys):
    with pytest.raises(SystemExit):
        spread.main(["arm.usda", "--factors", "0.5", "0"])
    assert "positive" in capsys.readouterr().err
