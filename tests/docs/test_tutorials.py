"""Tutorials and guides, followed by their text alone in an empty folder."""

import json
import re

import numpy as np
import pytest
from calmotion.usd import read_shot
from followed import begun, blocks, errors_of, follow, needs_converters, run
from pages import REPOSITORY
from pxr import Usd, UsdGeom


@pytest.mark.long
def test_the_quickstart(tmp_path):
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / "samples").symlink_to(REPOSITORY / "samples")
    printed = follow("./quickstart", tmp_path)
    assert errors_of(printed) == [pytest.approx((58.17, 1.41), abs=0.02)]
    lowest = [float(value) for value in re.findall(r"([\d.]+) Hz \(0\.01", printed)[:2]]
    assert lowest == pytest.approx([5.0, 5.0], rel=0.1), "as on the page"
    assert (tmp_path / "work" / "build" / "calm.html").stat().st_size > 500_000


def test_a_public_recording_sticks_as_its_authors_say(tmp_path, shared_data):
    """The log is made from the tables that were made from it, where they are."""
    record = shared_data / "measured" / "xl330_pendulum" / "sin_sin_kp100"
    if not record.with_suffix(".csv").is_file():
        pytest.skip("the records of real machines are not there")
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


def test_a_robot_is_imported_as_the_page_says(tmp_path):
    needs_converters()
    begun("urdf", "calmotion import", tmp_path)
    (before, after), *_ = errors_of(follow("./importing", tmp_path))
    assert after < 0.5 * before
    source = "\n".join(blocks("./importing", "python"))
    run(f"python3 - <<'END'\n{source}\nEND\n", tmp_path, tmp_path / "work")
    assert (tmp_path / "work" / "from_python.usda").is_file()


@pytest.mark.long
def test_commands_of_a_controller_are_written_as_the_page_says(tmp_path):
    printed = follow("./exporting", tmp_path)
    loss = re.search(r"Playing the commands costs up to ([\d.]+) mm", printed)
    assert float(loss[1]) < 2.0 and "The lowest rate that keeps it" in printed
    assert "joint_names" in (tmp_path / "work" / "calmotion_demo" / "trajectory.yaml").read_text()


@pytest.mark.long
def test_trouble_is_found_as_the_page_says(tmp_path):
    pytest.importorskip("calmotion_plugins.calibration")
    begun("calibration", "calmotion calibrate", tmp_path)
    printed = follow("./troubleshooting", tmp_path)
    assert "The flexible links explain 99% of the error" in printed and "usd-core" in printed
    assert "xformOp:transform:calmotion.timeSamples" in (tmp_path / "work" / "calm.usda").read_text()


@pytest.mark.long
def test_a_puppeteer(tmp_path):
    printed = follow("puppeteer", tmp_path)
    rest = json.loads(printed.splitlines()[-1])
    assert rest["joints"]["/Bartender/Joints/Elbow"] == pytest.approx(-0.9, abs=0.02) and rest["late"] == 0
    assert "as sent" in printed
    assert (tmp_path / "work" / "live.rrd").stat().st_size > 100_000
