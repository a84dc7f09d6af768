"""Pairs of runs with and without something that a shot does not need."""

import csv
import json
from functools import partial

import pytest
from calmotion.benchmarks.accuracy import simplification
from calmotion.benchmarks.accuracy.simplification import Pair, pair
from calmotion.benchmarks.scenes.simplification_shots import clevis_arm, held_arm
from calmotion.shot.model_choice import ON
from calmotion.shot.run import RunSettings

FAST = RunSettings(step=1 / 240)


@pytest.fixture(scope="module")
def loops():
    return pair("loops", clevis_arm(2), "simulate", {"loops": ON}, 1, FAST)


def test_a_redundant_joint_changes_nothing(loops):
    assert loops.error_m < 1e-9
    assert loops.all_with_s > loops.with_s and loops.all_without_s > loops.without_s
    assert loops.ratio == loops.with_s / loops.without_s


def test_options_of_one_side_alone(monkeypatch):
    seen = []

    def run(shot, command, options_forced, options):
        seen.append((dict(options_forced), options))
        raise KeyboardInterrupt

    monkeypatch.setattr(simplification, "run", run)
    with pytest.raises(KeyboardInterrupt):
        pair("knots", held_arm(), "optimize", {}, 1, None, RunSettings(knot_spacing=0.1))
    assert seen == [({}, RunSettings(knot_spacing=0.1))]


def test_the_command_writes_a_table_and_one_object(loops, monkeypatch, capsys, tmp_path):
    other = Pair("turning", "gantry", "simulate", 2.0, 1.0, 4.0, 3.0, 1e-12, 0.0)
    made = [partial(lambda kind, found: found, item.kind, item) for item in (loops, other)]
    monkeypatch.setattr(simplification, "pairs", lambda repeats: made)
    table = tmp_path / "pairs.csv"
    assert simplification.main(["--json", "--csv", str(table)]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [row["kind"] for row in report["pairs"]] == ["loops", "turning"] and report["pairs"][1]["ratio"] == 2.0
    with open(table, newline="") as file:
        assert [float(row["with_s"]) for row in csv.DictReader(file)] == [loops.with_s, 2.0]
    assert simplification.main(["--only", "turning"]) == 0
    shown = capsys.readouterr().out
    assert "gantry" in shown and "clevis" not in shown


def test_every_kind_that_the_program_chooses_has_a_pair():
    kinds = [make.args[0] for make in simplification.pairs(1)]
    chosen = {*simplification.KINDS} - {"bodies"}  # which only the user chooses
    assert set(kinds) == {*chosen, "knots", "step", "everything"} and kinds.count("everything") == 2
