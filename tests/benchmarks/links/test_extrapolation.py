"""Ever finer meshes of a link: what extrapolations claim to leave, and what they leave."""

from __future__ import annotations

import csv
import json

import numpy as np
from calmotion.benchmarks.links import extrapolation
from small_shots import write_arm


def test_extrapolations_leave_less_than_they_claim_on_a_beam(tmp_path, capsys):
    shot, file = write_arm(tmp_path / "arm.usda"), tmp_path / "rows.csv"
    assert extrapolation.main([f"{shot}:fore", "--nodes", "2500", "--csv", str(file), "--json"]) == 0
    with open(file, newline="") as text:
        rows = list(csv.DictReader(text))
    nodes = [int(row["nodes"]) for row in rows]
    assert nodes == sorted(nodes) and nodes[-2] < 2500 <= nodes[-1]
    first, *_, finest = rows
    assert float(first["taken"]) == 0.0 and first["claimed"] == first["estimate"]  # one mesh extrapolates nothing
    assert float(first["f1"]) > float(finest["f1"]) and np.isnan(float(finest["off"]))
    for k, row in enumerate(rows[1:-1]):
        # the first is compared with one coarser mesh alone, which has almost as many nodes
        assert 0.0 < float(row["taken"]) and float(row["off"]) < (1.2 if k else 1.8) * float(row["claimed"])
        assert float(row["off"]) < (0.5 if k else 0.7) * float(row["estimate"])
    told = json.loads(capsys.readouterr().out)["rows"]
    assert [row["nodes"] for row in told] == nodes and told[-1]["off"] is None


def test_the_line_below_the_table_counts_what_was_extrapolated(capsys):
    rows = [
        extrapolation.LevelRow("fore", nodes, 10.0, 20.0, 30.0, 5.0, taken, claimed, off)
        for nodes, taken, claimed, off in ((500, 0.0, 5.0, 9.0), (900, 2.0, 1.0, 0.5), (1500, 1.0, 0.5, np.nan))
    ]
    assert "of 1 meshes: at most 0.50 for 50%" in extrapolation.honesty(rows)
    assert extrapolation.honesty(rows[:1]) == "no mesh has been extrapolated"
    assert extrapolation.cells(rows)[-1] == ["fore", "1500", "10, 20, 30", "5.00", "1.00", "0.50", "-"]
    assert extrapolation.main(["missing.usda"]) == 1
    assert "missing.usda" in capsys.readouterr().err
