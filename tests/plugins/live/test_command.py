"""`calmotion live`: JSON lines and OSC."""

import json
import socket
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from calmotion.host import SettingError
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
    """Between lines that are no samples, of bytes that are no text as well."""
    samples = [{"t": 10.0 + k * 0.004, "joints": {joint: 0.1 * k * 0.004, "/No/Joint": 1.0}} for k in range(500)]
    text = b"".join(json.dumps(sample).encode() + b"\n" for sample in samples)
    for odd in (b"no sample", b'{"t": 0, "joints": {"J": "1"}}', b'{"t": true, "joints": {}}', b"\xff"):
        text = text.replace(b"\n", b"\n" + odd + b"\n\n", 1)
    (tmp_path / "in.jsonl").write_bytes(text)
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
    assert "4 messages were left out" in done.stderr and "/No/Joint: 500" in done.stderr
    assert "80 ms behind" in done.stderr


def lines(count, rate, start=0.0, name=JOINT, speed=0.1):
    """A stream of one joint that turns evenly."""
    rows = [{"t": start + k / rate, "joints": {name: speed * k / rate}} for k in range(count)]
    return "".join(json.dumps(row) + "\n" for row in rows)


@pytest.mark.parametrize(
    "text, options, said, end",
    [
        ("\ufeff" + lines(300, 250, name="SHORT") * 2, (), "600 samples: 1 restarted", 0.1 * 299 / 250),
        (lines(100, 50), (), "--sender-rate 50 follows them smoothly", 0.1 * 99 / 50),
        (lines(20, 0.25, speed=1e-4), ("--seconds", "40"), "have to be in seconds", 1e-4 * 40),
        (lines(300, 250).replace("0.004,", "1e999,"), (), "1 not finite", 0.1 * 299 / 250),
    ],
    ids="restart slow ms infinite".split(),
)
def test_what_is_odd_about_a_stream_is_told(calmotion, monkeypatch, shot, joint, tmp_path, text, options, said, end):
    (tmp_path / "in.jsonl").write_text(text.replace(JOINT, joint).replace("SHORT", joint.rpartition("/")[2]))
    with (tmp_path / "in.jsonl").open() as file:
        monkeypatch.setattr(sys, "stdin", file)
        done = calmotion("live", shot, "--lookahead", "40", "--quiet", *options)
    assert done.returncode == 0 and said in done.stderr, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["joints"][joint] == pytest.approx(end, abs=1e-9)


def test_a_file_through_a_pipe_is_played_by_its_stamps(calmotion_process, shot, joint, tmp_path):
    (tmp_path / "in.jsonl").write_text(lines(250, 250, name=joint))
    with subprocess.Popen(["cat", tmp_path / "in.jsonl"], stdout=subprocess.PIPE) as cat:
        done = calmotion_process("live", shot, "--lookahead", "40", "--quiet", stdin=cat.stdout)
    assert "250 samples" in done.stderr and "without a limit of speed: Hinge" in done.stderr, done.stderr
    found = np.array([json.loads(line)["joints"][joint] for line in done.stdout.splitlines()])
    # the thread that reads may begin some ticks after the player
    moving = found[np.argmax(found > 0.01) :][:150]
    np.testing.assert_allclose(np.diff(moving), 0.1 / 250, atol=1e-6)
    assert found[-1] == pytest.approx(0.1 * 249 / 250, abs=1e-9)


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


def test_a_table_tells_what_look_aheads_are_worth(calmotion, shot):
    told = calmotion("inspect", shot, "--live", "--quiet").stdout
    assert "as sent" in told and "20 ms" in told
    rows = json.loads(calmotion("inspect", shot, "--live", "--quiet", "--json").stdout)["lookahead"]
    assert rows[0]["lookahead_s"] is None and {"latency_s", "rms_m", "largest_m", "limited"} <= set(rows[0])


@pytest.mark.parametrize(
    "options, said",
    [
        (("--in", "udp://x"), "no place of a stream"),
        (("--rate", "5"), "no rate of commands"),
        (("--json",), "standard output holds the commands"),
        (("--in", "osc://127.0.0.1:9000", "--clock", "stamps"), "by the clock of this machine"),
        (("--in", "osc://no.such.machine.invalid:9000"), "no machine of this name"),
        (("--uncertainty", "x"), "is not a share"),
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
    arrived = {}
    try:
        with pytest.raises(SettingError, match="port cannot be opened"):
            OscSource(*place)
        # what is sent as commands would be, to the address of samples
        for values in (True, "x", [0.1, 0.2], 0.1, 0.2, 0.25):
            sink._client.send_message(f"/calm/in{JOINT}", values)
        sink._client._sock.sendto(b"no message", place)
        sink.send(0.0, {JOINT: 0.5}, SimpleNamespace(late=0, limited=()))
        for _ in range(200):
            arrived |= dict(pair for _, joints in source.arrived() for pair in joints.items())
            if source.faults == 5:
                break
            time.sleep(0.01)
        assert arrived == {JOINT: 0.25} and source.faults == 5 and "with one float" in source.fault
    finally:
        source.close()


def test_the_command_is_a_function_too():
    import calmotion as cm

    assert cm.live.__module__ == "calmotion_plugins.live.opening" and callable(cm.calibrate)
    with pytest.raises(AttributeError):
        cm.lively  # noqa: B018
