"""`optimize --window`: windows in the report, kept by the next run; and what `inspect` expects of a long shot."""

import json

import pytest
from small_shots import HAND, make_flexible, make_target, write_arm


@pytest.fixture
def shot(tmp_path):
    def edit(stage):
        make_flexible(stage, youngsModulus=2e8)
        make_target(stage, HAND, positionWeight=1.0)

    return write_arm(tmp_path / "shot.usda", edit)


def test_windows_are_reported_and_kept_by_the_next_run(shot, tmp_path, calmotion):
    line = ("optimize", shot, "-o", tmp_path / "calm.usda", "--tolerance", "1mm", "--step", "4ms", "--json", "--quiet")
    first = json.loads(calmotion(*line, "--window", "0.5s").stdout)
    assert [row["kept_s"] for row in first["windows"]] == [0.5, 1.0]
    assert all(row["searched"] for row in first["windows"])
    target = first["targets"][0]
    assert target["max_error_after_m"] < 0.5 * target["max_error_before_m"]
    assert any("2 windows of 0.5 s" in row["what"] for row in first["left_out"])
    layer = (tmp_path / "calm.usda").read_bytes()
    again = json.loads(calmotion(*line, "--window", "0.5s").stdout)
    assert not any(row["searched"] for row in again["windows"]) and again["iterations"] == 0
    assert (tmp_path / "calm.usda").read_bytes() == layer
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == [".calm.usda.windows.npz", "calm.usda", "calm_root.usda", "shot.usda"]


def test_windows_that_cannot_be_are_refused_before_meshes_are_made(shot, tmp_path, calmotion):
    run = calmotion("optimize", shot, "-o", tmp_path / "calm.usda", "--window", "0.1s")
    assert run.returncode == 1 and "too short" in run.stderr and "Tetrahedralise" not in run.stderr
    assert not (tmp_path / "calm.usda").exists()


def test_inspect_tells_windows_memory_and_time(shot, calmotion):
    report = json.loads(calmotion("inspect", shot, "--json").stdout)["expected"]
    assert report["windows"] == 1 and report["memory_gb"] > 0.0 and report["hours"] > 0.0
    run = calmotion("inspect", shot, "--json", "--set", "retarget.optimize.window=0.5s")
    report = json.loads(run.stdout)["expected"]
    assert report["windows"] == 2 and report["window_s"] == 0.5 and report["overlap_s"] == 0.25
    run = calmotion("inspect", shot, "--set", "retarget.optimize.window=0.5s")
    text = " ".join(run.stdout.split())  # lines break where the terminal ends
    assert "in 2 windows of 0.5 s" in text and "of memory" in text
