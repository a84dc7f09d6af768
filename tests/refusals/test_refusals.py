"""Shots that cannot be processed: each ends with status 1, a message that helps, and no file."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
from pathlib import Path

import numpy as np
import pytest
import small_shots as shots  # noqa: E402
from pxr import Sdf, Usd, Vt


def no_joints(stage: Usd.Stage) -> None:
    stage.RemovePrim("/Arm/joints")


def no_motors(stage: Usd.Stage) -> None:
    for path in (shots.SHOULDER, shots.ELBOW):
        stage.GetPrimAtPath(path).RemoveAppliedSchema("PhysicsDriveAPI:angular")


def motor_without_animation(stage: Usd.Stage) -> None:
    prim = stage.GetPrimAtPath(shots.ELBOW)
    prim.AddAppliedSchema("CalmMotorAPI")
    prim.GetAttribute(shots.TARGET_POSITION).Clear()


def zero_mass(stage: Usd.Stage) -> None:
    shots.clear_mass(stage, shots.FORE)


def negative_mass(stage: Usd.Stage) -> None:
    shots.set_float(stage, shots.FORE, "physics:mass", -1.0)


def not_a_number(stage: Usd.Stage) -> None:
    stage.GetPrimAtPath(shots.SHOULDER).GetAttribute(shots.TARGET_POSITION).Set(math.nan, 3.0)


def self_intersecting_mesh(stage: Usd.Stage) -> None:
    """A box twisted by half a turn so that its sides pass through each other and enclose nothing in all."""
    shots.make_flexible(stage)
    points = stage.GetPrimAtPath(f"{shots.FORE}/skin").GetAttribute("points")
    corners = np.array(points.Get())
    far = corners[:, 0] > 0.1
    corners[far, 1:] *= -1.0
    corners[:, 2] = 0.0
    points.Set(Vt.Vec3fArray.FromNumpy(corners.astype(np.float32)))


CASES = {
    no_joints: ("/Arm", ""),
    no_motors: ("/Arm", ""),
    motor_without_animation: (shots.ELBOW, shots.TARGET_POSITION),
    zero_mass: (shots.FORE, "physics:mass"),
    negative_mass: (shots.FORE, "physics:mass"),
    not_a_number: (shots.SHOULDER, shots.TARGET_POSITION),
    self_intersecting_mesh: (f"{shots.FORE}/skin", ""),
}


def refused(calmotion, shot: Path) -> dict:
    """The error of a run that must be refused without leaving or changing anything."""

    def state() -> dict[str, str]:
        return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in shot.parent.iterdir()}

    before = state()
    with contextlib.chdir(shot.parent):
        done = calmotion("optimize", shot.name, "-o", "calm.usda", "--json", "--quiet")
    assert done.returncode == 1, done.stdout + done.stderr
    assert state() == before
    assert "Traceback" not in done.stderr
    return json.loads(done.stdout)["error"]


@pytest.mark.parametrize("edit", CASES, ids=lambda edit: edit.__name__)
def test_broken_shot_is_refused_by_prim_and_attribute_with_a_remedy(calmotion, tmp_path, edit):
    shot = shots.write_arm(tmp_path / "shot.usda", edit)
    path, attribute = CASES[edit]
    error = refused(calmotion, shot)
    assert path in error["path"] + error["problem"] + error["found"], error
    assert attribute in error["attribute"], error
    assert error["remedy"] and error["problem"]


def test_a_missing_reference_is_refused_by_prim_and_file(calmotion, tmp_path):
    shot = shots.write_arm(tmp_path / "shot.usda")
    layer = Sdf.Layer.OpenAsAnonymous(str(shot))
    layer.GetPrimAtPath(shots.FORE).referenceList.Prepend(Sdf.Reference("./not_there.usda"))
    layer.Export(str(shot))
    error = refused(calmotion, shot)
    assert shots.FORE in error["path"] and error["remedy"]
    assert "not_there.usda" in error["problem"] + error["found"]


def test_a_file_that_is_not_usd_is_refused(calmotion, tmp_path):
    shot = tmp_path / "shot.usda"
    shot.write_text("BVH is not USD")
    error = refused(calmotion, shot)
    assert "shot.usda" in error["path"] and error["remedy"]


def test_a_file_that_is_not_there_is_refused(calmotion, tmp_path):
    error = refused(calmotion, tmp_path / "nothing.usda")
    assert "nothing.usda" in error["path"] and error["remedy"]


def test_the_message_on_the_terminal_says_the_same(calmotion, tmp_path):
    shot = shots.write_arm(tmp_path / "shot.usda", negative_mass)
    done = calmotion("optimize", shot, "-o", tmp_path / "calm.usda")
    assert done.returncode == 1
    for text in (shots.FORE, "physics:mass", "-1"):
        assert text in done.stderr
