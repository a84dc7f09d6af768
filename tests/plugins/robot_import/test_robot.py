"""A robot's file becomes a shot: with a converter in place of the real one, and with the real ones where they are."""

import json
import os
import subprocess
import sys
from pathlib import Path

import calmotion as cm
import numpy as np
import pytest
from calmotion_plugins.robot_import import import_robot
from calmotion_plugins.robot_import import robot as importing
from calmotion_plugins.robot_import.converters import VARIABLE, environment_folder, temporary_folder
from calmotion_plugins.robot_import.robot import flexible_links, frames_per_second
from converted_arm import CONVERTED, ELBOW, PAN

BOX = '<visual><geometry><box size="0.4 0.04 0.04"/></geometry><origin xyz="0.2 0 0"/></visual>'
INERTIAL = (
    '<inertial><mass value="1"/><origin xyz="0.2 0 0"/>'
    '<inertia ixx="0.001" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
)
LINKS = f'<link name="upper-arm">{BOX}{INERTIAL}</link><link name="fore.arm">{BOX}</link>'
URDF = f"""<robot name="arm"><link name="base"/>{LINKS}<link name="tool0"/>
<joint name="shoulder-pan" type="revolute"><parent link="base"/><child link="upper-arm"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="20" velocity="3"/></joint>
<joint name="elbow" type="continuous"><parent link="upper-arm"/><child link="fore.arm"/><origin xyz="0.4 0 0"/>
<axis xyz="0 1 0"/></joint>
<joint name="tool" type="fixed"><parent link="fore.arm"/><child link="tool0"/><origin xyz="0.4 0 0"/></joint></robot>
"""
MOTION = "time_s,shoulder-pan,elbow\n0,0.5,0\n0.02,0.52,-0.1\n0.04,0.55,-0.2\n0.06,0.6,-0.2\n"


@pytest.fixture
def robot(tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    (tmp_path / "wave.csv").write_text(MOTION)
    return tmp_path / "arm.urdf"


@pytest.fixture
def converted(monkeypatch):
    """In place of a converter: it writes the same robot."""

    def convert(description, output, python):
        Path(output).mkdir()
        Path(output, "arm.usda").write_text(CONVERTED)
        return str(Path(output, "arm.usda")), ("something is odd",)

    monkeypatch.setattr(importing, "convert", convert)
    monkeypatch.setattr(importing, "converter_python", lambda named, tell: "python")


def test_a_robot_with_a_motion_becomes_a_shot(converted, robot, tmp_path, calmotion):
    arguments = [robot, "-o", tmp_path / "shot.usda", "--motion", tmp_path / "wave.csv", "--solid", "abs"]
    done = calmotion("import", *arguments, "--flexible", "upper*=abs,3mm", "--target", "tool0", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["frames"] == 4 and report["duration_s"] == pytest.approx(0.06) and len(report["flexible"]) == 1
    assert "converter: something is odd" in report["notes"]
    shot = cm.open_shot(tmp_path / "shot.usda")
    assert shot.motors[:2] == (PAN, ELBOW) and shot.animation.frame_times[-1] == pytest.approx(0.06)
    np.testing.assert_allclose(shot.animation.tracks[0].values, [0.5, 0.52, 0.55, 0.6], atol=1e-6)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.urdf", "shot.usda", "shot_robot", "wave.csv"]
    assert calmotion("import", *arguments, "--quiet").stdout == "", "it may be imported again"


def test_a_failed_import_leaves_everything_as_it_was(converted, robot, tmp_path):
    import_robot(robot, layer=tmp_path / "shot.usda", solid="abs")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    for wrong in ({"flexible": ["wheel*=abs"]}, {"solid": None}, {"targets": ["wheel"]}):
        with pytest.raises(cm.ShotError):
            import_robot(robot, layer=tmp_path / "shot.usda", **({"solid": "abs"} | wrong))
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_an_import_whose_layer_cannot_be_moved_leaves_the_former_folder(converted, robot, tmp_path, monkeypatch):
    import_robot(robot, layer=tmp_path / "shot.usda", solid="abs")
    (tmp_path / "shot_robot" / "former").touch()
    replace = os.replace

    def refused(source, target, **options):
        if str(target) == str(tmp_path / "shot.usda"):
            raise PermissionError(13, "Permission denied")
        replace(source, target, **options)

    monkeypatch.setattr(os, "replace", refused)
    with pytest.raises(cm.ShotError, match="cannot be written"):
        import_robot(robot, layer=tmp_path / "shot.usda", solid="abs")
    assert (tmp_path / "shot_robot" / "former").exists()


def test_a_folder_of_someone_else_is_not_replaced(converted, robot, tmp_path):
    (tmp_path / "shot_robot").mkdir()
    with pytest.raises(cm.ShotError, match="was not made by an import"):
        import_robot(robot, layer=tmp_path / "shot.usda", solid="abs")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--flexible", "abs"], "PATTERN=MATERIAL"), (["--flexible", "*=unobtainium"], "no such material"),
        (["--flexible", "*=abs,3kg"], "3kg"), (["--motion", "walk.fbx"], "no plugin reads this motion"),
        (["--motion", "none.csv"], "cannot be read"), (["--package", "x"], "NAME=FOLDER"), (["-o", "a.txt"], ".usda"),
        (["--converters", "nowhere"], "does not have the converters"),
    ],
)  # fmt: skip
def test_wrong_options_are_refused_before_the_robot_is_converted(robot, tmp_path, calmotion, arguments, told):
    done = calmotion("import", robot, "-o", tmp_path / "shot.usda", *arguments)
    assert done.returncode in (1, 2) and told in done.stderr
    assert not (tmp_path / "shot.usda").exists()


def test_walls_have_units():
    from calmotion.catalogs.materials import MATERIALS

    found = flexible_links("*fore* = pa12 , 2.5mm", MATERIALS)
    assert (found.pattern, found.name, found.thickness) == ("*fore*", "nylon", 0.0025)


@pytest.mark.parametrize(("times", "expected"), [
    (np.arange(9) / 50, 50.0), (np.round(np.arange(200) / 60, 4), 60.0), ([0.0, 0.1, 0.15], 60.0), ([0.0, 1.0], 60.0),
])  # fmt: skip
def test_frames_are_those_of_an_even_motion(times, expected):
    assert frames_per_second(_tracks(times)) == expected


def _tracks(times):
    from calmotion.model import MotorTracks

    return MotorTracks("a.csv", np.asarray(times, float), {})


@pytest.mark.skipif(
    not os.environ.get(VARIABLE) and not (environment_folder() / "ready").is_file(),
    reason=f"the converters are not here: name their environment with {VARIABLE}, or run calmotion import once",
)
def test_the_real_converter_makes_a_shot(robot, tmp_path):
    made = import_robot(robot, layer=tmp_path / "shot.usda", motion=tmp_path / "wave.csv", solid="abs",
                           flexible=["upper*=abs"], targets=["tool0"])  # fmt: skip
    character = made.character
    assert [joint.name for joint in character.joints] == ["shoulder-pan", "elbow"]
    assert character.motors[0].max_torque == pytest.approx(20.0)
    assert character.motors[0].max_velocity == pytest.approx(3.0, rel=1e-6)
    assert character.joints[0].lower == pytest.approx(-2.0, rel=1e-6)
    assert len(character.targets) == 1 and made.animation.frame_times[-1] == pytest.approx(0.06)


@pytest.mark.parametrize("text", ["*fore*=abs,3", "*fore*=abs, 0.5"])
def test_a_wall_needs_a_unit(text):
    from calmotion.catalogs.materials import MATERIALS
    from calmotion.host import SettingError

    with pytest.raises(SettingError, match="no unit") as error:
        flexible_links(text, MATERIALS)
    number = text.rpartition(",")[2].strip()
    assert f"{number}mm" in error.value.remedy


def test_what_a_killed_import_left_is_removed_by_the_next(robot, tmp_path):
    code = f"""
import os
from calmotion_plugins.robot_import import robot
robot.convert = lambda *arguments: os._exit(9)
robot.converter_python = lambda named, tell: "python"
robot.import_robot({str(robot)!r}, layer={str(tmp_path / "out" / "shot.usda")!r})
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 9
    assert len(list((tmp_path / "out").iterdir())) == 1
    with temporary_folder(str(tmp_path / "out" / "shot.usda")) as folder:
        assert [path.name for path in (tmp_path / "out").iterdir()] == [Path(folder).name]
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("setting", ["motion.read.angle=deg", "motion.raed.angles=deg", "fe.mesh.element_size=5"])
def test_a_setting_that_does_not_exist_is_refused_before_anything_is_made(robot, tmp_path, calmotion, setting):
    done = calmotion("import", robot, "-o", tmp_path / "shot.usda", "--set", setting)
    assert done.returncode == 2 and setting.rpartition(".")[0] in done.stderr
    assert not (tmp_path / "shot.usda").exists()
