"""What a shot says of its physics and is not simulated is named."""

import numpy as np
from calmotion.usd.reading import read_shot
from pxr import Sdf, UsdPhysics
from small_shots import ELBOW, FORE, UPPER, write_arm


def notes(tmp_path, edit):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0].notes


def authored(speed, force):
    def edit(stage):
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(FORE)).CreateAngularVelocityAttr((0.0, speed, 0.0))
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(UPPER)).CreateVelocityAttr((0.0, 0.0, speed))
        UsdPhysics.Joint(stage.GetPrimAtPath(ELBOW)).CreateBreakForceAttr(force)
        UsdPhysics.DriveAPI(stage.GetPrimAtPath(ELBOW), "angular").CreateTargetVelocityAttr(speed)

    return edit


def test_velocities_and_breaking_forces_are_named(tmp_path):
    found = [note for note in notes(tmp_path, authored(90.0, 5.0)) if "is not used" in note]
    expected = {
        FORE: "physics:angularVelocity", UPPER: "physics:velocity", ELBOW: "physics:breakForce",
    }  # fmt: skip
    for path, name in expected.items():
        assert any(note.startswith(f"{path}: {name} is not used") for note in found)
    assert any("drive:angular:physics:targetVelocity is not used" in note for note in found) and len(found) == 4


def test_what_has_no_effect_anyway_is_not(tmp_path):
    for limit in (np.inf, float(np.finfo(np.float32).max)):
        assert not [note for note in notes(tmp_path, authored(0.0, limit)) if "is not used" in note]


def test_bodies_without_weight_are_named(tmp_path):
    def weightless(value):
        def edit(stage):
            prims = [stage.GetPrimAtPath(path) for path in (FORE, UPPER)]
            prims[0].CreateAttribute("physxRigidBody:disableGravity", Sdf.ValueTypeNames.Bool).Set(bool(value))
            prims[1].CreateAttribute("mjc:gravcomp", Sdf.ValueTypeNames.Double).Set(value)

        return edit

    found = [note for note in notes(tmp_path, weightless(1.0)) if "gravity acts on the body" in note]
    assert [note.split(":")[0] for note in found] == [UPPER, FORE]
    assert not [note for note in notes(tmp_path, weightless(0.0)) if "gravity acts on the body" in note]
