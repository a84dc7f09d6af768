"""Formats of commands: what is in the files, read by others than what wrote them, and what is refused."""

import csv
import dataclasses
import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml
from calmotion.errors import ShotError
from calmotion.host import PluginError
from calmotion.model.curves import commanded_curves
from calmotion.testing import check_plugin, host_with, run_operator, small_shot
from calmotion_plugins.controller_export.commands import ExportRequest, MotorCurves

SERVOS = """
[default]
resolution = 4096
[shoulder]
id = 3
direction = -1
centre = 1000
[elbow]
minimum = 100
maximum = 4000
offset = 10.0
"""


@pytest.fixture(scope="module")
def curves():
    character, animation = small_shot()
    motors = (dataclasses.replace(character.motors[0], max_velocity=2.0, max_torque=8.0), character.motors[1])
    return MotorCurves(
        "arm.usda", 1.0, False, motors, ("shoulder", "elbow"), np.array([[-np.inf, np.inf], [-2.0, 2.0]]),
        commanded_curves(character, animation, None),
    )  # fmt: skip


@pytest.fixture
def write(repository, curves, tmp_path):
    def run(name, rate=100.0, file="out/commands", curves=curves, **settings):
        host = host_with(repository / "plugins" / "controller_export")
        request = ExportRequest(name, rate, str(tmp_path / file))
        (found,) = run_operator(host, f"export.{name}", [curves, request], {f"export.{name}": settings})
        return found

    return run


@pytest.fixture
def servos(tmp_path):
    file = tmp_path / "servos.toml"
    file.write_text(SERVOS)
    return file


def table(path):
    with open(path, newline="") as file:
        lines = file.read().splitlines()
    comments = [line for line in lines if line.startswith("#")]
    head, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    return comments, head, np.array(rows, float)


@pytest.mark.parametrize(
    ("fields", "interpolation"), [("positions", "linear"), ("velocities", "cubic"), ("accelerations", "quintic")]
)
def test_a_trajectory_is_what_ros_2_reads(write, curves, fields, interpolation):
    written = write("ros2", rate=30.0, fields=fields)
    with open(written.files[0]) as file:
        message = yaml.safe_load(file)
    assert message["joint_names"] == ["shoulder", "elbow"] and list(message["header"]) == ["stamp", "frame_id"]
    points = message["points"]
    # the message takes nothing but floats for values and integers for times
    assert all(type(value) is float for point in points for value in point["positions"])
    stamps = [point["time_from_start"] for point in points]
    assert all(type(s["sec"]) is type(s["nanosec"]) is int and 0 <= s["nanosec"] < 10**9 for s in stamps)
    times = np.array([s["sec"] + 1e-9 * s["nanosec"] for s in stamps])
    assert len(times) == 31 and times[-1] == 1.0 and np.all(np.diff(times) > 0.0)
    np.testing.assert_allclose([p["positions"] for p in points], curves.sample(times, 0), atol=1e-8)
    assert ("velocities" in points[0]) == (fields != "positions")
    assert written.read.interpolation == interpolation
    for order, name in enumerate(("positions", "velocities", "accelerations")):
        values = getattr(written.read, name)
        if values is not None:
            np.testing.assert_allclose(values, curves.sample(times, order), atol=1e-6)


def test_small_numbers_are_floats_for_yaml_as_well(write):
    text = (found := write("ros2")) and open(found.files[0]).read()
    assert re.search(r"\de-", text) and not re.search(r"[ \[-]\d+e-", text), "YAML 1.1 reads 1e-05 as a text"


def test_motion_at_the_last_point_is_told(write, curves):
    assert write("ros2", fields="positions").notes == ()
    ends = curves.sample(np.array([1.0]), 1)
    assert bool(write("ros2").notes) == bool(np.abs(ends).max() > 1e-6)


def test_a_table_has_rate_units_limits_and_the_rows(write, curves):
    comments, head, rows = table(write("csv", rate=200.0).files[0])
    assert comments[:4] == [
        "# shot: arm.usda", "# rate_hz: 200", "# player: linear",
        "# units: time s, angle rad, length m, torque N m, force N",
    ]  # fmt: skip
    assert "/Arm/Shoulder: velocity 2 rad/s, effort 8 N m" in comments[4]
    assert "/Arm/Elbow: lower -2 rad, upper 2 rad" in comments[5]
    assert head == ["time_s", "/Arm/Shoulder", "/Arm/Elbow"] and len(rows) == 201
    np.testing.assert_allclose(rows[:, 1:], curves.sample(rows[:, 0], 0), atol=1e-11)


def test_angles_of_a_table_may_be_degrees_and_digits_few(write):
    _, _, radians = table(write("csv").files[0])
    written = write("csv", angles="deg", digits=4)
    comments, _, degrees = table(written.files[0])
    np.testing.assert_allclose(degrees[:, 1:], np.degrees(radians[:, 1:]), rtol=1e-3)
    assert "lower -114.59" in comments[5]
    off = np.abs(written.read.positions - written.exact.positions).max()
    assert 1e-8 < off < 1e-4, "what is read back is rounded"


@pytest.mark.parametrize(("player", "columns"), [("linear", 3), ("cubic", 5), ("quintic", 7), ("hold", 3)])
def test_a_table_has_what_its_player_needs(write, player, columns):
    written = write("csv", player=player)
    _, head, _ = table(written.files[0])
    assert len(head) == columns and written.read.interpolation == player
    for name in ("positions", "velocities", "accelerations", "start"):
        exact, read = getattr(written.exact, name), getattr(written.read, name)
        assert (exact is None) == (read is None)
        if exact is not None:
            np.testing.assert_allclose(read, exact, rtol=1e-9, atol=1e-9)


def test_ticks_follow_resolution_direction_centre_and_offset(write, servos):
    written = write("ticks", file="show.json", motors=str(servos))
    content = json.loads(open(written.files[0]).read())
    ticks, exact = np.array(content["ticks"]), written.exact.positions
    expected = [1000 - exact[:, 0] * 4096 / (2 * np.pi), 2048 + (exact[:, 1] - np.radians(10.0)) * 4096 / (2 * np.pi)]
    assert np.abs(ticks - np.stack(expected, axis=1)).max() <= 0.5
    assert np.abs(written.read.positions - exact).max() <= 0.5 * 2 * np.pi / 4096 + 1e-12
    assert written.read.interpolation == "hold" and content["servos"][0]["id"] == 3


def test_a_held_command_is_early_by_what_holding_delays_it(write, curves, servos):
    exact = write("ticks", rate=200.0, motors=str(servos)).exact
    np.testing.assert_allclose(exact.positions[:-3], curves.sample(exact.times[:-3] + 0.005, 0))
    np.testing.assert_allclose(exact.start, curves.sample(np.zeros(1), 0)[0])


def test_a_compiler_takes_the_header(write, servos, tmp_path):
    written = write("ticks", file="2 shows.json", motors=str(servos))
    assert written.files[1].endswith("2 shows.h")
    program = tmp_path / "a.c"
    values = "_2_SHOWS_FRAMES, (int)_2_shows_at(7, 1), (int)_2_shows_start[0]"
    lines = [f'#include "{written.files[1]}"', "#include <stdio.h>", "int main(void)", "{"]
    program.write_text("\n".join([*lines, f'printf("%d %d %d", {values}); return 0;', "}", ""]))
    from shutil import which

    compiler = which("cc") or which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    subprocess.run([compiler, "-Wall", "-Werror", "-o", tmp_path / "a", program], check=True)
    printed = subprocess.run([tmp_path / "a"], capture_output=True, text=True, check=True).stdout
    content = json.loads(open(written.files[0]).read())
    assert printed == f"{len(content['ticks'])} {content['ticks'][7][1]} {content['start'][0]}"


def six_motors(curves):
    motors = tuple(dataclasses.replace(curves.motors[k % 2], path=f"/Arm/Joint{k}", joint=k) for k in range(6))
    names = (
        "wrist_2_joint",
        "shoulder_pan_joint",
        "elbow_joint",
        "shoulder_lift_joint",
        "wrist_1_joint",
        "wrist_3_joint",
    )
    turns = np.arange(1.0, 7.0)
    return dataclasses.replace(
        curves, motors=motors, names=names, limits=np.tile([-np.inf, np.inf], (6, 1)),
        sample=lambda times, order: curves.sample(times, order)[:, :1] * turns,
    )  # fmt: skip


def test_a_ur_program_has_the_joints_in_the_controllers_order_and_whole_cycles(write, curves):
    six = six_motors(curves)
    written = write("ur", rate=30.0, file="show.script", curves=six)
    lines = open(written.files[0]).read().splitlines()
    assert lines[0] == "def calmotion():" and lines[-2:] == ["  stopj(2.0)", "end"]
    rows = [re.fullmatch(r"  servoj\(\[(.*)\], 0, 0, ([\d.]+), 0\.03, 2000\)", line) for line in lines[3:-2]]
    assert all(rows)
    periods = np.array([float(row[2]) for row in rows])
    np.testing.assert_allclose(np.round(periods / 0.002), periods / 0.002, atol=1e-9)
    assert np.abs(np.cumsum(periods[:-1]) - np.arange(1, len(periods)) / 30.0).max() <= 0.001 + 1e-9
    # commands are ahead by lookahead time and half a period; base is the second motor, whose curve is twice the first
    sent = np.array([row[1].split(",") for row in rows], float)
    ahead = six.at(written.exact.times + 0.03 + 0.5 / 30.0)
    np.testing.assert_allclose(sent, ahead[:, [1, 3, 2, 4, 0, 5]], atol=1e-6)
    np.testing.assert_allclose(written.read.positions, ahead, atol=1e-6)
    assert written.exact.times[-1] > 1.0 + 0.2, "the commands go on until the robot stands"
    assert "law of servoj" in written.notes[0]
    moving = dataclasses.replace(six, sample=lambda times, order: six.sample(0.5 * times + 0.25, order))
    assert "begins in motion" in write("ur", file="b.script", curves=moving).notes[1]


def test_the_joints_of_a_ur_program_may_be_named(write, curves):
    six = six_motors(curves)
    plain = dataclasses.replace(six, names=tuple("abcdef"))
    named = write("ur", file="a.script", curves=plain, joints="f, e, d, c, b, /Arm/Joint0")
    first = re.search(r"movej\(\[(.*?)\]", open(named.files[0]).read())[1]
    np.testing.assert_allclose([float(x) for x in first.split(",")], plain.at(np.zeros(1))[0, ::-1], atol=1e-6)
    for joints, problem in (("f,e,d,c,b,b", "named once"), ("f,e,d,c,b,g", "no motor has this name")):
        with pytest.raises(ShotError, match=problem):
            write("ur", curves=plain, joints=joints)
    with pytest.raises(ShotError, match="six hinges"):
        write("ur")


def test_curves_of_bottango_are_whole_numbers_in_its_range(write, curves, tmp_path):
    (tmp_path / "motors.toml").write_text('[shoulder]\nid = "64"\nminimum = -90\nmaximum = 90\n')
    written = write("bottango", rate=10.0, file="show.txt", motors=str(tmp_path / "motors.toml"))
    rows = [line.split(",") for line in open(written.files[0]).read().splitlines()]
    assert {row[1] for row in rows} == {"64", "2"} and all(row[0] == "sC" and len(row) == 10 for row in rows)
    own = np.array([row[2:] for row in rows if row[1] == "64"], int)
    np.testing.assert_array_equal(own[:, 0], 100 * np.arange(10))
    expected = (curves.sample(own[:, 0] / 1e3, 0)[:, 0] + np.pi / 2.0) * 8192 / np.pi
    assert np.abs(own[:, 2] - expected).max() <= 0.5 + 1e-9
    ranges = json.loads(open(written.files[1]).read())["motors"]
    # without a range of its own the motor has the limits of its joint
    assert (ranges[1]["minimum"], ranges[1]["maximum"]) == (-2.0, 2.0)
    assert np.abs(written.read.positions - written.exact.positions).max() < 0.5 * np.pi / 8192 * 1.3
    for text, problem in (
        ("[shoulder]\nminimum = 0\nmaximum = 1\n", "leaves the range"), ("[knee]\n", "no motor has this name"),
        ("[elbow]\nid = 1\n", "the same id"), ("[elbow]\nmaximum = 'a'\n", "must be a number"), ("[", "cannot be read"),
    ):  # fmt: skip
        (tmp_path / "motors.toml").write_text(text)
        with pytest.raises(ShotError, match=problem):
            write("bottango", motors=str(tmp_path / "motors.toml"))


REFUSED = {
    "no file": (None, "no servos are named"),
    "not TOML": ("[a", "cannot be read"),
    "a motor without a table": ("[shoulder]\nresolution = 10\n", "motors without servos"),
    "an unknown motor": (SERVOS + "[knee]\nresolution = 1\n", "no motor has this name"),
    "an unknown entry": (SERVOS + "center = 3\n", "no such entry"),
    "no resolution": (SERVOS.replace("resolution = 4096", ""), "must be a number"),
    "a wrong direction": (SERVOS.replace("direction = -1", "direction = 2"), "out of range"),
    "a motion beyond the servo": (SERVOS.replace("minimum = 100", "minimum = 2000"), "leaves the range"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_servos_that_do_not_fit_are_refused(write, tmp_path, name):
    text, problem = REFUSED[name]
    file = tmp_path / "servos.toml"
    if text is not None:
        file.write_text(text)
    with pytest.raises(ShotError, match=problem) as refused:
        write("ticks", motors=str(file) if text is not None else "")
    assert refused.value.remedy or "knee" in str(refused.value.found)


@pytest.mark.parametrize("name", ["ros2", "csv"])
def test_a_file_that_cannot_be_written_is_refused(write, tmp_path, name):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(ShotError, match="cannot be written"):
        write(name, file="taken/commands")
    assert [path.name for path in tmp_path.iterdir()] == ["taken"] and os.path.isfile(tmp_path / "taken")


EXAMPLE = Path(__file__).resolve().parents[3] / "docs" / "three_plugins.md"


@pytest.fixture
def example(make_plugin):
    """The format of the page of examples, with parts of its source replaced."""
    source = re.findall(r"```python\n(.*?)```", EXAMPLE.read_text(), re.DOTALL)[2]

    return lambda part="", by="": make_plugin("xml_angles", source.replace(part, by))


def test_the_format_of_the_page_is_one_file(example, curves, tmp_path):
    assert check_plugin(folder := example()) == []
    request = ExportRequest("xml", 60.0, str(tmp_path / "a.xml"))
    (written,) = run_operator(host_with(folder), "export.xml", [curves, request])
    np.testing.assert_allclose(written.read.positions, curves.at(written.read.times), atol=0.51e-2 * np.pi / 180.0)
    assert len(written.read.times) == 61


@pytest.mark.parametrize(
    ("part", "by", "told"),
    [
        ("    def read(", "    def reads(", "lacks read"),
        ('    format = "xml"', "", "lacks format"),
        ("return (file,)", "return file", "write of the format xml returns no tuple of paths"),
        ("Commands(LINEAR, times, curves", 'Commands("lines", times, curves', "sampled .* 'lines' is none of hold"),
        ("Commands(LINEAR, times, values", 'Commands("cubic", times, values', "read .* cubic needs velocities"),
        ("values / per_unit(curves)", "(values / per_unit(curves))[:, :1]", r"read .* shape \[61, 1\]"),
        ("Commands(LINEAR, times, values", "Commands(LINEAR, times * 0.0, values", "read .* times do not increase"),
    ],
)
def test_a_format_that_is_wrong_is_told_what_is(example, curves, tmp_path, part, by, told):
    request = ExportRequest("xml", 60.0, str(tmp_path / "a.xml"))
    with pytest.raises(PluginError, match=told):
        run_operator(host_with(example(part, by)), "export.xml", [curves, request])
