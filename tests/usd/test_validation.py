"""Checks before the costly work: everything at once, with places and remedies."""

import json
import math

import pytest
from calmotion import ShotError
from calmotion.errors import ShotErrors
from calmotion.usd.reading import read_shot
from calmotion.usd.validation import register_validators, validate_shot
from posed_shots import posed
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdValidation
from small_shots import (
    BASE,
    ELBOW,
    FORE,
    HAND,
    SHOULDER,
    TARGET_POSITION,
    make_flexible,
    make_target,
    set_float,
    write_arm,
)


def broken(stage) -> None:
    """Five things at once, in five parts of the reader."""
    set_float(stage, FORE, "physics:mass", -1.0)
    stage.GetPrimAtPath(SHOULDER).GetAttribute(TARGET_POSITION).Set(math.nan, 3.0)
    set_float(stage, ELBOW, "drive:angular:physics:maxForce", -2.0)
    make_target(stage, HAND, positionWeight=-1.0)
    root = stage.GetPrimAtPath("/Arm")
    root.AddAppliedSchema("CalmRetargetAPI")
    set_float(stage, "/Arm", "calm:retarget:tolerance", -5.0)


PLACES = {
    (FORE, "physics:mass"),
    (SHOULDER, TARGET_POSITION),
    (ELBOW, "drive:angular:physics:maxForce"),
    (HAND, "calm:target:positionWeight"),
    ("/Arm", "calm:retarget:tolerance"),
}


def test_the_reader_reports_all_problems_at_once(tmp_path):
    with pytest.raises(ShotErrors) as caught:
        read_shot(str(write_arm(tmp_path / "arm.usda", broken)))
    assert {(error.path, error.attribute) for error in caught.value.errors} == PLACES
    assert all(error.remedy for error in caught.value.errors)


def test_several_missing_files_are_reported_at_once(tmp_path):
    shot = write_arm(tmp_path / "arm.usda")
    layer = Sdf.Layer.OpenAsAnonymous(str(shot))
    for path in (FORE, BASE):
        layer.GetPrimAtPath(path).referenceList.Prepend(Sdf.Reference(f"./no{path[5:]}.usda"))
    layer.Export(str(shot))
    with pytest.raises(ShotErrors) as caught:
        read_shot(str(shot))
    assert {error.path for error in caught.value.errors} == {FORE, BASE}


def findings(tmp_path, edit=None):
    return validate_shot(str(write_arm(tmp_path / "arm.usda", edit))).items


def of_rule(items, rule):
    return [item for item in items if item.rule == rule]


def test_findings_are_those_of_the_reader_and_of_usd(tmp_path):
    items = findings(tmp_path, broken)
    assert PLACES <= {(item.path, item.attribute) for item in items if item.level == "error"}
    # of UsdPhysics: the arm's bodies have inertias without principal axes
    assert any(item.rule == "usdPhysicsValidators:RigidBodyChecker" and item.path == FORE for item in items)


def test_a_misspelt_attribute_is_reported_with_the_nearest_name(tmp_path):
    def edit(stage):
        stage.GetPrimAtPath(ELBOW).AddAppliedSchema("CalmMotorAPI")
        set_float(stage, ELBOW, "calm:motor:maxVelocty", 3.0)

    (item,) = of_rule(findings(tmp_path, edit), "SchemasAreKnown")
    assert (item.path, item.attribute) == (ELBOW, "calm:motor:maxVelocty") and "calm:motor:maxVelocity" in item.remedy


def test_an_attribute_whose_schema_is_not_applied_is_reported(tmp_path):
    (item,) = of_rule(findings(tmp_path, lambda s: set_float(s, ELBOW, "calm:motor:maxTorque", 3.0)), "SchemasAreKnown")
    assert item.path == ELBOW and "CalmMotorAPI" in item.remedy


@pytest.mark.parametrize(
    ("schema", "path"), [("CalmFlexibleBodyAPI", "/Arm/joints"), ("CalmDampingAPI", FORE), ("CalmMotorAPI", FORE)]
)
def test_a_schema_on_the_wrong_prim_is_reported(tmp_path, schema, path):
    def edit(stage):
        UsdGeom.Xform.Define(stage, "/Arm/joints")
        stage.GetPrimAtPath(path).AddAppliedSchema(schema)

    (item,) = of_rule(findings(tmp_path, edit), "SchemasFit")
    assert item.path == path and schema in item.problem and item.remedy


def test_schemas_in_their_places_are_fine(tmp_path):
    def edit(stage):
        make_flexible(stage)
        make_target(stage)
        UsdShade.Material(stage.GetPrimAtPath("/Arm/materials/Plastic")).GetPrim().AddAppliedSchema("CalmDampingAPI")

    items = findings(tmp_path, edit)
    assert not of_rule(items, "SchemasFit") and not of_rule(items, "SchemasAreKnown")


def test_an_animation_beyond_a_limit_is_reported(tmp_path):
    items = findings(tmp_path, lambda stage: set_float(stage, ELBOW, "physics:upperLimit", 50.0))
    (item,) = of_rule(items, "AnimationKeepsLimits")
    assert item.path == ELBOW and "70" in item.found and "50" in item.found


def test_bodies_off_their_joints_are_reported(tmp_path):
    def edit(stage):
        posed(stage)
        op = UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).GetOrderedXformOps()[0]
        op.Set(op.Get(12.0) * Gf.Matrix4d().SetTranslate(Gf.Vec3d(0, 0.05, 0)), 12.0)

    (item,) = [i for i in findings(tmp_path, edit) if i.rule == "ShotIsReadable"]
    assert item.level == "warning" and item.path == ELBOW and "50 mm at time code 12" in item.found


def test_calmotion_s_rules_run_in_usd_s_own_framework(tmp_path):
    register_validators()
    register_validators()  # once is enough, twice no harm
    stage = Usd.Stage.Open(str(write_arm(tmp_path / "arm.usda", broken)))
    registry = UsdValidation.ValidationRegistry()
    names = [m.name for m in registry.GetAllValidatorMetadata() if m.name.startswith("calmotion:")]
    errors = UsdValidation.ValidationContext(registry.GetOrLoadValidatorsByName(names)).Validate(stage)
    places = {str(error.GetSites()[0].GetPrim().GetPath()) for error in errors}
    assert {path for path, _ in PLACES} <= places
    assert any("physics:mass" in error.GetMessage() and "-1" in error.GetMessage() for error in errors)


def principal_axes(stage) -> None:
    for path in (BASE, FORE):
        stage.GetPrimAtPath(path).CreateAttribute("physics:principalAxes", Sdf.ValueTypeNames.Quatf).Set(Gf.Quatf(1))


def test_a_correct_shot_passes_the_strict_check_and_a_broken_one_does_not(calmotion, tmp_path):
    clean = write_arm(tmp_path / "clean.usda", principal_axes)
    done = calmotion("inspect", clean, "--strict")
    assert done.returncode == 0, done.stdout
    assert "no findings" in done.stdout
    bad = write_arm(tmp_path / "bad.usda", broken)
    done = calmotion("inspect", bad, "--strict", "--json")
    assert done.returncode == 1
    report = json.loads(done.stdout)
    assert PLACES <= {(item["path"], item["attribute"]) for item in report["findings"]}
    shown = calmotion("inspect", bad, "--strict", "--quiet")
    assert shown.returncode == 1 and "physics:mass" in shown.stdout and "errors" in shown.stdout


def test_a_file_that_cannot_be_opened_is_a_finding(calmotion, tmp_path):
    done = calmotion("inspect", tmp_path / "nothing.usda", "--strict", "--json")
    (item,) = json.loads(done.stdout)["findings"]
    assert done.returncode == 1 and "nothing.usda" in item["path"] and item["remedy"]


def test_optimize_lists_every_problem(calmotion, tmp_path):
    shot = write_arm(tmp_path / "arm.usda", broken)
    done = calmotion("optimize", shot, "-o", tmp_path / "calm.usda", "--json", "--quiet")
    report = json.loads(done.stdout)
    assert done.returncode == 1 and {(e["path"], e["attribute"]) for e in report["errors"]} == PLACES
    shown = calmotion("optimize", shot, "-o", tmp_path / "calm.usda")
    assert all(attribute in shown.stderr for _, attribute in PLACES)


def test_one_problem_is_raised_as_itself(tmp_path):
    with pytest.raises(ShotError) as caught:
        read_shot(str(write_arm(tmp_path / "arm.usda", lambda s: set_float(s, FORE, "physics:mass", -1.0))))
    assert type(caught.value) is ShotError
