"""Tutorials and how-to pages, followed by their text alone: the shell blocks of each page, in an empty folder."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
DOCS = REPOSITORY / "docs"
PAGES = DOCS / "tutorials"
FOLLOWED = (
    "usd", "urdf", "animated_parts", "skinned_character", "calibration", "two_workers", "puppeteer", "diagnosis",
)  # fmt: skip
HOW_TO = (
    "arduino", "phone", "weights", "remaining_error", "offline_or_live", "slow_motors", "diagnose", "shows", "workers",
    "clips",
)  # fmt: skip
OTHERS = ("./quickstart", "./importing", "./troubleshooting", "./exporting")
# What newcomers want to do, and the page that is enough for it: all of them are followed below.
TASKS = {
    "see it work, and show it in a browser": "./quickstart",
    "make a robot of a URDF calm": "tutorials/urdf",
    "make a robot in USD calm": "tutorials/usd",
    "make a robot of animated parts": "tutorials/animated_parts",
    "make a robot of a skinned character": "tutorials/skinned_character",
    "play the result on an Arduino": "how_to/arduino",
    "say which target counts when": "how_to/weights",
    "find out why error remains": "how_to/remaining_error",
    "keep slow motors within their limits": "how_to/slow_motors",
    "find out what shakes": "how_to/diagnose",
    "make the model fit the robot": "tutorials/calibration",
    "import a robot": "./importing",
    "write commands for a controller": "./exporting",
    "find the cause of what looks wrong": "./troubleshooting",
    "optimise many shots": "how_to/shows",
    "use several machines": "how_to/workers",
    "play clips in any order": "how_to/clips",
}


def script(page: str) -> str:
    """The shell blocks of a page, one after the other."""
    return "\n".join(blocks(page, "sh"))


def blocks(page: str, language: str) -> list[str]:
    """The blocks of a page in a language; a page is a tutorial, or has its folder in its name."""
    text = (DOCS / f"{page if '/' in page else f'tutorials/{page}'}.md").read_text()
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def follow(page: str, folder: Path) -> str:
    """Run a page in an empty folder, or one with the files of `begun`; what it printed."""
    (folder / "work").mkdir(exist_ok=True)
    return run(script(page), folder, folder / "work")


def run(commands: str, folder: Path, work: Path) -> str:
    """Run commands with `calmotion` and `python3` on the path, in `folder / "tools"`; what they printed."""
    tools = folder / "tools"
    tools.mkdir(exist_ok=True)
    for name, command in {"python3": "", "calmotion": "-m calmotion "}.items():
        file = tools / name
        file.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {command}"$@"\n')
        file.chmod(0o755)
    environment = os.environ | {
        "PATH": os.pathsep.join(map(str, (tools, Path(sys.executable).parent, os.environ["PATH"]))),
        "PYTHONPATH": str(REPOSITORY / "pipeline"),
    }  # fmt: skip
    done = subprocess.run(
        ["bash", "-e", "-c", commands], cwd=work, env=environment, capture_output=True, text=True, timeout=3600
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def begun(page: str, end: str, folder: Path) -> None:
    """Make the files of a page in the working folder of another one: its blocks before that with the words `end`."""
    (folder / "work").mkdir()
    before = script(page).split(end)[0]
    run(before[: before.rindex("\n") + 1], folder, folder / "work")


def errors_of(printed: str) -> list[tuple[float, float]]:
    """Largest errors before and after, of each report of `optimize`, in mm."""
    found = re.findall(r"The largest error falls from ([\d.]+) mm to ([\d.]+) mm", printed)
    return [(float(before), float(after)) for before, after in found]


def linked(page: Path) -> set[Path]:
    """The pages that a page leads to."""
    targets = re.findall(r"\]\(([\w./-]+\.md)", page.read_text())
    return {path for target in targets if (path := (page.parent / target).resolve()).is_file()}


@pytest.mark.parametrize("page", TASKS.values(), ids=TASKS)
@pytest.mark.parametrize("front", [REPOSITORY / "README.md", DOCS / "index.md"], ids=lambda front: front.name)
def test_a_task_of_a_newcomer_is_found_in_two_clicks_and_followed(page, front):
    first = linked(front)
    assert (DOCS / f"{page}.md").resolve() in first.union(*map(linked, first))
    assert f'follow("{page.removeprefix("tutorials/")}", ' in Path(__file__).read_text()


@pytest.mark.parametrize("page", [*FOLLOWED, *OTHERS, *(f"how_to/{page}" for page in HOW_TO)])
def test_the_commands_of_a_page_are_accepted(page, capsys):
    from calmotion.cli.commands.table import all_commands
    from calmotion.cli.main import build_parser

    text = re.sub(r"<<'END'\n.*?\nEND\n", "\n", script(page), flags=re.DOTALL)
    lines = [line for line in text.splitlines() if line.startswith("calmotion ")]
    assert len(lines) >= 2
    if absent := {line.split()[1] for line in lines if all_commands()[line.split()[1]].disabled}:
        pytest.skip(f"the plugins that bring {', '.join(absent)} are not there")
    for line in lines:
        try:
            build_parser().parse_args(shlex.split(re.split(" [<>] ", line)[0])[1:])
        except SystemExit:
            pytest.fail(f"{line}: {capsys.readouterr().err}")


def test_every_tutorial_is_listed_and_tested():
    listed = re.findall(r"\]\(([\w./]+)\.md\)", (PAGES / "index.md").read_text())
    assert set(listed) >= {path.stem for path in PAGES.glob("*.md")} - {"index"}
    # the others are tested by test_tutorial.py, test_guide.py and below
    of_blender = {"blender", "blender_macos", "blender_windows"}
    assert {path.stem for path in PAGES.glob("*.md")} == {"index", *of_blender, *FOLLOWED}


def test_the_page_on_blender_names_what_the_extension_shows():
    text = (PAGES / "blender.md").read_text()
    sources = "".join(path.read_text() for path in (REPOSITORY / "plugins" / "blender").glob("*.py"))
    shown = {*re.findall(r'(?:bl_label|bl_category|name|COLLECTION)\s*=\s*"([^"]+)"', sources)}
    of_others = {"Animation", "Armatures", "Scripting", "Run Script", "Compress", "Clear Constraints"}
    named = set(re.findall(r"\*([A-Z][\w ()]+)\*", text)) - of_others
    assert len(named) >= 4 and named <= shown


@pytest.mark.long
def test_the_quickstart(tmp_path):
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / "samples").symlink_to(REPOSITORY / "samples")
    printed = follow("./quickstart", tmp_path)
    assert errors_of(printed) == [pytest.approx((58.17, 1.41), abs=0.02)]
    lowest = [float(value) for value in re.findall(r"([\d.]+) Hz \(0\.01", printed)[:2]]
    assert lowest == pytest.approx([5.0, 5.0], rel=0.1), "as on the page"
    assert (tmp_path / "work" / "build" / "calm.html").stat().st_size > 500_000


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


def test_a_public_recording_sticks_as_its_authors_say(tmp_path, shared_data):
    """The log is made from the tables that were made from it, where they are."""
    record = shared_data / "measured" / "xl330_pendulum" / "sin_sin_kp100"
    if not record.with_suffix(".csv").is_file():
        pytest.skip("the records of real machines are not there")
    from calmotion.usd import read_shot

    track = read_shot(str(record.with_suffix(".usda")))[1].tracks[0]
    times, angles = np.loadtxt(record.with_suffix(".csv"), delimiter=",", skiprows=1, unpack=True)
    asked = np.interp(times, track.times, track.values)
    entries = [
        {"timestamp": float(t), "goal_position": float(goal), "position": float(angle)}
        for t, goal, angle in zip(times - 0.5, asked, angles, strict=True)  # half a second of rest was put in front
    ]
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / "servo.json").write_text(json.dumps({"entries": entries}))
    printed = follow("diagnosis", tmp_path)
    assert printed.count("explains") == 2 and "An unknown cause explains 100%" in printed
    cause = json.loads((tmp_path / "work" / "diagnosis.json").read_text())["causes"][0]
    assert cause["cause"] == "friction" and cause["share"] == pytest.approx(0.79, abs=0.03)


@pytest.mark.long
def test_a_robot_from_usd(tmp_path):
    printed = follow("usd", tmp_path)
    before, after = errors_of(printed)[0]
    assert after < 0.5 * before
    assert (tmp_path / "work" / "calm_root.usda").is_file() and (tmp_path / "work" / "shake.csv").is_file()


@pytest.mark.long
def test_a_robot_from_urdf(tmp_path):
    needs_converters()
    printed = follow("urdf", tmp_path)
    (before, after), *_ = errors_of(printed)
    assert 4.0 < before < 9.0 and after < 2.0
    assert "The lowest rate that keeps it: " in printed
    assert "joint_names: ['turn', 'lift']" in (tmp_path / "work" / "trajectory.yaml").read_text()


@pytest.mark.long
def test_a_robot_of_animated_parts(tmp_path):
    """The result is in the Xforms: the head goes where the motors lead it, not where it was animated."""
    printed = follow("animated_parts", tmp_path)
    before, after = errors_of(printed)[0]
    assert after < 0.1 * before
    from pxr import Usd, UsdGeom

    places = []
    for name in ("lamp.usda", "calm_root.usda"):
        stage = Usd.Stage.Open(str(tmp_path / "work" / name))
        head = stage.GetPrimAtPath("/Lamp/Foot/Stalk/Arm/Head")
        places.append(np.array(UsdGeom.XformCache(12).GetLocalToWorldTransform(head).ExtractTranslation()))
    assert 1e-3 < np.linalg.norm(places[1] - places[0]) < 0.1


@pytest.mark.long
def test_a_skinned_character(tmp_path):
    pytest.importorskip("pxr")
    printed = follow("skinned_character", tmp_path)
    before, after = errors_of(printed)[0]
    assert after < 0.5 * before
    assert "rotations" in (tmp_path / "work" / "calm.usda").read_text()


@pytest.mark.long
def test_a_calibration(tmp_path):
    pytest.importorskip("calmotion_plugins.calibration")
    printed = follow("calibration", tmp_path)
    assert errors_of(printed)
    from pxr import Usd

    stage = Usd.Stage.Open(str(tmp_path / "work" / "mine_root.usda"))
    modulus = stage.GetPrimAtPath("/Robot/ABS").GetAttribute("physics:youngsModulus").Get()
    assert modulus == pytest.approx(1.6e9, rel=0.01)  # three standard deviations


@pytest.mark.long
def test_a_show_on_two_workers(tmp_path):
    pytest.importorskip("distributed")
    follow("two_workers", tmp_path)
    for folder in ("calm", "farm"):
        jobs = json.loads((tmp_path / "work" / folder / "batch.json").read_text())["jobs"]
        assert len(jobs) == 2 and all(job["outcome"] in ("done", "kept") for job in jobs)


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


def test_a_robot_is_imported_as_the_page_says(tmp_path):
    needs_converters()
    begun("urdf", "calmotion import", tmp_path)
    (before, after), *_ = errors_of(follow("./importing", tmp_path))
    assert after < 0.5 * before
    source = "\n".join(blocks("./importing", "python"))
    run(f"python3 - <<'END'\n{source}\nEND\n", tmp_path, tmp_path / "work")
    assert (tmp_path / "work" / "from_python.usda").is_file()


def test_commands_of_a_controller_are_written_as_the_page_says(tmp_path):
    printed = follow("./exporting", tmp_path)
    loss = re.search(r"Playing the commands costs up to ([\d.]+) mm", printed)
    assert float(loss[1]) < 2.0 and "The lowest rate that keeps it" in printed
    assert "joint_names" in (tmp_path / "work" / "calmotion_demo" / "trajectory.yaml").read_text()


def test_trouble_is_found_as_the_page_says(tmp_path):
    pytest.importorskip("calmotion_plugins.calibration")
    begun("calibration", "calmotion calibrate", tmp_path)
    printed = follow("./troubleshooting", tmp_path)
    assert "The flexible links explain 99% of the error" in printed and "usd-core" in printed
    assert "xformOp:transform:calmotion.timeSamples" in (tmp_path / "work" / "calm.usda").read_text()


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
    printed = " ".join(follow("how_to/remaining_error", tmp_path).split())
    for line in re.findall(r"^ {4}(\S.*)", (DOCS / "how_to" / "remaining_error.md").read_text(), re.MULTILINE):
        assert line.split(",")[0] in printed, line
    assert printed.endswith("[('/Bartender/UpperArm/ElbowTarget', ['motors'])]")


@pytest.mark.long
def test_offline_and_live_play_the_same_robot(tmp_path):
    follow("how_to/offline_or_live", tmp_path)
    work = tmp_path / "work" / "calmotion_demo"
    assert len((work / "commands.jsonl").read_text().splitlines()) > 900 and (work / "show.csv").is_file()


@pytest.mark.long
def test_a_phone_shows_the_modulus_of_an_arm(tmp_path):
    import calmotion as cm
    import numpy as np
    from calmotion.support import rotation_from_quaternion

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
    from pxr import Usd

    stage = Usd.Stage.Open(str(work / "mine.usda"))
    assert not stage.GetPrimAtPath(path)
    modulus = stage.GetPrimAtPath("/Robot/ABS").GetAttribute("physics:youngsModulus").Get()
    assert modulus == pytest.approx(1.6e9, rel=0.03)


@pytest.mark.long
def test_a_puppeteer(tmp_path):
    printed = follow("puppeteer", tmp_path)
    rest = json.loads(printed.splitlines()[-1])
    assert rest["joints"]["/Bartender/Joints/Elbow"] == pytest.approx(-0.9, abs=0.02) and rest["late"] == 0
    assert "as sent" in printed
    assert (tmp_path / "work" / "live.rrd").stat().st_size > 100_000


def needs_converters():
    converters = pytest.importorskip("calmotion_plugins.robot_import.converters")
    variable = converters.VARIABLE
    if not os.environ.get(variable) and not (converters.environment_folder() / "ready").is_file():
        pytest.skip(
            f"the converters are not here: name their environment with {variable}, or run calmotion import once"
        )
