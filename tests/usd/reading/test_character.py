"""The whole character: order, what is left out, what holds it."""

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import WORLD
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd.reading import read_shot
from pxr import Gf, UsdGeom, UsdPhysics
from small_shots import (
    BASE,
    ELBOW,
    FORE,
    FRAMES,
    SHOULDER,
    TARGET_POSITION,
    UPPER,
    Scale,
    box,
    clear_mass,
    write_arm,
)


def read(tmp_path, edit=None, scale=None, name="arm.usda"):
    return read_shot(str(write_arm(tmp_path / name, edit, scale)))[0]


def test_bodies_and_joints_go_from_the_world_outwards(tmp_path):
    def leaf_first(stage):
        order = ["fore", "upper", "joints", "base"]
        stage.GetRootLayer().GetPrimAtPath("/Arm").nameChildrenOrder = order

    character = read(tmp_path, leaf_first)
    assert [b.path for b in character.bodies] == [BASE, UPPER, FORE]
    assert [j.path for j in character.joints] == ["/Arm/joints/stand", SHOULDER, ELBOW]
    assert [m.joint for m in character.motors] == [1, 2]
    assert character.path == "/Arm"


def test_without_a_default_prim_the_root_is_the_common_parent_of_all_bodies(tmp_path):
    character = read(tmp_path, lambda stage: stage.ClearDefaultPrim())
    assert character.path == "/Arm"


def test_a_character_without_a_joint_to_the_world_is_held_at_its_pose(tmp_path):
    character = read(tmp_path, lambda stage: stage.RemovePrim("/Arm/joints/stand"))
    held = character.joints[0]
    assert (held.kind, held.body0, character.bodies[held.body1].path) == ("fixed", WORLD, BASE)
    assert np.allclose(held.frame0.position, [0, 0, 1])
    assert any("fixed at its pose" in note and BASE in note for note in character.notes)


def test_a_kinematic_body_is_the_root(tmp_path):
    def edit(stage):
        stage.RemovePrim("/Arm/joints/stand")
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(FORE)).CreateKinematicEnabledAttr(True)

    character = read(tmp_path, edit)
    assert character.bodies[character.joints[0].body1].path == FORE


def test_bodies_that_no_motor_moves_are_removed_with_a_note(tmp_path):
    def edit(stage):
        drum = UsdGeom.Cube.Define(stage, "/Drum").GetPrim()
        UsdPhysics.RigidBodyAPI.Apply(drum)
        lid = UsdGeom.Cube.Define(stage, "/Lid").GetPrim()
        UsdPhysics.RigidBodyAPI.Apply(lid)
        slide = UsdPhysics.DistanceJoint.Define(stage, "/Slide")  # not supported, and no part of the character
        slide.CreateBody0Rel().SetTargets(["/Drum"])
        slide.CreateBody1Rel().SetTargets(["/Lid"])

    character = read(tmp_path, edit)
    assert [b.path for b in character.bodies] == [BASE, UPPER, FORE]
    assert any("/Drum" in note and "not simulated" in note for note in character.notes)


def test_nested_bodies_have_their_own_poses(tmp_path):
    def edit(stage):
        nested = UsdGeom.Xform.Define(stage, f"{FORE}/finger")
        nested.AddTranslateOp().Set(Gf.Vec3d(0.4, 0, 0))
        UsdPhysics.RigidBodyAPI.Apply(nested.GetPrim())
        box(stage, f"{FORE}/finger/skin", Scale())
        UsdPhysics.MassAPI.Apply(nested.GetPrim()).CreateDensityAttr(1000.0)
        joint = UsdPhysics.FixedJoint.Define(stage, "/Arm/joints/finger")
        joint.CreateBody0Rel().SetTargets([FORE])
        joint.CreateBody1Rel().SetTargets([f"{FORE}/finger"])
        joint.CreateLocalPos0Attr(Gf.Vec3f(0.4, 0, 0))

    character = read(tmp_path, edit)
    finger = character.bodies[-1]
    assert finger.path == f"{FORE}/finger" and np.allclose(finger.rest.position, [0.8, 0, 1], atol=1e-6)
    assert character.targets[0].path == f"{FORE}/finger"


def test_a_disabled_body_is_ignored(tmp_path):
    def edit(stage):
        UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(BASE)).CreateRigidBodyEnabledAttr(False)

    character = read(tmp_path, edit)
    assert [b.path for b in character.bodies] == [UPPER, FORE]
    shoulder = character.joints[0]
    assert shoulder.path == SHOULDER and shoulder.body0 == WORLD
    assert np.allclose(shoulder.frame0.position, [0, 0, 1])


def test_a_base_that_is_fixed_needs_no_mass(tmp_path):
    def edit(stage):
        clear_mass(stage, BASE)

    def loose(stage):
        edit(stage)
        stage.RemovePrim("/Arm/joints/stand")

    for change in (edit, loose):  # the second one is fixed at its pose
        character = read(tmp_path, change)
        assert character.bodies[0].path == BASE and character.bodies[0].mass.mass > 0.0
        assert any(BASE in note and "it has no mass" in note for note in character.notes)


@pytest.mark.parametrize(("kilograms", "warned"), [(1.0, False), (1e-6, True), (1e4, True)])
def test_a_robot_of_a_strange_weight_is_questioned(tmp_path, kilograms, warned):
    character = read(tmp_path, lambda stage: UsdPhysics.SetStageKilogramsPerUnit(stage, kilograms))
    said = [note for note in character.notes if "the robot weighs" in note]
    assert bool(said) == warned
    assert all("kilogramsPerUnit" in note and "metersPerUnit" in note for note in said)


SWAY = 0.02


def passive(stage, kinematic=True):
    """Both hinges free and hanging down, on a base that sways along y, across their axes, which are along x."""
    stage.RemovePrim("/Arm/joints/stand")
    for path in (SHOULDER, ELBOW):
        prim = stage.GetPrimAtPath(path)
        prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")
        prim.RemoveProperty(TARGET_POSITION)
    base = UsdGeom.Xformable(stage.GetPrimAtPath(BASE))
    UsdPhysics.RigidBodyAPI(base).CreateKinematicEnabledAttr(kinematic)
    op = base.GetOrderedXformOps()[0]
    for frame in range(FRAMES + 1):
        op.Set(Gf.Vec3d(SWAY * 0.5 * (1.0 - np.cos(2.0 * np.pi * frame / FRAMES)), 0.0, 1.0), frame)


@pytest.mark.parametrize("kinematic", [True, False])
def test_a_passive_linkage_swings_with_its_root(tmp_path, kinematic):
    path = write_arm(tmp_path / "arm.usda", lambda stage: passive(stage, kinematic))
    result = cm.simulate(path, step=1 / 240, pre_roll=0.0)
    character, motion = result.shot.character, result.result.before.motion
    assert not character.motors and any("move freely" in note for note in character.notes)
    # forces on what hangs are those that its centre of mass needs, so momentum is conserved
    masses = np.array([body.mass.mass for body in character.bodies])
    base = next(k for k, body in enumerate(character.bodies) if body.path == BASE)
    root = next(k for k, joint in enumerate(character.joints) if joint.body0 < 0)
    R = rotation_from_quaternion(motion.rotations)
    centers = motion.positions + np.einsum("nbij,bj->nbi", R, np.array([b.mass.center for b in character.bodies]))
    momentum = np.einsum("b,nbi->ni", masses, np.gradient(centers, motion.times, axis=0))
    needed = np.gradient(momentum, motion.times, axis=0) - masses.sum() * character.gravity
    inner = slice(10, -10)
    np.testing.assert_allclose(motion.joint_forces[inner, root], needed[inner], atol=0.02 * masses.sum() * 9.81)
    swing = np.ptp(motion.positions[:, base + 2] - motion.positions[:, base], axis=0)
    assert swing.max() > 1e-3, "it swings"


def test_there_is_nothing_to_optimise_without_motors(tmp_path):
    with pytest.raises(ShotError, match="the shot has no motors"):
        cm.optimize(write_arm(tmp_path / "arm.usda", passive), step=1 / 48, pre_roll=0.0)


def test_operations_that_stand_still_may_be_left_out(tmp_path):
    def edit(stage):
        stage.GetPrimAtPath(FORE).RemoveProperty("xformOpOrder")

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert any("do not meet" in note for note in character.notes)
