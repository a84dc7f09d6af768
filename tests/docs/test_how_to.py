"""How-to pages, followed by their text alone in an empty folder."""

import json
import re
import shutil
import subprocess

import calmotion as cm
import numpy as np
import pytest
from calmotion.support import rotation_from_quaternion
from followed import DOCS, blocks, follow, script
from pxr import Usd


@pytest.mark.long
def test_slow_motors_get_the_time_that_the_page_says(tmp_path):
    printed = follow("how_to/slow_motors", tmp_path)
    for line in re.search(r"```text\n(The performance .*?)```", (DOCS / "how_to/slow_motors.md").read_text(), re.S)[
        1
    ].splitlines():
        assert line in printed
    assert (tmp_path / "work" / "calmotion_demo" / "slow" / "tempo.png").is_file()


def test_the_loop_of_the_page_is_what_shakes(tmp_path):
    follow("how_to/diagnose", tmp_path)
    first = json.loads((tmp_path / "work" / "diagnosis.json").read_text())["causes"][0]
    assert first["cause"] == "servo_gains" and first["share"] > 0.9
    assert "rings at 5" in (tmp_path / "work" / "diagnosis.html").read_text()


@pytest.mark.long
def test_many_shots_are_optimised_and_can_be_published(tmp_path):
    printed = follow("how_to/shows", tmp_path)
    assert printed.count("can be published") == 2
    assert "27.23 mm" in (tmp_path / "work" / "calmotion_demo" / "batch.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_other_machines_make_the_same_files(tmp_path):
    pytest.importorskip("distributed")
    if shutil.which("openjd") is None:
        pytest.skip("openjd-cli is not here")
    follow("how_to/workers", tmp_path)
    work = tmp_path / "work" / "calmotion_demo"
    for name in ("bartender_calm.usda", "half_calm.usda"):
        curves = [
            "".join(line for line in (work / folder / name).read_text().splitlines() if "timeSamples" in line)
            for folder in ("calm", "farm")
        ]
        assert curves[0] == curves[1] != ""


@pytest.mark.long
def test_clips_follow_one_another_as_the_page_says(tmp_path):
    printed = follow("how_to/clips", tmp_path)
    assert "Every clip may follow every other one." in printed
    rows = re.search(r"```text\n(.*?)```", (DOCS / "how_to" / "clips.md").read_text(), re.DOTALL)[1].splitlines()
    assert len(rows) == 5
    for row in rows[1:]:
        name = row.split("  ")[0]
        line = next(line for line in printed.splitlines() if line.startswith(f"{name}  "))
        found, told = (re.findall(r"([\d.]+) (?:s|mm)", text) for text in (line, row))
        assert [float(value) for value in found] == pytest.approx([float(value) for value in told], rel=0.03), row
    assert (tmp_path / "work" / "calmotion_demo" / "pour_to_slow.csv").is_file()


SKETCHES = {
    "Arduino.h": """
#include <stdint.h>
uint32_t micros();
void delay(uint32_t milliseconds);
""",
    "Servo.h": """
struct Servo { void attach(int pin, int least, int most); void writeMicroseconds(int pulse); };
""",
    "Adafruit_PWMServoDriver.h": """
struct Adafruit_PWMServoDriver {
  void begin(); void setPWMFreq(float rate); void setPWM(uint8_t n, uint16_t on, uint16_t off);
};
""",
    "avr/pgmspace.h": """
#include <string.h>
#define PROGMEM
#define memcpy_P memcpy
""",
}  # libraries in name alone: what the sketches call


@pytest.mark.long
def test_a_sketch_of_an_arduino_plays_what_is_exported(tmp_path):
    compiler = shutil.which("c++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    printed = follow("how_to/arduino", tmp_path)
    work = tmp_path / "work" / "calmotion_demo"
    losses = [float(loss) for loss in re.findall(r"Playing the commands costs up to ([\d.]+) mm", printed)]
    assert losses == pytest.approx([4.0, 2.2], abs=0.1), "as on the page"
    for name, text in SKETCHES.items():
        (work / name).parent.mkdir(exist_ok=True)
        (work / name).write_text(text)
    for sketch in blocks("how_to/arduino", "cpp"):
        for board in ([], ["-D__AVR__"]):
            command = [
                compiler,
                "-fsyntax-only",
                "-Wall",
                "-Werror",
                "-Wno-sign-compare",
                "-x",
                "c++",
                "-include",
                "Arduino.h",
                *board,
            ]
            subprocess.run([*command, "-I", work, "-"], input=sketch, text=True, check=True)


@pytest.mark.long
def test_weights_over_time_make_better_what_the_audience_looks_at(tmp_path):
    printed = follow("how_to/weights", tmp_path)
    found = [float(size) for size in re.findall(r"s: ([\d.]+) mm", printed)]
    assert found == pytest.approx([5.50, 1.41, 4.76, 0.92], abs=0.03), "as on the page"


@pytest.mark.long
def test_why_error_remains_is_answered_with_a_goal(tmp_path):
    def rounded(text):
        """To 0.01 mm: the last digit of a search is one of rounding."""
        return re.sub(r"(\d\.\d\d)\d mm", r"\1 mm", text)

    printed = " ".join(follow("how_to/remaining_error", tmp_path).split())
    for line in re.findall(r"^ {4}(\S.*)", (DOCS / "how_to" / "remaining_error.md").read_text(), re.MULTILINE):
        assert rounded(line.split(",")[0]) in rounded(printed), line
    assert printed.endswith("[('/Bartender/UpperArm/ElbowTarget', ['motors'])]")


@pytest.mark.long
def test_offline_and_live_play_the_same_robot(tmp_path):
    follow("how_to/offline_or_live", tmp_path)
    work = tmp_path / "work" / "calmotion_demo"
    assert len((work / "commands.jsonl").read_text().splitlines()) > 900 and (work / "show.csv").is_file()


@pytest.mark.long
def test_a_phone_shows_the_modulus_of_an_arm(tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    robot, shot = re.findall(r"<<'END'\n(.*?)END\n", script("calibration"), re.DOTALL)[:2]
    (work / "robot.usda").write_text(robot)
    (work / "shot.usda").write_text(shot)
    phone = re.search(r"<<'END'\n(.*?)END\n", script("how_to/phone"), re.DOTALL)[1]
    real = phone.replace('"PhysicsMassAPI"]', '"PhysicsMassAPI", "CalmTargetAPI"]')
    softer = 'over "ABS"\n{\nfloat physics:youngsModulus = 1.6e9\nfloat calm:damping:ratio = 0.04\n}\n}\n'
    real = real[: real.rindex("}")] + softer
    (work / "real.usda").write_text(real)
    result = cm.simulate(work / "real.usda", step="0.5ms", tolerance="0.2mm")
    path = "/Robot/Phone"
    times, motion = result.times, result.targets[path]
    acceleration = np.gradient(np.gradient(motion.position, times, axis=0), times, axis=0) + [0.0, 0.0, 9.81]
    own = np.einsum("tji,tj->ti", rotation_from_quaternion(motion.orientation), acceleration)
    own += 0.02 * np.random.default_rng(3).standard_normal(own.shape)
    names = ["Time (s)", *(f"Acceleration {axis} (m/s^2)" for axis in "xyz")]
    table = np.column_stack([times, own])[20:-20:5]
    np.savetxt(work / "take.csv", table, delimiter=",", header=",".join(f'"{name}"' for name in names), comments="")
    follow("how_to/phone", tmp_path)
    stage = Usd.Stage.Open(str(work / "mine.usda"))
    assert not stage.GetPrimAtPath(path)
    modulus = stage.GetPrimAtPath("/Robot/ABS").GetAttribute("physics:youngsModulus").Get()
    assert modulus == pytest.approx(1.6e9, rel=0.03)
