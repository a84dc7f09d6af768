"""Baked motion, opened again with the shot: every point is where the motion says, whatever the prims are like."""

from types import SimpleNamespace

import numpy as np
import pytest
from calmotion.model import Motion, Skin
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd import gf
from calmotion.usd.clock import Clock
from calmotion.usd.reading import read_shot
from calmotion.usd.writing.bake import BakedMotion, bake_bodies, bake_points, simulated_motion
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics
from small_shots import ELBOW, FORE, UPPER, Scale, box, write_arm

FRAMES = np.arange(5) / 24.0
CLOCK = Clock(0.0, 24.0, 24.0, 24.0)


def baked(tmp_path, edit=None, scale=None, modes: int = 0):
    """A shot with a random motion baked over it: character, motion, skins, composed stage."""
    scale = scale or Scale()
    shot = write_arm(tmp_path / "arm.usda", edit, scale)
    character, _, _ = read_shot(str(shot))
    rng = np.random.default_rng(7)
    count = len(character.bodies)
    turns = rng.normal(size=(len(FRAMES), count, 4))
    motion = BakedMotion(
        FRAMES,
        rng.normal(size=(len(FRAMES), count, 3)),
        turns / np.linalg.norm(turns, axis=2, keepdims=True),
        tuple(0.01 * rng.normal(size=(len(FRAMES), modes)) for _ in range(count)),
    )
    skins = tuple(
        Skin(tuple(rng.normal(size=(len(s.points), 3, modes)) for s in body.surfaces)) if modes else None
        for body in character.bodies
    )
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(str(shot))
    bake_bodies(layer, stage, character, motion, CLOCK, scale.meters)
    bake_points(layer, stage, character, skins, motion, CLOCK, scale.meters)
    root = Sdf.Layer.CreateAnonymous(".usda")
    root.subLayerPaths = [layer.identifier, str(shot)]
    return SimpleNamespace(character=character, motion=motion, skins=skins, layer=layer, stage=Usd.Stage.Open(root))


def assert_points_where_the_motion_says(found, scale=None) -> int:
    """Compare every mesh point in world space; returns how many meshes were compared."""
    meters = (scale or Scale()).meters
    compared = 0
    for frame in range(len(FRAMES)):
        xforms = UsdGeom.XformCache(frame)
        for k, body in enumerate(found.character.bodies):
            turn = rotation_from_quaternion(found.motion.rotations[frame, k])
            for s, surface in enumerate(body.surfaces):
                if surface.displaced == 0:
                    continue
                points = surface.points
                if found.skins[k] is not None:
                    points = points + found.skins[k].modes[s] @ found.motion.elastic[k][frame]
                expected = points @ turn.T + found.motion.positions[frame, k]
                prim = found.stage.GetPrimAtPath(surface.path)
                world = gf.matrix(xforms.GetLocalToWorldTransform(prim))
                own = gf.points(prim.GetAttribute("points").Get(frame))
                assert np.allclose(meters * (own @ world[:3, :3].T + world[:3, 3]), expected, atol=2e-6)
                compared += 1
    return compared


def scaled(stage) -> None:
    UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).AddScaleOp().Set(Gf.Vec3f(2, 0.5, 3))
    UsdGeom.Xformable(stage.GetPrimAtPath(f"{FORE}/skin")).AddRotateXOp().Set(30.0)


def mirrored(stage) -> None:
    UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))


def below_a_moved_root(stage) -> None:
    root = UsdGeom.Xformable(stage.GetPrimAtPath("/Arm"))
    root.AddTranslateOp().Set(Gf.Vec3d(3, -1, 2))
    root.AddRotateZOp().Set(40.0)
    stage.GetPrimAtPath("/Arm/joints/stand").GetRelationship("physics:body0").SetTargets(["/Arm"])


def with_reset_stack(stage) -> None:
    below_a_moved_root(stage)
    UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).SetResetXformStack(True)


def nested(stage) -> None:
    """A finger below the forearm, under an ordinary transform of the forearm."""
    holder = UsdGeom.Xform.Define(stage, f"{FORE}/holder")
    holder.AddTranslateOp().Set(Gf.Vec3d(0.4, 0, 0))
    holder.AddRotateYOp().Set(15.0)
    finger = UsdGeom.Xform.Define(stage, f"{FORE}/holder/finger")
    finger.AddTranslateOp().Set(Gf.Vec3d(0, 0.01, 0))
    UsdPhysics.RigidBodyAPI.Apply(finger.GetPrim())
    UsdPhysics.MassAPI.Apply(finger.GetPrim()).CreateDensityAttr(1000.0)
    box(stage, f"{FORE}/holder/finger/skin", Scale())
    joint = UsdPhysics.FixedJoint.Define(stage, "/Arm/joints/finger")
    joint.CreateBody0Rel().SetTargets([FORE])
    joint.CreateBody1Rel().SetTargets([f"{FORE}/holder/finger"])


@pytest.mark.parametrize("edit", [None, scaled, mirrored, below_a_moved_root, with_reset_stack, nested])
@pytest.mark.parametrize("modes", [0, 3])
def test_every_point_is_where_the_motion_says(tmp_path, edit, modes):
    found = baked(tmp_path, edit, modes=modes)
    assert assert_points_where_the_motion_says(found) >= len(FRAMES)


def test_units_of_the_stage_are_kept(tmp_path):
    scale = Scale(0.01, 0.001)
    found = baked(tmp_path, scale=scale, modes=2)
    assert assert_points_where_the_motion_says(found, scale) == len(FRAMES)


def test_rigid_bodies_keep_the_points_of_their_meshes(tmp_path):
    found = baked(tmp_path)
    assert not found.layer.GetPrimAtPath(f"{FORE}/skin")


def test_the_extent_contains_the_deformed_points(tmp_path):
    found = baked(tmp_path, modes=2)
    mesh = found.stage.GetPrimAtPath(f"{FORE}/skin")
    points = gf.points(mesh.GetAttribute("points").Get(3))
    extent = gf.points(mesh.GetAttribute("extent").Get(3))
    assert np.allclose(extent, [points.min(axis=0), points.max(axis=0)])


def test_only_bodies_and_their_meshes_are_written(tmp_path):
    found = baked(tmp_path, modes=2)
    assert found.layer.GetPrimAtPath(UPPER).specifier == Sdf.SpecifierOver
    assert not found.layer.GetPrimAtPath(ELBOW) and not found.layer.GetPrimAtPath(f"{UPPER}/box")


def motion(times: np.ndarray) -> Motion:
    count = len(times)
    positions = np.zeros((count, 1, 3))
    positions[:, 0, 0] = times
    none = np.zeros((count, 0))
    return Motion(times, positions, np.tile([1.0, 0, 0, 0], (count, 1, 1)), (times[:, None],), none, none, none, none)


def test_frames_are_picked_out_of_the_steps_without_the_pre_roll():
    frames = np.arange(25) / 24.0
    found = simulated_motion(motion((np.arange(24 * 20 + 48 + 1) - 48) / 480.0), frames)
    assert np.array_equal(found.times, frames)
    assert np.allclose(found.positions[:, 0, 0], frames) and np.allclose(found.elastic[0][:, 0], frames)


def test_an_interrupted_run_gives_the_frames_it_reached():
    found = simulated_motion(motion(np.arange(100) / 480.0), np.arange(25) / 24.0)
    assert len(found.times) == 5
