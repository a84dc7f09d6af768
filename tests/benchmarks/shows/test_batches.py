"""Batches on a cluster of this machine: shots that differ, and a worker, a scheduler and a command that are killed."""

import json
from pathlib import Path

import numpy as np
import pytest
from calmotion.benchmarks.shows import batches
from calmotion.benchmarks.shows.batches import BatchRun, table, write_shots
from calmotion.workflow.shot import Shot
from one_hinge import ONE_HINGE


@pytest.fixture
def shot(tmp_path):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    return tmp_path / "shot.usda"


def test_every_shot_is_another_performance_of_the_same_robot(shot, tmp_path):
    paths = write_shots(Shot(shot).read(), 3, 2.0, tmp_path)
    read = [Shot(path).read() for path in paths]
    assert [one.animation.frame_times[-1] for one in read] == [2.0] * 3
    values = [one.animation.tracks[0].values for one in read]
    assert np.abs(values[0] - values[1]).max() > 0.05 and np.abs(values[1] - values[2]).max() > 0.05


def test_a_batch_whose_curves_differ_or_lack_is_told(tmp_path):
    bench = batches._Bench([Path("a"), Path("b")], tmp_path, [], print)

    def jobs(*contents):
        rows = []
        for name, content in zip("ab", contents, strict=True):
            path = tmp_path / f"{name}{content}.usda"
            path.write_text(content)
            worker = f"tcp://{name}"
            rows.append({"name": name, "layer": str(path), "worker": worker, "processor_s": 3.0, "attempts": 1})
        return rows

    first = bench._judged("one", 1.0, jobs("x", "y"), True)
    assert first == BatchRun("one", 1.0, 6.0, 2.0, 2, 2, 0, True)
    assert bench._judged("same", 1.0, jobs("x", "y"), True).equal
    assert not bench._judged("other", 1.0, jobs("x", "z"), True).equal
    assert not bench._judged("lost", 1.0, jobs("x", "y")[:1], True).equal
    assert "| one | 1 s | 6 s | 2.00 | 2 of 2 | 0 | the same |" in table([first])
    assert "DIFFERENT" in table([bench._judged("other", 1.0, jobs("x", "z"), False)])


@pytest.mark.long
def test_nothing_is_lost_when_a_worker_the_scheduler_or_the_command_is_killed(shot, capsys):
    pytest.importorskip("distributed")
    status = batches.main([str(shot), "--shots=6", "--tolerance=1mm", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert status == 0 and len(found["runs"]) == 5 and all(run["equal"] and run["done"] == 6 for run in found["runs"])
    assert found["runs"][1]["balance"] > 1.5 and found["runs"][2]["again"] >= 1
