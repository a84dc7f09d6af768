"""A wrong name of a prim or a value in a shot gets the nearest right one."""

import numpy as np
import pytest
from calmotion import open_shot
from calmotion.errors import ShotError
from calmotion.model import MotorTracks
from calmotion.usd.reading import read_shot
from pxr import UsdGeom
from shot_edits import targets
from small_shots import ELBOW, FORE, SHOULDER, UPPER, make_flexible, write_arm


def geared(stage):
    prim = stage.GetPrimAtPath(ELBOW)
    prim.AddAppliedSchema("NewtonMimicAPI")
    prim.CreateRelationship("newton:mimicJoint").SetTargets(["/Arm/joints/sholder"])


def interface(name, target=None):
    def edit(stage):
        make_flexible(stage)
        subset = UsdGeom.Subset.Define(stage, f"{FORE}/skin/{name}")
        subset.CreateElementTypeAttr("face")
        subset.CreateFamilyNameAttr("calmInterface")
        subset.CreateIndicesAttr([0])
        if target:
            subset.GetPrim().CreateRelationship("calm:interface:joint").SetTargets([target])

    return edit


def value(path, schema, name, text):
    def edit(stage):
        make_flexible(stage)
        stage.GetPrimAtPath(path).AddAppliedSchema(schema)
        stage.GetPrimAtPath(path).GetAttribute(name).Set(text)

    return edit


CASES = {
    "a joint's body": (targets(ELBOW, "physics:body0", "/Arm/uper"), UPPER),
    "a joint's body elsewhere": (targets(ELBOW, "physics:body0", "/Robot/upper"), UPPER),
    "a geared joint": (geared, SHOULDER),
    "an interface": (interface("patch", "/Arm/joints/elbo"), ELBOW),
    "a subset's name": (interface("elbw"), ELBOW),
    "an elastic law": (value(FORE, "CalmFlexibleBodyAPI", "calm:flexible:elasticity", "neo-hookean"), "neohookean"),
    "a reference": (value("/Arm", "CalmRetargetAPI", "calm:retarget:reference", "statics"), "static"),
    "end poses": (value("/Arm", "CalmRetargetAPI", "calm:retarget:endpoints", "Keep"), "kept"),
}


@pytest.mark.parametrize("name", CASES)
def test_the_nearest_name_is_suggested(tmp_path, name):
    edit, meant = CASES[name]
    with pytest.raises(ShotError) as error:
        open_shot(write_arm(tmp_path / "shot.usda", edit))
    assert error.value.remedy.startswith(f"Did you mean {meant}? ")


def test_a_given_motion_gets_the_nearest_joint(tmp_path):
    shot = write_arm(tmp_path / "shot.usda")
    tracks = MotorTracks("walk.bvh", np.array([0.0, 1.0]), {"sholder": np.zeros(2)})
    with pytest.raises(ShotError, match="Did you mean shoulder"):
        read_shot(str(shot), given=tracks)
