"""What a shot says of its physics and is not simulated is named."""

import numpy as np
import pytest
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


FLOATS = Sdf.ValueTypeNames.Double
OTHERS = [  # prim, attribute, a value that has an effect in its program, one that has none
    (FORE, "physxRigidBody:disableGravity", 1.0, 0.0, "gravity acts"),
    (FORE, "mjc:gravcomp", 1.0, 0.0, "gravity acts"),
    (FORE, "mjc:body:gravcomp", 0.5, 0.0, "gravity acts"),
    (FORE, "physxRigidBody:linearDamping", 0.2, 0.0, "brakes"),
    (FORE, "physxRigidBody:angularDamping", 0.2, 0.05, "brakes"),
    (FORE, "physxRigidBody:lockedRotAxis", 3.0, 0.0, "joint to the world"),
    (ELBOW, "physxLimit:angular:stiffness", 3.0, 0.0, "exact"),
    (ELBOW, "physxDrivePerformanceEnvelope:angular:speedEffortGradient", 3.0, 0.0, "torqueSpeedKnee"),
    (ELBOW, "isaac:physics:AccelerationLimit", 3.0, np.inf, "maxAcceleration"),
    (ELBOW, "isaac:physics:JerkLimit", 3.0, np.inf, "maxJerk"),
    (ELBOW, "physics:breakTorque", 3.0, np.inf, "break"),
]


@pytest.mark.parametrize(("path", "name", "value", "harmless", "why"), OTHERS, ids=[row[1] for row in OTHERS])
def test_attributes_of_other_programs_are_named_where_they_have_an_effect(tmp_path, path, name, value, harmless, why):
    def found(number):
        def edit(stage):
            stage.GetPrimAtPath(path).CreateAttribute(name, FLOATS).Set(number)

        return [note for note in notes(tmp_path, edit) if f"{name} is not used" in note]

    (note,) = found(value)
    assert note.startswith(f"{path}: ") and why in note and not found(harmless)
