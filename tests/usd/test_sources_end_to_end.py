"""Whatever animates the motors, the written result simulated on its own does what the optimisation promised."""

import json

import pytest
from posed_shots import posed, skeletal
from pxr import Sdf, Usd, UsdGeom
from small_shots import ELBOW, FORE, SHOULDER, TARGET_POSITION, make_flexible, make_target, write_arm


def geared(stage) -> None:
    stage.GetPrimAtPath(ELBOW).CreateRelationship("newton:mimicJoint").SetTargets([SHOULDER])
    coefficient = stage.GetPrimAtPath(ELBOW).CreateAttribute("newton:mimicCoef1", Sdf.ValueTypeNames.Float)
    coefficient.Set(-0.5)


SOURCES = {"drives": None, "bodies": posed, "skeleton": skeletal, "gear": geared}


@pytest.mark.parametrize("source", SOURCES)
def test_the_written_layer_keeps_what_was_promised(calmotion, tmp_path, source):
    def edit(stage):
        if SOURCES[source] is not None:
            SOURCES[source](stage)
        make_flexible(stage, youngsModulus=4e7)
        make_target(stage)

    shot = write_arm(tmp_path / "shot.usda", edit)
    options = ("--json", "--quiet", "--step", "4ms", "--set", "fe.mesh.element_size=20mm")
    done = calmotion("optimize", shot, "-o", tmp_path / "calm.usda", *options)
    assert done.returncode == 0, done.stdout + done.stderr
    report = json.loads(done.stdout)
    assert report["max_error_after_m"] < 0.2 * report["max_error_before_m"]
    again = calmotion("simulate", tmp_path / "calm_root.usda", *options)
    assert again.returncode == 0, again.stdout
    found = json.loads(again.stdout)
    assert found["max_error_m"] == pytest.approx(report["max_error_after_m"], rel=0.02, abs=2e-6)
    once_more = calmotion("optimize", tmp_path / "calm_root.usda", "-o", tmp_path / "more.usda", *options)
    better = json.loads(once_more.stdout)
    assert better["objective_after"] > 0.5 * report["objective_after"], "there is nothing left to improve"


def test_baked_bodies_of_a_posed_shot_are_the_curves(calmotion, tmp_path):
    def edit(stage):
        posed(stage)
        make_flexible(stage, youngsModulus=4e7)
        make_target(stage)

    shot = write_arm(tmp_path / "shot.usda", edit)
    options = ("--json", "--quiet", "--step", "4ms", "--set", "fe.mesh.element_size=20mm")
    done = calmotion("optimize", shot, "-o", tmp_path / "calm.usda", "--bake", *options)
    assert done.returncode == 0, done.stdout
    report = json.loads(done.stdout)
    predicted = calmotion(
        "simulate", tmp_path / "calm_root.usda", "-o", tmp_path / "moved.usda", "--bake=simulated", *options
    )
    assert predicted.returncode == 0, predicted.stdout
    found = json.loads(predicted.stdout)
    assert found["max_error_m"] == pytest.approx(report["max_error_after_m"], rel=0.02, abs=2e-6)
    # what was predicted is no animation: the intent and the curves are read through it
    again = json.loads(calmotion("simulate", tmp_path / "moved_root.usda", *options).stdout)
    assert again["max_error_m"] == pytest.approx(found["max_error_m"], rel=1e-6)
    stage = Usd.Stage.Open(str(tmp_path / "moved_root.usda"))
    skin = UsdGeom.Mesh(stage.GetPrimAtPath(f"{FORE}/skin"))
    assert len(skin.GetPointsAttr().GetTimeSamples()) > 10
    assert not stage.GetPrimAtPath(SHOULDER).GetAttribute(TARGET_POSITION).HasAuthoredValue()
