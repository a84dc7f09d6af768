"""Physics in a variant that the stage does not select."""

import re

import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import Sdf, Usd, UsdGeom, UsdPhysics
from small_shots import BASE, ELBOW, FORE, UPPER, write_arm


def without(stage, what):
    """The arm without bodies, joints, drives, or all of these."""
    for prim in list(stage.Traverse()):
        if what in ("joints", "all") and prim.IsA(UsdPhysics.Joint):
            stage.RemovePrim(prim.GetPath())
            continue
        for schema in list(prim.GetAppliedSchemas()):
            if (
                what == "all"
                or (what == "drives" and "Drive" in schema)
                or (what == "bodies" and "RigidBody" in schema)
            ):
                prim.RemoveAppliedSchema(schema)


def written(tmp_path, what, payload=False, engines=("PhysX",), chosen="None"):
    """A robot with a variant for each engine, and one without a part of its physics."""
    write_arm(tmp_path / "bare.usda", lambda stage: without(stage, what))
    write_arm(tmp_path / "whole.usda")
    stage = Usd.Stage.CreateNew(str(tmp_path / "shot.usda"))
    stage.GetRootLayer().TransferContent(Sdf.Layer.FindOrOpen(str(tmp_path / "whole.usda")))
    stage.RemovePrim("/Arm")
    arm = UsdGeom.Xform.Define(stage, "/Arm").GetPrim()
    looks = arm.GetVariantSets().AddVariantSet("Look")
    for name in ("red", "blue"):
        looks.AddVariant(name)
    physics = arm.GetVariantSets().AddVariantSet("Physics")
    for name in ("None", *engines):
        physics.AddVariant(name)
        physics.SetVariantSelection(name)
        file = "bare.usda" if name == "None" else "whole.usda"
        with physics.GetVariantEditContext():
            arcs = arm.GetPayloads() if payload else arm.GetReferences()
            (arcs.AddPayload if payload else arcs.AddReference)(f"./{file}")
    physics.SetVariantSelection(chosen)
    stage.Save()
    return tmp_path / "shot.usda"


def follow(path, remedy):
    """Do what a remedy says."""
    name, variant, prim = re.match(r'Author variants = { string (\w+) = "(\w+)" } on ([/\w]+)', remedy).groups()
    layer = Sdf.Layer.FindOrOpen(str(path))
    layer.GetPrimAtPath(prim).variantSelections[name] = variant
    layer.Save()


@pytest.mark.parametrize("payload", [False, True])
@pytest.mark.parametrize("what", ["all", "bodies", "joints", "drives"])
def test_the_remedy_names_the_variant_and_works(tmp_path, what, payload):
    shot = written(tmp_path, what, payload)
    with pytest.raises(ShotError) as refused:
        read_shot(str(shot))
    assert "more bodies, joints and drives; or " in refused.value.remedy
    follow(shot, refused.value.remedy)
    character, _, _ = read_shot(str(shot))
    assert len(character.motors) == 2 and not any("variant" in note for note in character.notes)


def test_other_errors_do_not_speak_of_variants(tmp_path):
    shot = written(tmp_path, "all", engines=("PhysX", "MuJoCo"), chosen="PhysX")
    stage = Usd.Stage.Open(str(shot))
    stage.GetPrimAtPath(ELBOW).GetAttribute("physics:axis").Set("W")
    stage.Save()
    with pytest.raises(ShotError, match="unknown axis") as refused:
        read_shot(str(shot))
    assert "variant" not in refused.value.remedy


HEAD = '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n    startTimeCode = 0\n    endTimeCode = 24\n)\n'
BODY = '(prepend apiSchemas = ["PhysicsRigidBodyAPI"])'


def refused(path):
    with pytest.raises(ShotError, match="no bodies") as caught:
        read_shot(str(path))
    return caught.value


def written_absent(tmp_path, text):
    path = tmp_path / "shot.usda"
    path.write_text(HEAD + text)
    return path


@pytest.mark.parametrize(
    ("text", "place", "remedy"),
    [
        ('over "Robot"\n{\n    over "Link"\n    {\n    }\n}\n', "/Robot", "subLayers"),
        (f'over "Robot" {BODY}\n{{\n}}\n', "/Robot", "subLayers"),
        (
            f'def Xform "Robot" (active = false)\n{{\n    def Xform "Link" {BODY}\n    {{\n    }}\n}}\n',
            "/Robot",
            "Activate",
        ),
        (f'class Xform "Robot"\n{{\n    def Xform "Link" {BODY}\n    {{\n    }}\n}}\n', "/Robot/Link", "Inherit"),
        ('def Xform "Robot"\n{\n}\n', "shot.usda", "Apply PhysicsRigidBodyAPI"),
    ],
)
def test_the_prim_that_would_have_them_is_named(tmp_path, text, place, remedy):
    error = refused(written_absent(tmp_path, text))
    assert error.path.endswith(place) and remedy in error.remedy


def test_bodies_that_are_switched_off_are_named_with_their_attribute(tmp_path):
    path = write_arm(tmp_path / "arm.usda")
    stage = Usd.Stage.Open(str(path))
    for prim in stage.Traverse():
        if "PhysicsRigidBodyAPI" in prim.GetAppliedSchemas():
            prim.GetAttribute("physics:rigidBodyEnabled").Set(False)
    stage.Save()
    error = refused(path)
    assert error.attribute == "physics:rigidBodyEnabled" and error.path in (UPPER, FORE, BASE)
