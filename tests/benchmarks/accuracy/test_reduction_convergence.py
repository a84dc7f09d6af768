"""Reductions that get finer move an arm's end by less and less, and the command writes what was measured."""

import csv
import json

import pytest
from calmotion.benchmarks.accuracy import reduction_convergence
from calmotion.benchmarks.accuracy.reference_bench import Bench
from calmotion.benchmarks.common import shots
from calmotion.benchmarks.common.shots import Unreduced
from calmotion.benchmarks.scenes.beam_arm import beam_arm, quintic, shot_of


@pytest.fixture(scope="module")
def shot():
    character, meshes = beam_arm(payload=0.1, damping=0.02, elasticity="linear")
    return Unreduced("arm", "arm.usda", character, shot_of(quintic(0.8, 0.35, 0.1), 0.75), meshes, 0.05)


@pytest.fixture(scope="module")
def rows(shot):
    return list(reduction_convergence.convergence(Bench(shot), (1e-2, 1e-4, 1e-6)))


def test_the_change_by_a_finer_reduction_decreases(rows):
    assert rows[0].moved_m is None
    assert 1e-2 > rows[1].moved_m > 5.0 * rows[2].moved_m > 0.0
    assert int(rows[0].coordinates) < int(rows[1].coordinates) < int(rows[2].coordinates)


def test_the_command_writes_tables_and_one_object(shot, rows, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(shots, "load_unreduced", lambda path: shot)
    monkeypatch.setattr(reduction_convergence, "convergence", lambda bench, tolerances: iter(rows))
    table, text = tmp_path / "rows.csv", tmp_path / "rows.md"
    assert reduction_convergence.main(["arm.usda", "--json", "--csv", str(table), "--markdown", str(text)]) == 0
    shown = capsys.readouterr()
    assert [row["coordinates"] for row in json.loads(shown.out)["rows"]] == [row.coordinates for row in rows]
    assert len(shown.err.splitlines()) == 3 and len(text.read_text().splitlines()) == 5
    with open(table, newline="") as file:
        moved = [row["moved_m"] for row in csv.DictReader(file)]
    assert moved[0] == "" and [float(text) for text in moved[1:]] == [row.moved_m for row in rows[1:]]
    assert reduction_convergence.main(["arm.usda"]) == 0
    shown = capsys.readouterr().out
    assert "reductions get finer" in shown and all(row.coordinates in shown for row in rows)
