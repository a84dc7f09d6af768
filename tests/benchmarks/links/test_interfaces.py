"""Ever finer meshes of a shot's bodies: what extrapolations of their interfaces' stiffness claim and leave."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from calmotion.benchmarks.links import interfaces


def test_interfaces_of_a_shot_are_off_by_less_than_is_claimed_on_meshes_of_three_levels(tmp_path, capsys):
    file = tmp_path / "rows.csv"
    assert interfaces.main(["0", "--nodes", "6000", "--csv", str(file), "--json"]) == 0
    with open(file, newline="") as text:
        rows = list(csv.DictReader(text))
    for body in {row["body"] for row in rows}:
        own = [row for row in rows if row["body"] == body]
        nodes = [int(row["nodes"]) for row in own]
        assert nodes == sorted(nodes) and nodes[-2] < 6000 <= nodes[-1]
        assert float(own[0]["taken"]) == 0.0
        assert float(own[0]["claimed"]) == pytest.approx(float(own[0]["estimate"]), rel=1e-6)
        assert np.isnan(float(own[-1]["off"]))
        for row in own[2:-1]:
            assert 0.0 < float(row["off"]) < 1.5 * float(row["claimed"]) < 1.5 * float(row["estimate"])
    assert len(json.loads(capsys.readouterr().out)["rows"]) == len(rows)


def test_a_file_that_is_missing_is_told(capsys):
    assert interfaces.main(["missing.usda"]) == 1
    assert "missing.usda" in capsys.readouterr().err
