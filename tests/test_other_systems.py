"""What Windows and macOS do otherwise, on this system: no POSIX, other ends of lines, names, encodings, long paths."""

import json
import os
import subprocess
import sys

import pytest
from one_hinge import HINGE, ONE_HINGE

MOTION = f"time_s,{HINGE}\n0,0\n0.5,0.1\n1,0.2\n"
SETTINGS = "[figures.plot]\ndpi = 100\n"
# What is computed, read, written, locked and run in other processes.
CORE = (
    "tests/support/caching", "tests/support/test_files.py", "tests/support/test_memory.py",
    "tests/support/test_worker_processes.py", "tests/host/test_choices.py", "tests/workflow/test_outputs.py",
    "tests/workflow/test_watch.py", "tests/plugins/rerun_logger/test_recording.py",
)  # fmt: skip


# What has to do with files, processes or the command line besides.
MORE = (
    "tests/support", "tests/host", "tests/workflow", "tests/cli", "tests/mesh", "tests/recordings",
    "tests/test_end_to_end.py", "tests/plugins/shows", "tests/plugins/live", "tests/plugins/rerun_logger",
)  # fmt: skip


@pytest.mark.parametrize("tests", [CORE, pytest.param(MORE, marks=pytest.mark.long)], ids=["core", "more"])
def test_tests_pass_where_nothing_of_posix_is_there(repository, tests):
    """Modules, functions and signals are taken away from Calmotion and links from all; processes are spawned."""
    path = [repository / "tests" / "helpers" / "deprived", repository / "pipeline", os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, path))}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    done = subprocess.run(command, cwd=repository, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-4000:]
    skipped = "this system has no links, owners, pipes or signals of POSIX"
    assert skipped in done.stdout, "the deprived interpreter was not used"


@pytest.fixture
def simulated(calmotion):
    """Simulates a hinge whose shot, motion and settings lie in a folder; the report."""

    def run(folder, ends="\n"):
        folder.mkdir(parents=True)
        for name, text in (("shot.usda", ONE_HINGE), ("motion.csv", MOTION), ("settings.toml", SETTINGS)):
            (folder / name).write_bytes(text.replace("\n", ends).encode())
        inputs = [folder / "shot.usda", "--motion", folder / "motion.csv", "--settings", folder / "settings.toml"]
        outputs = ["-o", folder / "calm.usda", "--csv", folder / "calm.csv", "--rrd", folder / "calm.rrd"]
        done = calmotion("simulate", *inputs, *outputs, "--json", "--quiet")
        assert done.returncode == 0, done.stdout
        assert {"calm.usda", "calm_root.usda", "calm.csv", "calm.rrd"} <= {path.name for path in folder.iterdir()}
        return json.loads(done.stdout)

    return run


def test_files_of_windows_are_read_as_others(simulated, tmp_path):
    ours, theirs = simulated(tmp_path / "lf"), simulated(tmp_path / "crlf", "\r\n")
    assert theirs["targets"] == ours["targets"] and theirs["steps"] == ours["steps"]


@pytest.mark.parametrize("name", ["Roboter für den Prüfstand", "ロボット", "/".join(["long" * 12] * 5)])
def test_folders_have_any_name_and_length(simulated, tmp_path, name):
    simulated(tmp_path / name)


@pytest.mark.skipif(os.sep == "\\", reason="a backslash parts folders")
def test_a_backslash_in_a_name_is_refused_for_layers_alone(calmotion, tmp_path):
    """USD takes it for a slash, and would look for the layer in another folder."""
    folder = tmp_path / "a\\b"
    folder.mkdir()
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    (tmp_path / "motion.csv").write_text(MOTION)
    run = ("simulate", tmp_path / "shot.usda", "--motion", tmp_path / "motion.csv", "--json", "--quiet")
    assert calmotion(*run, "--csv", folder / "calm.csv").returncode == 0
    refused = json.loads(calmotion(*run, "-o", folder / "calm.usda").stdout)["error"]
    assert "backslash" in refused["problem"] and refused["remedy"]
    assert [path.name for path in folder.iterdir()] == ["calm.csv"]


def test_text_is_written_and_read_in_one_encoding_on_all_systems(repository, tmp_path):
    """Python warns of each file that is opened in the encoding of the system."""
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    command = [sys.executable, "-X", "warn_default_encoding", "-m", "calmotion", "simulate", "shot.usda"]
    command += ["-o", "calm.usda", "--csv", "calm.csv", "--rrd", "calm.rrd", "--figures", "figures", "--json"]
    environment = os.environ | {"PYTHONPATH": str(repository / "pipeline"), "PYTHONWARNINGS": "default"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    told = [line for line in done.stderr.splitlines() if "EncodingWarning" in line]
    assert not [line for line in told if "calmotion" in line.rpartition("site-packages")[2]], told
