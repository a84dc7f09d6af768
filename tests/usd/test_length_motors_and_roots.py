"""Length motors and moving roots through the command line: from a shot to curves, tables and figures."""

import csv
import json

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdPhysics
from small_shots import BASE, FORE, FRAMES, HAND, Scale, make_flexible, make_target, write_arm

LIFT, STAND = "/Arm/joints/lift", "/Arm/joints/stand"
ATTRIBUTE = "drive:linear:physics:targetPosition"
WEIGHT = 9.81 * (2.0 + 1200.0 * 0.4 * 0.04**2 + 0.5)


def heights():
    """The lift's track [m]: up by 15 cm and down again."""
    return 0.075 * (1.0 - np.cos(2.0 * np.pi * np.arange(FRAMES + 1) / FRAMES))


def soft(stage, scale: Scale) -> None:
    make_flexible(stage, FORE, scale, youngsModulus=4e7 * scale.meters / scale.kilograms)
    make_target(stage, HAND)


def lifted(scale: Scale):
    def edit(stage):
        soft(stage, scale)
        stage.GetPrimAtPath(STAND).GetAttribute("physics:jointEnabled").Set(False)
        joint = UsdPhysics.PrismaticJoint.Define(stage, LIFT)
        joint.CreateBody1Rel().SetTargets([BASE])
        joint.CreateLocalPos0Attr(Gf.Vec3f(0.0, 0.0, 1.0 / scale.meters))
        joint.CreateLocalPos1Attr(Gf.Vec3f(0.0, 0.0, 0.0))
        joint.CreateAxisAttr("Z")
        joint.CreateLowerLimitAttr(-0.05 / scale.meters)
        joint.CreateUpperLimitAttr(0.2 / scale.meters)
        attribute = UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "linear").CreateTargetPositionAttr()
        for frame, height in enumerate(heights()):
            attribute.Set(float(height / scale.meters), frame)

    return edit


def table(path):
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, np.array(rows, dtype=float).T, strict=True))


def test_a_lift_is_simulated_and_its_curve_written_in_the_stage_s_unit(calmotion, tmp_path):
    scale = Scale(0.01, 0.001)
    shot = write_arm(tmp_path / "lift.usda", lifted(scale), scale)
    done = calmotion(
        "optimize", shot, "-o", tmp_path / "calm.usda", "--json", "--csv", tmp_path / "calm.csv", "--figures",
        tmp_path / "figures", "--rrd", tmp_path / "calm.rrd",
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    report = json.loads(done.stdout)
    assert report["max_error_after_m"] < 0.3 * report["max_error_before_m"] and report["max_error_before_m"] > 2e-3
    (lift,) = (motor for motor in report["motors"] if motor["path"] == LIFT)
    assert lift["changed"] and 1e-5 < lift["max_offset_m"] < 0.02
    columns = table(tmp_path / "calm.csv")
    assert np.ptp(columns[f"{LIFT}.input"]) == pytest.approx(0.15, rel=1e-3)
    changed = np.abs(columns[f"{LIFT}.output"] - columns[f"{LIFT}.input"])
    assert changed.max() == pytest.approx(lift["max_offset_m"], rel=0.05)
    # the whole robot hangs from it, and goes up and down by itself
    assert columns[f"{LIFT}.effort"].mean() == pytest.approx(WEIGHT, rel=0.02)
    assert columns[f"{LIFT}.force.z"] == pytest.approx(columns[f"{LIFT}.effort"], rel=1e-6)
    stage = Usd.Stage.Open(report["root_layer"])
    attribute = stage.GetPrimAtPath(LIFT).GetAttribute(ATTRIBUTE)
    written = np.array([attribute.Get(frame) for frame in range(FRAMES + 1)]) * scale.meters
    assert np.abs(written - heights()).max() == pytest.approx(lift["max_offset_m"], rel=0.1)


def test_a_lift_is_inspected_in_metres(calmotion, tmp_path):
    shot = write_arm(tmp_path / "lift.usda", lifted(Scale()), Scale())
    done = calmotion("inspect", shot, "--json")
    assert done.returncode == 0, done.stderr
    (lift,) = (motor for motor in json.loads(done.stdout)["motors"] if motor["path"] == LIFT)
    assert (lift["min_m"], lift["max_m"], lift["lower_m"], lift["upper_m"]) == pytest.approx((0.0, 0.15, -0.05, 0.2))
    text = calmotion("inspect", shot).stdout
    assert "150 mm" in text and "200 mm" in text


def riding(stage):
    """The arm on a base that the shot carries half a metre along x and turns by 60 degrees."""
    soft(stage, Scale())
    stage.GetPrimAtPath(STAND).GetAttribute("physics:jointEnabled").Set(False)
    base = stage.GetPrimAtPath(BASE)
    UsdPhysics.RigidBodyAPI(base).CreateKinematicEnabledAttr(True)
    form = UsdGeom.Xformable(base)
    move, turn = form.AddTranslateOp(opSuffix="ride"), form.AddRotateZOp(opSuffix="turn")
    for frame in range(FRAMES + 1):
        s = frame / FRAMES
        share = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        move.Set(Gf.Vec3d(0.5 * share, 0.0, 0.0), frame)
        turn.Set(60.0 * share, frame)


def test_an_arm_on_a_moving_root_is_carried_shakes_and_is_optimised(calmotion, tmp_path):
    shot = write_arm(tmp_path / "ride.usda", riding)
    done = calmotion("optimize", shot, "-o", tmp_path / "calm.usda", "--json", "--csv", tmp_path / "calm.csv")
    assert done.returncode == 0, done.stdout + done.stderr
    report = json.loads(done.stdout)
    assert report["max_joint_gap_m"] < 1e-6
    # its two motors turn about y: what they can do about is what shakes up and down
    assert report["rms_error_after_m"] < 0.8 * report["rms_error_before_m"] and report["max_error_before_m"] > 2e-3
    columns = table(tmp_path / "calm.csv")
    assert np.ptp(columns[f"{HAND}.y"]) > 0.3, "the base turns and takes the hand with it"
    assert any("moves the root of the character" in note for note in report["notes"])
    layer = Usd.Stage.Open(str(tmp_path / "calm.usda"))
    assert not layer.GetPrimAtPath(BASE), "the root's own animation is left alone"
