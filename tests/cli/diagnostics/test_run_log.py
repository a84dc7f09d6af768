"""The log of a run."""

import json
import os

import pytest
from calmotion.cli.diagnostics.run_log import RunLog
from calmotion.cli.progress import ProgressDisplay
from calmotion.host import OperatorResult, Outcome, Record, SettingError
from calmotion.workflow.run import Progress


def lines(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_every_line_is_on_the_disk_before_the_run_goes_on(tmp_path):
    path = tmp_path / "run.jsonl"
    log = RunLog(str(path))
    assert lines(path)[-1]["event"] == "begin"
    log.progress(Progress("Read the shot", 0.0, ""))
    log.progress(Progress("Read the shot", 1.0, "all of it", 2.5))
    found = lines(path)[-1]
    assert (found["event"], found["stage"], found["fraction"], found["message"]) == (
        "progress", "Read the shot", 1.0, "all of it",
    )  # fmt: skip
    assert found["time_left_s"] == 2.5 and found["time"].endswith("+00:00") and found["elapsed_s"] >= 0.0
    assert found["peak_memory_bytes"] >= found["memory_bytes"] > 10**6


def test_progress_that_comes_often_is_thinned_but_begin_and_end_stay(tmp_path):
    path = tmp_path / "run.jsonl"
    log = RunLog(str(path))
    for step in range(1001):
        log.progress(Progress("Optimise", step / 1000, ""))
    fractions = [line["fraction"] for line in lines(path) if line["event"] == "progress"]
    assert fractions[0] == 0.0 and fractions[-1] == 1.0 and len(fractions) < 500


def test_the_display_logs_operators_notes_and_the_end_also_of_a_quiet_run(tmp_path, capsys):
    path = tmp_path / "run.jsonl"
    path.write_text('{"event": "earlier run"}\n')
    with pytest.raises(KeyboardInterrupt), ProgressDisplay(quiet=True, log=str(path)) as display:
        display(Progress("Mesh", 0.5, "body 1"))
        display.done(
            OperatorResult(
                "fe.mesh", "Mesh", "fe_mesher", Outcome.DONE, duration=1.5, progress=1.0,
                records=(Record("warning", "thin"),),
            )
        )  # fmt: skip
        raise KeyboardInterrupt
    events = [(line["event"], line.get("message", "")) for line in lines(path)]
    assert events == [
        ("earlier run", ""), ("begin", ""), ("progress", "body 1"), ("operator", ""), ("warning", "thin"),
        ("end", "KeyboardInterrupt"),
    ]  # fmt: skip
    assert capsys.readouterr().err == ""


def test_a_log_that_cannot_be_written_is_refused_before_the_run(tmp_path, calmotion, repository):
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "output").open("w") as output:  # `--log /dev/stdout > output`: report and log would mix
        (tmp_path / "stdout").symlink_to(f"/proc/self/fd/{output.fileno()}")
        with pytest.raises(SettingError, match="never replaced"):
            RunLog(str(tmp_path / "stdout"))
    for path in (tmp_path, tmp_path / "pipe" / "log", tmp_path / "pipe"):
        with pytest.raises(SettingError) as caught:
            RunLog(str(path))
        assert caught.value.path == "--log" and str(path) in str(caught.value.found)
    done = calmotion("simulate", repository / "samples" / "bartender" / "bartender.usda", "--log", tmp_path)
    assert done.returncode == 2 and "--log" in done.stderr


@pytest.mark.parametrize("content", ["#usda 1.0\n", "time_s,/Arm/Elbow\n0,1\n", "{\n", "[fe.mesh]\n", "1\n"])
def test_a_file_that_is_no_log_is_never_changed(tmp_path, content):
    (tmp_path / "file").write_text(content)
    with pytest.raises(SettingError, match="another kind"):
        RunLog(str(tmp_path / "file"))
    assert (tmp_path / "file").read_text() == content


def test_a_full_disk_ends_the_log_and_not_the_run():
    if not os.path.exists("/dev/full"):
        pytest.skip("this system has no /dev/full")
    log = RunLog.__new__(RunLog)
    log._file, log._begin, log._last, log._shown = open("/dev/full", "a"), 0.0, 0.0, ("", "", 0.0)
    log.progress(Progress("Mesh", 0.0, ""))
