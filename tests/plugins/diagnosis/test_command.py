"""`calmotion diagnose`: encoders and commands alone, and a shot."""

import json

import numpy as np
import pytest
from one_hinge import HINGE, ONE_HINGE, TIP
from scipy.interpolate import CubicSpline

COUNT = 2.0 * np.pi / 4096
TICKS = np.arange(0.0, 8.0, 0.01)
JOINTS = ("/Arm/shoulder", "/Arm/elbow")


def moved(rng):
    """Quick moves of two joints between poses, with rests."""
    pose, parts, start = np.zeros(2), [], 0.3
    while start < 7.0:
        goal, length = rng.uniform(-1.0, 1.0, 2), rng.uniform(0.4, 0.8)
        parts.append((start, length, goal - pose))
        pose, start = goal, start + length + rng.choice([0.0, 0.5])

    def command(times):
        out = np.zeros((len(times), 2))
        for begin, length, turn in parts:
            s = np.clip((np.asarray(times) - begin) / length, 0.0, 1.0)
            out += np.outer(s**3 * (10.0 - 15.0 * s + 6.0 * s * s), turn)
        return out

    return command


def loop(command, frequency, damping):
    """A loop in steps of 0.1 ms, which is no code of the plugin."""
    h, omega = 1e-4, 2.0 * np.pi * frequency
    times = np.arange(0.0, 8.0, h)
    asked = command(times)
    y, v, out = asked[0].copy(), np.zeros(2), np.zeros_like(asked)
    for n, goal in enumerate(asked):
        v += h * (omega**2 * (goal - y) - 2.0 * damping * omega * v)
        y = y + h * v
        out[n] = y
    return lambda t: np.stack([np.interp(t, times, column) for column in out.T], axis=1)


def written(path, times, values):
    head = ",".join(["time_s", *(f"{joint}.angle" for joint in JOINTS)])
    np.savetxt(path, np.column_stack([times, values]), delimiter=",", header=head, comments="")
    return path


@pytest.fixture
def motion():
    return moved(np.random.default_rng(5))


def diagnosed(calmotion, folder, sent, encoders, times=TICKS, *options):
    commands = written(folder / "sent.csv", times, sent)
    recording = written(folder / "take.csv", TICKS, COUNT * np.round(encoders / COUNT))
    done = calmotion("diagnose", "--recording", recording, "--commands", commands, "--json", *options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    "cause, real",
    [
        ("none", lambda c: loop(c, 15.0, 0.8)(TICKS)),
        ("servo_gains", lambda c: loop(c, 5.0, 0.12)(TICKS)),
        ("delay", lambda c: loop(lambda t: c(np.maximum(t - 0.15, 0.0)), 15.0, 0.8)(TICKS)),
        ("stream", lambda c: loop(lambda t: c(np.floor(t * 15.0) / 15.0), 15.0, 0.8)(TICKS)),
    ],
)
def test_signals_alone_tell_what_a_loop_and_a_stream_do(calmotion, tmp_path, motion, cause, real):
    report = diagnosed(calmotion, tmp_path, motion(TICKS), real(motion))
    first = report["causes"][0]
    assert first["cause"] == cause and first["share"] > 0.6
    assert not report["model"]
    assert sum(row["share"] for row in report["causes"]) == pytest.approx(1.0, abs=0.03)
    values = {row["name"]: row["value"] for row in first["parameters"]}
    if cause == "servo_gains":
        assert values["frequency"] == pytest.approx(5.0, rel=0.05) and values["damping"] == pytest.approx(
            0.12, abs=0.05
        )
    if cause == "stream":
        assert values["rate"] == pytest.approx(15.0, rel=0.01)


def test_gaps_in_a_log_of_commands_are_the_stream(calmotion, tmp_path, motion):
    there = np.ones(len(TICKS), bool)
    for start in (130, 260, 410, 555, 640):
        there[start : start + 12] = False
    held = np.maximum.accumulate(np.where(there, np.arange(len(TICKS)), 0))
    real = loop(lambda t: motion(TICKS[held[np.minimum((t * 100.0).astype(int), len(held) - 1)]]), 15.0, 0.8)
    report = diagnosed(calmotion, tmp_path, motion(TICKS[there]), real(TICKS), TICKS[there])
    assert report["causes"][0]["cause"] == "stream" and report["causes"][0]["confidence"] > 0.8


def test_the_answer_comes_first_and_figures_are_written(calmotion, tmp_path, motion):
    commands = written(tmp_path / "sent.csv", TICKS, motion(TICKS))
    recording = written(tmp_path / "take.csv", TICKS, loop(motion, 5.0, 0.12)(TICKS))
    options = ("--recording", recording, "--commands", commands, "--figures", tmp_path / "figures",
               "--html", tmp_path / "page.html")  # fmt: skip
    done = calmotion("diagnose", *options)
    assert done.returncode == 0, done.stderr
    lines = " ".join(done.stdout.split("\n")[:6])
    assert lines.startswith("A servo loop explains") and "velocity gain" in lines and "A measurement to tell" in lines
    assert {file.name for file in (tmp_path / "figures").iterdir()} == {
        "motion.png", "spectra.png", "speed_and_torque.png"
    }  # fmt: skip
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert f"<p>{done.stdout.splitlines()[0]}</p>" in page and "Motion and error" in page and "take.csv" in page


# of a drive that this shot does not use: its motors follow exactly
UNUSED = "        float drive:angular:physics:stiffness = 0.05\n        float drive:angular:physics:damping = 0.0001\n"


@pytest.mark.parametrize("gains", ["", UNUSED])
def test_a_shot_knows_its_command_and_refuses_what_it_does_not_have(calmotion, tmp_path, gains):
    shot = tmp_path / "robot.usda"
    at = "        float drive:angular:physics:targetPosition"
    assert at in ONE_HINGE
    shot.write_text(ONE_HINGE.replace(at, gains + at))
    times = np.arange(0.0, 1.3, 0.005)
    frames = np.radians([0.0, 10.0, 30.0, 20.0, 0.0])
    turn = CubicSpline(np.arange(5) * 0.25, frames)(np.clip(times, 0.0, 1.0))
    table = np.column_stack([times, COUNT * np.round(turn / COUNT)])
    file = tmp_path / "take.csv"
    for path in (file, tmp_path / "good.csv"):
        np.savetxt(path, table, delimiter=",", header=f"time_s,{HINGE}.angle", comments="")
    done = calmotion("diagnose", shot, "--recording", file, "--json")
    assert done.returncode == 0, done.stderr
    assert [row["cause"] for row in json.loads(done.stdout)["causes"]] == ["none"]
    marker = np.column_stack([times, 0.1 * np.cos(turn), 0.1 * np.sin(turn)])
    np.savetxt(file, marker, delimiter=",", header=f"time_s,{TIP}.x,{TIP}.y", comments="")
    done = calmotion("diagnose", shot, "--recording", file, "--json")
    assert done.returncode == 0, done.stderr
    assert [row["cause"] for row in json.loads(done.stdout)["causes"]] == ["none"], "a marker seen from above"
    np.savetxt(file, table, delimiter=",", header=f"time_s,{HINGE.replace('H', 'K')}.angle", comments="")
    done = calmotion("diagnose", shot, "--recording", file)
    assert done.returncode != 0 and HINGE.replace("H", "K") in done.stderr and f"Did you mean {HINGE}" in done.stderr
    assert "Reduce" not in done.stderr, "before anything is meshed"
    done = calmotion("diagnose", shot, "--recording", tmp_path / "good.csv", "--commands", file)
    assert done.returncode != 0 and f"Did you mean {HINGE}" in done.stderr and "Reduce" not in done.stderr


def test_efforts_are_told_as_not_used_and_are_not_enough(calmotion, tmp_path):
    shot, file = tmp_path / "robot.usda", tmp_path / "take.csv"
    shot.write_text(ONE_HINGE)
    times = np.arange(0.0, 1.0, 0.005)
    table = np.column_stack([times, 0.0 * times, np.sin(times)])
    np.savetxt(file, table, delimiter=",", header=f"time_s,{HINGE}.angle,{HINGE}.effort", comments="")
    done = calmotion("diagnose", shot, "--recording", file, "--json")
    assert done.returncode == 0, done.stderr
    assert any("effort" in note and "calibrate" in note for note in json.loads(done.stdout)["notes"])
    np.savetxt(file, table[:, [0, 2]], delimiter=",", header=f"time_s,{HINGE}.effort", comments="")
    for options in ((shot,), ()):
        done = calmotion("diagnose", *options, "--recording", file)
        assert done.returncode != 0 and "JOINT.angle" in done.stderr and "calmotion calibrate" in done.stderr


def test_a_dataset_of_lerobot_has_commands_and_motion(calmotion, tmp_path, motion):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    times = np.arange(0.0, 8.0, 1.0 / 30.0)
    asked, real = np.degrees(motion(times)), np.degrees(loop(motion, 4.0, 0.1)(times))
    columns = {"action": list(asked), "observation.state": list(real), "timestamp": times, "episode_index": 0 * times}
    for folder in ("data", "meta"):
        (tmp_path / folder).mkdir()
    parquet.write_table(pyarrow.table(columns), tmp_path / "data" / "file.parquet")
    names = ["shoulder_pan.pos", "elbow_flex.pos"]
    (tmp_path / "meta" / "info.json").write_text(json.dumps({"features": {"observation.state": {"names": names}}}))
    done = calmotion("diagnose", "--recording", tmp_path / "data" / "file.parquet", "--json")
    assert done.returncode == 0, done.stderr
    first = json.loads(done.stdout)["causes"][0]
    assert first["cause"] == "servo_gains" and "/elbow_flex" in {row["path"] for row in first["parameters"]}
    parquet.write_table(pyarrow.table({"timestamp": times}), tmp_path / "other.parquet")
    done = calmotion("diagnose", "--recording", tmp_path / "other.parquet")
    assert done.returncode != 0 and "has no such column" in done.stderr and "observation.state" in done.stderr


def test_a_table_of_resonances_alone_tells_where_it_rings(calmotion, tmp_path):
    f = np.arange(0.0, 200.0, 0.5)
    psd = 1.0 / ((1.0 - (f / 52.0) ** 2) ** 2 + (0.1 * f / 52.0) ** 2) + 0.1
    table = np.column_stack([f, psd, 0.1 * psd, 0.1 * psd, 1.2 * psd])
    file = tmp_path / "resonances_x.csv"
    np.savetxt(file, table, delimiter=",", header="freq,psd_x,psd_y,psd_z,psd_xyz", comments="")
    found = json.loads(calmotion("diagnose", "--recording", file, "--json").stdout)["causes"][0]
    values = {row["name"]: row["value"] for row in found["parameters"]}
    assert found["cause"] == "unknown" and "encoders" in found["remedy"]
    assert values["frequency"] == pytest.approx(52.0, abs=1.0) and values["damping"] == pytest.approx(0.05, rel=0.2)


def test_an_accelerometer_alone_tells_where_it_rings(calmotion, tmp_path):
    times = np.arange(0.0, 6.0, 1.0 / 800.0)
    rings = 2e3 * np.exp(-2.0 * (times % 1.5)) * np.sin(2.0 * np.pi * 7.0 * (times % 1.5))
    noise = np.random.default_rng(1).normal(0.0, 30.0, (len(times), 2))
    file = tmp_path / "accelerometer.csv"
    head = "time_s,/Hand.ax,/Hand.ay,/Hand.az"
    np.savetxt(file, np.column_stack([times, 1e-3 * rings, 1e-3 * noise]), delimiter=",", header=head, comments="")
    done = calmotion("diagnose", "--recording", file, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["causes"][0]
    values = {row["name"]: row["value"] for row in found["parameters"]}
    assert found["cause"] == "unknown" and "shot" in found["remedy"]
    assert values["frequency"] == pytest.approx(7.0, abs=0.5)
