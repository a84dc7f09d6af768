"""`simulate`, `optimize` and `watch` keep to their options in the same way."""

import json

import pytest
from calmotion.workflow.results import SimulationResult
from one_hinge import ONE_HINGE


@pytest.fixture
def shot(tmp_path):
    path = tmp_path / "shot.usda"
    path.write_text(ONE_HINGE)
    return path


COMMANDS = {"simulate": (), "watch": ("--runs", "1")}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ["--manifest", "--csv"])
def test_nothing_is_written_over_the_shot(calmotion, shot, command, option):
    run = calmotion(command, shot, "--step", "10ms", *COMMANDS[command], option, shot)
    assert run.returncode == 2 and option in run.stderr, run.stderr
    assert shot.read_text() == ONE_HINGE


@pytest.mark.parametrize("command", COMMANDS)
def test_options_of_a_layer_that_is_not_written_are_refused(calmotion, shot, command):
    run = calmotion(command, shot, "--step", "10ms", *COMMANDS[command], "--splines")
    assert run.returncode == 2 and "--splines" in run.stderr


@pytest.mark.parametrize("command", COMMANDS)
def test_each_run_has_its_progress(calmotion, shot, command):
    run = calmotion(command, shot, "--step", "10ms", *COMMANDS[command], "--json", "--progress")
    assert run.returncode == 0
    assert "progress\tSimulate the shot\t" in run.stderr
    assert json.loads(run.stdout)["command"] == "simulate"


@pytest.mark.parametrize("command", COMMANDS)
def test_strictly_a_missed_tolerance_is_a_failure(calmotion, shot, command, monkeypatch):
    report = SimulationResult.report
    monkeypatch.setattr(SimulationResult, "report", lambda result: report(result) | {"tolerance_kept": False})
    words = (command, shot, "--step", "10ms", *COMMANDS[command], "--json")
    assert calmotion(*words).returncode == 0
    assert calmotion(*words, "--strict").returncode == 1
