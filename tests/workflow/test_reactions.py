"""Reactions of the world: what a base carries, and when one that only stands would tip over."""

import calmotion as cm
import numpy as np
import pytest
from calmotion.workflow.reactions import reaction_rows
from pxr import Gf, UsdGeom, UsdPhysics
from small_shots import BASE, TARGET_POSITION, write_arm

HALF = 0.25  # of the plate that the base stands on [m]


def standing(half=HALF, speed=0.0):
    """The arm on a plate below it that nothing joins to the world; the shoulder holds it level, or swings."""

    def edit(stage):
        stage.RemovePrim("/Arm/joints/stand")
        plate = UsdGeom.Cube.Define(stage, f"{BASE}/plate")
        plate.CreateSizeAttr(1.0)
        plate.AddTranslateOp().Set(Gf.Vec3d(0.0, 0.0, -0.95))
        plate.AddScaleOp().Set(Gf.Vec3f(2 * half, 2 * half, 0.1))
        for path in ("/Arm/joints/shoulder", "/Arm/joints/elbow"):
            target = stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION)
            target.Clear()
            for frame in range(25):
                target.Set(float(speed * np.sin(2.0 * np.pi * frame / 24.0) ** 3), frame)

    return edit


def rows(tmp_path, edit):
    result = cm.simulate(write_arm(tmp_path / "arm.usda", edit), step=1 / 96, pre_roll=0.0)
    (row,) = reaction_rows(result.shot.character, result.result.before.motion)
    return row, result


def test_a_base_carries_the_weight_and_its_moment(tmp_path):
    row, result = rows(tmp_path, standing())
    masses = np.array([body.mass.mass for body in result.shot.character.bodies])
    centers = np.array([body.rest.position + body.mass.center for body in result.shot.character.bodies])
    assert row["max_force_n"] == pytest.approx(9.81 * masses.sum(), rel=1e-9)
    assert row["max_moment_n_m"] == pytest.approx(9.81 * masses @ centers[:, 0], rel=1e-6)
    # at rest the centre of pressure is below the centre of mass, and the plate ends at HALF
    x = masses @ centers[:, 0] / masses.sum()
    np.testing.assert_allclose(row["center_of_pressure_m"], [x, 0.0, 0.0], atol=1e-7)
    assert row["support_margin_m"] == pytest.approx(HALF - x, abs=1e-7)


def test_a_small_or_a_hasty_base_would_tip(tmp_path, calmotion):
    small, _ = rows(tmp_path, standing(0.02))
    assert small["support_margin_m"] < 0.0
    calm, _ = rows(tmp_path, standing(HALF, 5.0))
    hasty, _ = rows(tmp_path, standing(HALF, 150.0))
    assert hasty["support_margin_m"] is None or hasty["support_margin_m"] < calm["support_margin_m"]
    path = write_arm(tmp_path / "arm.usda", standing(0.02))
    done = calmotion("simulate", path, "--step", "10ms", "--pre-roll", "0")
    assert done.returncode == 0 and f"{BASE} would tip over" in done.stdout


def test_a_base_stands_on_its_wheels_too(tmp_path):
    def edit(stage):
        standing(0.02)(stage)
        for y in (-0.2, 0.2):
            wheel = UsdGeom.Sphere.Define(stage, f"/Arm/wheel{'lr'[y > 0]}")
            wheel.CreateRadiusAttr(0.1)
            wheel.AddTranslateOp().Set(Gf.Vec3d(0.6, y, 0.1))
            UsdPhysics.RigidBodyAPI.Apply(wheel.GetPrim())
            UsdPhysics.MassAPI.Apply(wheel.GetPrim()).CreateMassAttr(1e-3)
            joint = UsdPhysics.RevoluteJoint.Define(stage, f"{wheel.GetPath()}/axle")
            joint.CreateBody0Rel().SetTargets([BASE])
            joint.CreateBody1Rel().SetTargets([wheel.GetPath()])
            joint.CreateAxisAttr("Y")
            joint.CreateLocalPos0Attr(Gf.Vec3f(0.6, y, -0.9))
            UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "angular").CreateTargetPositionAttr(0.0)

    row, _ = rows(tmp_path, edit)
    assert row["body"] == BASE and row["support_margin_m"] > 0.0


def test_a_base_that_a_joint_holds_does_not_tip(tmp_path):
    row, _ = rows(tmp_path, None)
    assert row["path"] == "/Arm/joints/stand" and row["support_margin_m"] is None and row["max_force_n"] > 20.0
