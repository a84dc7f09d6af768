"""`calmotion live`: JSON lines and OSC."""

from __future__ import annotations

import json
import socket
import time
from types import SimpleNamespace

import numpy as np
import pytest
from one_hinge import ONE_HINGE
from recordings import read_recording

JOINT = "/Robot/Joint"


@pytest.fixture
def shot(tmp_path):
    path = tmp_path / "robot.usda"
    path.write_text(ONE_HINGE)
    return path


@pytest.fixture
def joint(calmotion, shot):
    """The path of the only joint."""
    found = json.loads(calmotion("inspect", shot, "--json").stdout)
    return found["motors"][0]["path"]


def test_lines_of_a_file_become_commands_as_fast_as_they_are_read(calmotion_process, shot, joint, tmp_path):
    samples = [{"t": 10.0 + k * 0.004, "joints": {joint: 0.1 * k * 0.004, "/No/Joint": 1.0}} for k in range(500)]
    text = "".join(json.dumps(sample) + "\n" for sample in samples)
    (tmp_path / "in.jsonl").write_text(text.replace("\n", "\nno sample\n\n", 3))
    with (tmp_path / "in.jsonl").open() as file:
        done = calmotion_process("live", shot, "--rate", "250", "--lookahead", "80", "--quiet", stdin=file)
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(rows) >= 500 and all(set(row) == {"t", "joints", "late", "limited"} for row in rows)
    np.testing.assert_allclose([row["t"] for row in rows[:500]], [sample["t"] for sample in samples], atol=1e-9)
    late = 20
    found = [row["joints"][joint] for row in rows]
    np.testing.assert_allclose(found[late:500], [s["joints"][joint] for s in samples[: 500 - late]], atol=1e-9)
    assert rows[-1]["late"] == 0 and abs(found[-1] - found[-100]) < 1e-9
    assert "3 messages were left out" in done.stderr and "/No/Joint came 500 times" in done.stderr
    assert "80 ms behind" in done.stderr


def test_the_animation_of_a_shot_is_played_as_a_stream(calmotion, shot):
    done = calmotion("live", shot, "--replay", shot, "--lookahead", "40ms", "--quiet")
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) > 10


def test_a_recording_has_every_command_and_the_robot(calmotion, shot, joint, tmp_path):
    done = calmotion("live", shot, "--replay", shot, "--rrd", tmp_path / "live.rrd", "--quiet")
    assert done.returncode == 0, done.stderr
    columns = read_recording(tmp_path / "live.rrd")
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    shown = columns[f"/motors{joint}/command", "Scalars:scalars"][-1]
    np.testing.assert_allclose(np.ravel(shown), np.degrees([row["joints"][joint] for row in rows]), atol=1e-9)
    assert ("/robot/command/targets", "Points3D:positions") in columns
    refused = calmotion("live", shot, "--replay", shot, "--rrd", tmp_path, "--quiet")
    assert refused.returncode == 2 and "this recording cannot be written" in refused.stderr
    missing = calmotion("live", shot, "--replay", tmp_path / "nowhere.usda")
    assert missing.returncode == 1 and "the file does not exist" in missing.stderr
    assert "Reduce" not in missing.stderr + missing.stdout, "before any long work"


@pytest.mark.parametrize("command", [("live", "--table"), ("inspect", "--live")])
def test_a_table_tells_what_look_aheads_are_worth(calmotion, shot, command):
    name, option = command
    told = calmotion(name, shot, option, "--quiet").stdout
    assert "as sent" in told and "20 ms" in told
    rows = json.loads(calmotion(name, shot, option, "--quiet", "--json").stdout)["lookahead"]
    assert rows[0]["lookahead_s"] is None and {"latency_s", "rms_m", "largest_m", "limited"} <= set(rows[0])


@pytest.mark.parametrize(
    "options, said",
    [
        (("--in", "udp://x"), "no place of a stream"),
        (("--rate", "5"), "no rate of commands"),
        (("--json",), "standard output holds the commands"),
    ],
)
def test_options_that_do_not_fit_are_refused(calmotion, shot, options, said):
    done = calmotion("live", shot, *options)
    assert done.returncode == 2 and said in done.stdout + done.stderr, done.stderr


def test_faders_over_osc_arrive_and_leave_on_this_machine():
    pytest.importorskip("pythonosc")
    from calmotion_plugins.live.lines import OscSink, OscSource, osc_place

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    place = osc_place(f"osc://127.0.0.1:{port}", "--in")
    assert place == ("127.0.0.1", port) and osc_place("-", "--in") is None
    source, sink = OscSource(*place), OscSink(*place)
    try:
        # what is sent as commands would be, to the address of samples
        sink._client.send_message(f"/calm/in{JOINT}", 0.25)
        sink.send(0.0, {JOINT: 0.5}, SimpleNamespace(late=0, limited=()))
        for _ in range(200):
            if arrived := source.arrived():
                break
            time.sleep(0.01)
        assert arrived[0][1] == {JOINT: 0.25}
    finally:
        source.close()


def test_the_command_is_a_function_too():
    import calmotion as cm

    assert cm.live.__module__ == "calmotion_plugins.live.opening" and callable(cm.calibrate)
    with pytest.raises(AttributeError):
        cm.lively  # noqa: B018
