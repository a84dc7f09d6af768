"""Batches: results and failures in one report, attempts, and batches that go on."""

import json
import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from batch_traps import SPRUNG, TRAP
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion_plugins.shows.batch import run as batches
from calmotion_plugins.shows.batch.run import batch
from one_hinge import ONE_HINGE

pytest.importorskip("fcntl")
STEP = ("--step=0.01s",)


@pytest.fixture
def shots(tmp_path):
    """Three shots: a good one, another motion, and one that cannot be processed."""
    texts = {"good": ONE_HINGE, "other": ONE_HINGE.replace("12: 30", "12: 25"), "bad": "no USD"}
    for name, text in texts.items():
        (tmp_path / f"{name}.usda").write_text(text)
    return [tmp_path / f"{name}.usda" for name in texts]


@pytest.fixture
def trap(tmp_path, make_plugin):
    """Arguments and environment of a batch whose processes meet a trap."""
    folder = make_plugin("trap", TRAP).parent

    def set_trap(kind):
        environment = {"TRAP_KIND": kind, "TRAP_FOLDER": str(tmp_path)}
        return {"arguments": [*SPRUNG, f"--plugins={folder}"], "environment": environment}

    return set_trap


def outcomes(result):
    return [job.outcome for job in result.jobs]


def test_a_batch_reports_all_jobs_and_runs_again_only_what_has_changed(shots, tmp_path):
    seen = []
    first = batch(shots, tmp_path / "out", arguments=STEP, workers=2, progress=seen.append)
    assert outcomes(first) == ["done", "done", "failed"] and not first.successful
    rows = json.loads((tmp_path / "out" / "batch.json").read_text())["jobs"]
    assert [row["attempts"] for row in rows] == [1, 1, 1] and rows[0]["wall_s"] > 0.0
    assert Path(rows[0]["layer"]).exists() and Path(rows[0]["root_layer"]).exists() and rows[2]["layer"] is None
    assert "not a USD file" in rows[2]["problem"]["problem"] and rows[0]["problem"] is None
    assert [state.fraction for state in seen] == sorted(state.fraction for state in seen)
    before = {path: path.read_bytes() for path in (tmp_path / "out").glob("good*")}
    shots[1].write_text(ONE_HINGE.replace("12: 30", "12: 20"))
    again = batch(shots[:2], tmp_path / "out", arguments=STEP, workers=2)
    assert outcomes(again) == ["kept", "done"] and again.successful
    assert {path: path.read_bytes() for path in before} == before
    assert again.jobs[0].as_dict()["max_error_after_m"] == first.jobs[0].as_dict()["max_error_after_m"]


def test_a_job_whose_process_is_killed_is_tried_again_and_has_the_same_result(shots, tmp_path, trap, calmotion):
    killed = batch(shots[:1], tmp_path / "killed", workers=1, **trap("once"))
    assert outcomes(killed) == ["done"] and killed.jobs[0].attempts == 2
    alone = tmp_path / "alone.usda"
    assert calmotion("optimize", shots[0], "-o", alone, *STEP).returncode == 0
    assert Path(killed.jobs[0].job.layer).read_bytes() == alone.read_bytes()


@pytest.mark.long
def test_a_job_that_always_dies_is_given_up_and_leaves_no_files(shots, tmp_path, trap):
    result = batch(shots[:1], tmp_path / "out", workers=1, **trap("always"))
    assert outcomes(result) == ["died"] and result.jobs[0].attempts == batches.MOST_ATTEMPTS
    assert result.jobs[0].problem["problem"] == "the process ended by signal 9"
    assert not list((tmp_path / "out").glob("good*"))


def test_a_batch_that_is_stopped_goes_on(shots, tmp_path, trap):
    begun = threading.Event()

    def cancel():
        if list(tmp_path.glob("*.begun")):
            begun.set()
        return begun.is_set()

    stopped = batch(shots[:1], tmp_path / "out", workers=1, cancel=cancel, **trap("wait"))
    assert stopped.interrupted and outcomes(stopped) == ["not run"] and not list((tmp_path / "out").glob("good*"))
    assert json.loads((tmp_path / "out" / "batch.json").read_text())["interrupted"]
    (process,) = (int(path.stem) for path in tmp_path.glob("*.begun"))
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)
    (tmp_path / "go").write_text("")
    assert outcomes(batch(shots[:1], tmp_path / "out", workers=1, **trap("wait"))) == ["done"]


def test_two_batches_do_not_share_a_folder(shots, tmp_path):
    (tmp_path / "out").mkdir()
    with batches._alone(str(tmp_path / "out")), pytest.raises(ShotError, match="another batch"):
        batch(shots, tmp_path / "out")


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"workers": 0}, "--workers"),
        ({"workers": 1.5}, "1.5"),
        ({"on": "cloud"}, "--on"),
        ({"extras": "video.mp4"}, "video.mp4"),
    ],
)
def test_wrong_arguments_are_setting_errors(shots, tmp_path, options, problem):
    with pytest.raises(SettingError, match=problem):
        batch(shots[:1], tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


def test_the_command_line_prints_one_line_for_each_job(shots, tmp_path, calmotion, monkeypatch):
    monkeypatch.setattr(batches, "_work", lambda *arguments: None)
    run = calmotion("batch", *shots, "-o", tmp_path / "out", "--tolerance", "1mm", "--csv", "--quiet", "--json")
    report = json.loads(run.stdout)
    assert run.returncode == 1 and report["outcomes"] == {"not run": 3} and report["command"] == "batch"
    run = calmotion("batch", *shots, "-o", tmp_path / "out")
    assert re.search(r"^good +not run", run.stdout, re.MULTILINE) and "batch.json" in run.stdout


@pytest.mark.long
def test_a_scheduler_that_is_killed_ends_the_batch_which_goes_on_later(shots, tmp_path, trap):
    pytest.importorskip("distributed")
    begun = [subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
         "--scheduler-file", tmp_path / "scheduler.json"]
    )]  # fmt: skip
    while not (tmp_path / "scheduler.json").exists():
        time.sleep(0.05)
    address = json.loads((tmp_path / "scheduler.json").read_text())["address"]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
    begun.append(subprocess.Popen([*worker, "--death-timeout", "5"]))

    def kill():
        while not list(tmp_path.glob("*.begun")):
            time.sleep(0.05)
        begun[0].kill()

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        options = {"on": address.replace("tcp://", "dask://"), "workers": 1} | trap("wait")
        result = batch(shots[:2], tmp_path / "out", **options)
    finally:
        killer.join()
        for process in begun:
            process.kill()
            process.wait()
    assert outcomes(result) == ["died", "died"] and not result.interrupted
    assert "scheduler is gone" in result.jobs[0].problem["problem"] and result.jobs[0].attempts == 1
    (tmp_path / "go").write_text("")
    assert outcomes(batch(shots[:2], tmp_path / "out", workers=2, **trap("wait"))) == ["done", "done"]


@pytest.mark.long
def test_workers_of_dask_share_the_jobs_and_one_that_is_killed_loses_nothing(shots, tmp_path, trap):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address.replace("tcp://", "dask://")
        plain = batch(shots, tmp_path / "plain", arguments=STEP, on=address)
        assert outcomes(plain) == ["done", "done", "failed"]
        killer = threading.Thread(target=_kill_busy_worker, args=(cluster, tmp_path))
        killer.start()
        result = batch(shots[:1], tmp_path / "killed", on=address, **trap("wait"))
        killer.join()
    assert outcomes(result) == ["done"] and result.jobs[0].attempts == 2
    assert Path(result.jobs[0].job.layer).exists()


def _kill_busy_worker(cluster, folder):
    """End with -9 the worker whose job has met the trap, then let the next attempt go on."""
    while not list(folder.glob("*.begun")):
        time.sleep(0.05)
    for worker in list(cluster.workers.values()):
        status = cluster.scheduler.workers[worker.worker_address]
        if status.processing:
            os.kill(worker.process.pid, 9)
    time.sleep(0.5)
    (folder / "go").write_text("")
