"""Characters without motors: a linkage that hangs on a root which the shot moves."""

from __future__ import annotations

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.usd.transforms import rotation_from_quaternion
from pxr import Gf, UsdGeom, UsdPhysics
from small_shots import BASE, ELBOW, FRAMES, SHOULDER, TARGET_POSITION, write_arm

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
