"""The file of the recording: what is refused or fails leaves nothing behind."""

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import recordings
import rerun as rr
import synthetic
from calmotion.errors import ShotError
from calmotion.host import PluginError
from calmotion.model import SearchRecord
from calmotion.model.run import OutputPaths
from calmotion.testing import host_with, run_operator
from recordings import PLUGIN, write


def test_it_is_skipped_when_no_recording_is_requested():
    values = [synthetic.character(), synthetic.animation(), synthetic.result(), OutputPaths()]
    with pytest.raises(PluginError, match="--rrd"):
        run_operator(host_with(PLUGIN), "rerun.log", values)


def test_a_performance_at_another_tempo_has_its_tempo_and_what_forces_it(tmp_path):
    result = synthetic.retimed_result()
    write(tmp_path / "out.rrd", result)
    columns = recordings.read_recording(tmp_path / "out.rrd")
    times, percent = columns["/tempo/percent", "Scalars:scalars"]
    assert times[-1] == pytest.approx(1.1) and np.ravel(percent)[-1] == pytest.approx(100.0 / 1.2)
    begins, told = columns["/tempo_reasons", "TextLog:text"]
    assert begins == pytest.approx([0.204]) and "1.20 times as long: velocity of" in str(told[0])


def test_a_folder_that_cannot_be_written_is_reported_and_nothing_is_left(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(ShotError, match="cannot be written"):
        write(tmp_path / "file" / "out.rrd", synthetic.result())
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.posix
@pytest.mark.parametrize("size", [0, 96, 20_000])
def test_a_full_disk_is_reported_and_leaves_the_old_recording(tmp_path, size):
    """At once or later, where rerun by itself waits for ever in some of the runs."""
    path = tmp_path / "out.rrd"
    path.write_bytes(b"old")
    code = (
        "import resource, sys; sys.path[:0] = sys.argv[1:3]\n"
        "import recordings, synthetic\n"
        "from calmotion.errors import ShotError\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[4]),) * 2)\n"
        "try:\n"
        "    recordings.write(sys.argv[3], synthetic.result())\n"
        "except ShotError as error:\n"
        "    print(error)\n"
    )
    folders = [str(PLUGIN.parents[1] / "pipeline"), str(Path(recordings.__file__).parent)]
    # -B: compiled modules of rerun would be cut off as well, and stay so for all other tests
    command = [sys.executable, "-B", "-c", code, *folders, str(path), str(size)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert "cannot be written" in done.stdout and "File too large" in done.stdout, done.stderr
    assert path.read_bytes() == b"old" and [p.name for p in tmp_path.iterdir()] == ["out.rrd"]


def test_a_failure_of_rerun_is_reported_and_leaves_the_old_recording(tmp_path, monkeypatch):
    path = tmp_path / "out.rrd"
    path.write_bytes(b"old")

    def fail(stream):
        raise RuntimeError("File-writer thread shut down prematurely")  # what rerun's thread then raises

    monkeypatch.setattr("rerun.RecordingStream.flush", fail)
    with pytest.raises(ShotError, match="cannot be written"):
        write(path, synthetic.result())
    assert path.read_bytes() == b"old" and [p.name for p in tmp_path.iterdir()] == ["out.rrd"]


def test_a_recording_without_its_end_is_refused(tmp_path, monkeypatch):
    save = rr.RecordingStream.save
    monkeypatch.setattr("rerun.RecordingStream.save", lambda stream, path: save(stream, os.devnull))
    with pytest.raises(ShotError, match="its end could not be written"):
        write(tmp_path / "out.rrd", synthetic.result())
    assert list(tmp_path.iterdir()) == []


def test_a_failure_half_way_leaves_the_old_recording(tmp_path):
    path = tmp_path / "out.rrd"
    path.write_bytes(b"old")
    broken = dataclasses.replace(synthetic.result(), search=SearchRecord(steps=(None,)))
    with pytest.raises(AttributeError):
        write(path, broken)
    assert path.read_bytes() == b"old" and [p.name for p in tmp_path.iterdir()] == ["out.rrd"]


def test_writing_a_recording_leaves_no_trace_in_the_home_folder(tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    code = (
        "import sys; sys.path[:0] = sys.argv[1:3]\n"
        "import recordings, synthetic\n"
        "recordings.write(sys.argv[3], synthetic.result())\n"
    )
    folders = [str(PLUGIN.parents[1] / "pipeline"), str(Path(recordings.__file__).parent)]
    environment = {key: value for key, value in os.environ.items() if not key.startswith("XDG_")} | {"HOME": str(home)}
    subprocess.run(
        [sys.executable, "-c", code, *folders, str(tmp_path / "out.rrd")], env=environment, check=True, timeout=600
    )
    assert (tmp_path / "out.rrd").is_file() and not list(home.rglob("*rerun*"))
