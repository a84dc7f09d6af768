"""Broken shots end in an error that helps, or in a repair that is told; nothing is lost, and nothing half-written."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest
from broken_shots import CASES, too_many_samples
from calmotion.cli import main as cli


def state(folder: Path) -> dict[str, str]:
    """Hashes of all files."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def refused(capfd, shot: Path, *place: str) -> dict:
    """The first error of a run that must be refused without leaving or changing anything."""
    before = state(shot.parent)
    status = cli.main(["optimize", str(shot), "-o", str(shot.parent / "calm.usda"), "--json", "--quiet"])
    printed = capfd.readouterr()
    assert status == 1, printed.out
    assert state(shot.parent) == before
    assert "Traceback" not in printed.err and "Traceback" not in printed.out, printed.err
    report = json.loads(printed.out)
    told = [json.dumps(error, ensure_ascii=False) for error in report["errors"]]
    assert any(all(part in text for part in place) for text in told), told
    error = report["error"]
    assert error["problem"] and error["remedy"], error
    return error


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.place])
def test_a_broken_shot_is_refused_by_its_place_with_a_remedy(capfd, tmp_path, name):
    case = CASES[name]
    refused(capfd, case.make(tmp_path), *case.place)


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if not case.place])
def test_repairable_shots_are_processed_and_the_repair_is_reported(capfd, tmp_path, name):
    case = CASES[name]
    shot = case.make(tmp_path)
    before = state(tmp_path)
    status = cli.main(["simulate", str(shot), "-o", str(tmp_path / "moved.usda"), "--json", "--step", "20ms"])
    printed = capfd.readouterr()
    assert status == 0, printed.out
    report = json.loads(printed.out)
    assert case.repaired in printed.err + json.dumps(report, ensure_ascii=False)
    after = state(tmp_path)
    assert {name: after[name] for name in before} == before
    assert set(after) - set(before) == {"moved.usda", "moved_root.usda"}


def test_a_file_that_is_not_there_is_refused(capfd, tmp_path):
    refused(capfd, tmp_path / "nothing.usda", "nothing.usda")


def test_the_message_on_the_terminal_says_the_same(calmotion, tmp_path):
    shot = CASES["a negative mass"].make(tmp_path)
    done = calmotion("optimize", shot, "-o", tmp_path / "calm.usda")
    assert done.returncode == 1
    assert all(text in done.stderr for text in ("/Arm/fore", "physics:mass", "-1"))


@pytest.mark.long
def test_ten_million_samples_are_refused_in_time(capfd, tmp_path):
    case = too_many_samples(10_000_000)
    refused(capfd, case.make(tmp_path), *case.place)


WRITING = """
import resource, sys
from calmotion.cli import main as cli
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
sys.exit(cli.main(["simulate", "shot.usda", "-o", "moved.usda", "--json", "--quiet", "--step", "20ms"]))
"""


def write_in_a_process(folder: Path, repository: Path, limit: int) -> subprocess.CompletedProcess[str]:
    """The limit holds for a whole process, and for good."""
    import os

    environment = os.environ | {"PYTHONPATH": str(repository / "pipeline")}
    return subprocess.run(
        [sys.executable, "-B", "-c", WRITING.format(limit=limit)],  # compiled modules would be cut off, and stay so
        cwd=folder, env=environment, capture_output=True, text=True, timeout=600,
    )  # fmt: skip


def test_a_disk_that_is_full_leaves_no_half_of_a_file(calmotion, repository, tmp_path):
    import small_shots

    shot = small_shots.write_arm(tmp_path / "shot.usda")
    before = state(tmp_path)
    done = write_in_a_process(tmp_path, repository, 2000)
    assert done.returncode == 1, done.stdout + done.stderr
    error = json.loads(done.stdout)["error"]
    assert "cannot be written" in error["problem"] and "moved" in error["path"] and "space" in error["remedy"]
    assert state(tmp_path) == before
    assert calmotion("simulate", shot, "-o", tmp_path / "moved.usda", "--step", "20ms").returncode == 0


def test_a_folder_that_cannot_be_written_to_is_reported(calmotion, tmp_path):
    import small_shots

    shot = small_shots.write_arm(tmp_path / "shot.usda")
    done = calmotion("simulate", shot, "-o", "/proc/moved.usda", "--json", "--quiet", "--step", "20ms")
    assert done.returncode in (1, 2)
    assert "/proc" in json.dumps(json.loads(done.stdout)["error"])
