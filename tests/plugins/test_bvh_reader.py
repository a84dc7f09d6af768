"""BVH motions onto motors."""

import json

import numpy as np
import pytest
import small_shots as shots  # noqa: E402
from calmotion.errors import ShotError
from calmotion.host import Host, SettingError
from calmotion.model import MotorTracks
from calmotion.model.run import Source
from calmotion.testing import host_with, run_operator

HEAD = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Arm
  {
    OFFSET 0 1 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 1 0
    }
  }
}
MOTION
"""
FRAMES = 48
TIMES = np.arange(FRAMES) / 24.0


def bvh(path, arm=None, frames=FRAMES):
    arm = 20.0 * np.sin(TIMES) if arm is None else arm
    rows = [f"{100 * np.cos(t):.9f} 90 0 0 0 0 {angle:.9f} 5 0" for t, angle in zip(TIMES, arm, strict=True)]
    path.write_text(HEAD + f"Frames: {frames}\nFrame Time: {1 / 24:.12f}\n" + "\n".join(rows) + "\n")
    return path


@pytest.fixture
def read(repository):
    def run(path, **settings):
        host = host_with(repository / "plugins" / "bvh_reader")
        source = Source(path="robot.usda", command="optimize", motion=str(path))
        (found,) = run_operator(host, "bvh.read", [source], {"bvh.read": settings})
        assert isinstance(found, MotorTracks)
        return found

    return run


def test_bones_with_spaces_and_dots_are_named_as_in_the_file(read, tmp_path):
    path = bvh(tmp_path / "a.bvh")
    path.write_text(path.read_text().replace("JOINT Arm", "JOINT Upper Arm.L"))
    for name in ("Upper Arm.L", "UpperArm.L"):
        found = read(path, map=f"{name}.Zrotation=shoulder*2")
        assert found.values["shoulder"] == pytest.approx(2.0 * np.radians(20.0 * np.sin(TIMES)), abs=1e-9)


@pytest.mark.parametrize("frame_time", ["0.0417", "0.041667", "0.0416667", "0.04166667"])
def test_a_rounded_frame_time_loses_no_row(read, tmp_path, repository, frame_time):
    path = bvh(tmp_path / "a.bvh")
    path.write_text(path.read_text().replace(f"{1 / 24:.12f}", frame_time))
    assert read(path, map="Arm.Zrotation=shoulder").times == pytest.approx(TIMES, abs=1e-12)


def test_channels_become_tracks_with_factor_and_offset(read, tmp_path):
    found = read(bvh(tmp_path / "a.bvh"), map="Arm.Zrotation=/Arm/shoulder*-0.5+90deg, Arm.Xrotation = elbow")
    assert np.allclose(found.times, TIMES)
    assert np.allclose(found.values["/Arm/shoulder"], np.pi / 2 - 0.5 * np.radians(20.0 * np.sin(TIMES)), atol=1e-9)
    assert np.allclose(found.values["elbow"], np.radians(5.0))


def test_a_byte_order_mark_is_no_part_of_the_motion(read, tmp_path):
    path = bvh(tmp_path / "a.bvh")
    path.write_text("\ufeff" + path.read_text(), encoding="utf-8")
    assert np.allclose(read(path, map="Arm.Xrotation=elbow").values["elbow"], np.radians(5.0))


def test_positions_are_lengths(read, tmp_path):
    found = read(bvh(tmp_path / "a.bvh"), map="Hips.Xposition=slide+20mm", unit="1cm")
    assert np.allclose(found.values["slide"], np.cos(TIMES) + 0.02, atol=1e-8)


@pytest.mark.parametrize(
    ("old", "new"),
    [("HIERARCHY", "\n\nHIERARCHY"), ("JOINT Arm\n  {", "JOINT Arm {"), ("rotation", "ROTATION"), ("\n", "\r\n"),
     ("Frame Time: ", "Frame  Time:\t"), ("End Site", "End Site of the arm"), (" ", "\t"), ("HIERARCHY", "Hierarchy")],
)  # fmt: skip
def test_files_of_other_exporters_are_the_same_motion(read, tmp_path, old, new):
    path = bvh(tmp_path / "a.bvh")
    text = path.read_text().replace(old, new).replace("Frame\tTime", "Frame Time")
    path.write_bytes(text.encode())
    assert np.allclose(read(path, map="Arm.Xrotation=a, Arm.Zrotation=b").values["a"], np.radians(5.0))


def test_what_a_mapping_loses_is_told(repository, tmp_path):
    path = bvh(tmp_path / "a.bvh")
    host = host_with(repository / "plugins" / "bvh_reader")

    def told(mapping):
        source = Source(path="robot.usda", command="optimize", motion=str(path))
        run = Host.run(host, [source], (MotorTracks,), settings={"bvh.read": {"map": mapping}}).finish()
        return " ".join(record.text for record in run.results[-1].records)

    lost = f"leaves out {np.ptp(20.0 * np.sin(TIMES)):.3g} deg of Arm.Zrotation"
    assert lost in told("Arm.Xrotation=a") and "leaves out" not in told("Arm.Zrotation=a")  # X and Y stand still
    assert "Arm turns by Zrotation, then Yrotation" in told("Arm.Yrotation=a, Arm.Zrotation=b")
    assert "0.01 m (bvh.read.unit)" in told("Hips.Xposition=a") and "bvh.read.unit" not in told("Arm.Zrotation=a")


def test_angles_that_jump_by_a_turn_are_unwrapped(read, tmp_path):
    turning = 30.0 * np.arange(FRAMES)
    found = read(bvh(tmp_path / "a.bvh", (turning + 180.0) % 360.0 - 180.0), map="Arm.Zrotation=wheel")
    assert np.allclose(found.values["wheel"], np.radians(turning))


def test_a_shot_may_begin_later_in_the_motion(read, tmp_path):
    assert read(bvh(tmp_path / "a.bvh"), map="Arm.Zrotation=a", start="500ms").times[0] == -0.5
    with pytest.raises(ShotError, match="ends before"):
        read(bvh(tmp_path / "a.bvh"), map="Arm.Zrotation=a", start="5s")


@pytest.mark.parametrize(
    ("mapping", "problem", "remedy"),
    [
        ("", "no motor is driven", "Arm.Zrotation"),
        ("Arm.Zrotaton=a", "no such channel", "Did you mean Arm.Zrotation?"),
        ("Arm.Zrotation", "not an entry of a mapping", "*-1+90deg"),
        ("Arm.Zrotation=a*x", "not an entry of a mapping", "*-1+90deg"),
        ("Arm.Zrotation=a+90", "the offset has no unit", "Write 90deg or 90rad"),
        ("Arm.Zrotation=a+3mm", "not an entry of a mapping", "unit"),
        ("Arm.Zrotation=a,Arm.Xrotation=a", "two channels drive one motor", ""),
    ],
)
def test_a_wrong_mapping_is_refused_with_what_there_is(read, tmp_path, mapping, problem, remedy):
    with pytest.raises(SettingError, match=problem) as refused:
        read(bvh(tmp_path / "a.bvh"), map=mapping)
    assert refused.value.path == "bvh.read.map" and remedy in refused.value.remedy


BROKEN = {
    "empty": "",
    "not BVH": "solid cube",
    "no motion": HEAD.replace("MOTION\n", ""),
    "no frames": HEAD,
    "frames that are missing": HEAD + "Frames: 2\nFrame Time: 0.04\n0 0 0 0 0 0 0 0 0\n",
    "a row that is short": HEAD + "Frames: 1\nFrame Time: 0.04\n0 0 0\n",
    "a row that is no number": HEAD + "Frames: 1\nFrame Time: 0.04\n0 0 0 0 0 x 0 0 0\n",
    "a value that is not finite": HEAD + "Frames: 1\nFrame Time: 0.04\n0 0 0 0 0 nan 0 0 0\n",
    "a frame time of zero": HEAD + "Frames: 1\nFrame Time: 0\n0 0 0 0 0 0 0 0 0\n",
    "a number of frames that is none": HEAD + "Frames: nan\nFrame Time: 0.04\n0 0 0 0 0 0 0 0 0\n",
    "a frame time without end": HEAD + "Frames: 1\nFrame Time: inf\n0 0 0 0 0 0 0 0 0\n",
    "a channel that is none": HEAD.replace("3 Zrotation", "3 Wrotation") + "Frames: 0\nFrame Time: 0.04\n",
    "a wrong number of channels": HEAD.replace("3 Zrotation", "4 Zrotation") + "Frames: 0\nFrame Time: 0.04\n",
    "a name that comes twice": HEAD.replace("JOINT Arm", "JOINT Hips") + "Frames: 0\nFrame Time: 0.04\n",
}


@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN.keys())
def test_a_broken_file_is_refused_by_its_line(read, tmp_path, text):
    (tmp_path / "a.bvh").write_text(text)
    with pytest.raises(ShotError) as refused:
        read(tmp_path / "a.bvh", map="Arm.Zrotation=a")
    assert refused.value.path.endswith("a.bvh") and refused.value.attribute.startswith("line")


def test_a_robot_performs_a_motion_capture(calmotion, tmp_path):
    def still(stage):
        for path in (shots.SHOULDER, shots.ELBOW):
            stage.GetPrimAtPath(path).GetAttribute(shots.TARGET_POSITION).Clear()
        stage.GetPrimAtPath(shots.ELBOW).GetAttribute(shots.TARGET_POSITION).Set(10.0)
        shots.make_flexible(stage, youngsModulus=4e7)
        shots.make_target(stage)

    shot = shots.write_arm(tmp_path / "arm.usda", still)
    bvh(tmp_path / "wave.bvh")
    done = calmotion(
        "optimize", shot, "-o", tmp_path / "calm.usda", "--json", "--motion", tmp_path / "wave.bvh",
        "--set", "bvh.read.map=Arm.Zrotation=shoulder", "--set", "retarget.optimize.max_iterations=2",
        "--step", "10ms", "--csv", tmp_path / "table.csv",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["max_error_after_m"] < report["max_error_before_m"]
    table = np.genfromtxt(tmp_path / "table.csv", delimiter=",", names=True, deletechars="", replace_space=" ")
    times = TIMES[TIMES <= table["time_s"][-1]]
    shoulder = np.interp(times, table["time_s"], table[f"{shots.SHOULDER}.output"])
    assert np.abs(shoulder - np.radians(20.0 * np.sin(times))).max() < 0.05


def test_a_motion_that_no_plugin_reads_is_refused_before_the_work(calmotion, tmp_path):
    shot = shots.write_arm(tmp_path / "arm.usda")
    done = calmotion("simulate", shot, "--motion", "wave.fbx")
    assert done.returncode == 2 and ".bvh" in done.stderr


def test_a_motor_that_no_joint_is_is_refused_with_the_file(calmotion, tmp_path):
    shot = shots.write_arm(tmp_path / "arm.usda")
    bvh(tmp_path / "wave.bvh")
    done = calmotion("simulate", shot, "--motion", tmp_path / "wave.bvh", "--set", "bvh.read.map=Arm.Zrotation=knee")
    assert done.returncode == 1 and "no joint of the robot has this name" in done.stderr and "knee" in done.stderr
