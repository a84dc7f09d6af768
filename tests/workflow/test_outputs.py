"""No output takes the place of a file that is read, or that Calmotion did not write without being asked for it."""

import json
import os

import pytest
from calmotion.host import SettingError
from calmotion.workflow.outputs import refuse_overwriting
from one_hinge import HINGE, ONE_HINGE
from pxr import Sdf
from small_shots import FORE, make_flexible, write_arm

MOTION = f"time_s,{HINGE}\n0,0\n0.5,0.1\n1,0.2\n"


@pytest.fixture
def folder(tmp_path):
    below = (
        "(\n    subLayers = [@below.usda@]\n    startTimeCode = 0\n    endTimeCode = 24\n    timeCodesPerSecond = 24\n"
    )
    (tmp_path / "below.usda").write_text(ONE_HINGE)
    (tmp_path / "shot.usda").write_text(f'#usda 1.0\n{below}    metersPerUnit = 1\n    upAxis = "Z"\n)\n')
    (tmp_path / "motion.csv").write_text(MOTION)
    (tmp_path / "settings.toml").write_text("[figures.plot]\ndpi = 100\n")
    if hasattr(os, "symlink"):
        os.symlink("shot.usda", tmp_path / "link.usda")
        os.link(tmp_path / "motion.csv", tmp_path / "hard.csv")
    return tmp_path


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


READ = ("--motion", "motion.csv", "--settings", "settings.toml")
CASES = {
    "the shot as a table": ("simulate", "shot.usda", "--csv", "shot.usda"),
    "the shot through a link": ("simulate", "shot.usda", "--csv", "link.usda"),
    "the shot by another path": ("simulate", "shot.usda", "--csv", "./x/../shot.usda"),
    "the motion": ("simulate", "shot.usda", *READ, "--csv", "motion.csv"),
    "the motion by another name": ("simulate", "shot.usda", *READ, "--csv", "hard.csv"),
    "the settings": ("simulate", "shot.usda", *READ, "--video", "settings.toml"),
    "a sublayer": ("simulate", "shot.usda", "--csv", "below.usda"),
    "the root layer that is written as well": ("simulate", "shot.usda", "-o", "calm.usda", "--csv", "calm_root.usda"),
    "a root layer in the place of the shot": ("simulate", "shot.usda", "-o", "calm.usda", "--rrd", "calm_root.usda"),
}


LINKED = {"the shot through a link", "the motion by another name"}
CAPITALS = {
    "the shot in capitals": ("simulate", "shot.usda", "--csv", "SHOT.usda"),
    "the motion in capitals": ("simulate", "shot.usda", *READ, "--csv", "Motion.CSV"),
    "a sublayer in capitals": ("simulate", "shot.usda", "--csv", "Below.usda"),
}
CASES |= CAPITALS


@pytest.mark.parametrize("case", [pytest.param(case, marks=[pytest.mark.posix] * (case in LINKED)) for case in CASES])
def test_what_is_read_is_never_written_over(folder, calmotion, monkeypatch, case):
    if case in CAPITALS and not (folder / "SHOT.usda").exists():
        pytest.skip("on this system capitals make two names two files")
    monkeypatch.chdir(folder)
    before = contents(folder)
    done = calmotion(*CASES[case], "--json", "--quiet")
    assert done.returncode in (1, 2), done.stdout
    error = json.loads(done.stdout)["error"]
    assert error["remedy"] and CASES[case][-1] in error["found"], error
    assert contents(folder) == before


@pytest.mark.parametrize("content", ['#usda 1.0\ndef "Mine" {}\n', "notes of mine", ""])
def test_a_root_layer_of_others_is_not_replaced(folder, calmotion, monkeypatch, content):
    monkeypatch.chdir(folder)
    (folder / "calm_root.usda").write_text(content)
    before = contents(folder)
    done = calmotion("simulate", "shot.usda", "-o", "calm.usda", "--json", "--quiet")
    error = json.loads(done.stdout)["error"]
    assert done.returncode == 1 and "did not write" in error["problem"] and error["path"] == "calm_root.usda"
    assert contents(folder) == before


def test_what_calmotion_wrote_before_is_replaced(folder, calmotion, monkeypatch):
    monkeypatch.chdir(folder)
    for _ in range(2):
        arguments = ("simulate", "shot.usda", "-o", "calm.usda", "--csv", "a.csv", "--step", "10ms")
        assert calmotion(*arguments, "--quiet").returncode == 0


def test_the_option_and_what_it_would_overwrite_are_named(tmp_path):
    with pytest.raises(SettingError, match="this file is read as the motion") as error:
        refuse_overwriting({"the motion": str(tmp_path / "a.csv")}, {"--csv": str(tmp_path / "a.csv")})
    assert error.value.path == "--csv"


def test_a_mesh_of_the_shot_is_never_written_over(tmp_path, calmotion, monkeypatch):
    def edit(stage):
        make_flexible(stage)
        attribute = stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:meshFile", Sdf.ValueTypeNames.Asset)
        attribute.Set(Sdf.AssetPath("./link.msh"))

    write_arm(tmp_path / "shot.usda", edit)
    (tmp_path / "link.msh").write_text("a mesh")
    monkeypatch.chdir(tmp_path)
    done = calmotion("simulate", "shot.usda", "--csv", "link.msh", "--json", "--quiet")
    assert done.returncode == 2, done.stdout
    assert "a mesh of the shot" in json.loads(done.stdout)["error"]["problem"]
    assert (tmp_path / "link.msh").read_text() == "a mesh"


def test_outputs_that_differ_in_capitals_alone_are_refused_on_all_systems(tmp_path):
    with pytest.raises(SettingError, match="output of --csv as well"):
        refuse_overwriting({}, {"--csv": str(tmp_path / "calm"), "--figures": str(tmp_path / "Calm")})
