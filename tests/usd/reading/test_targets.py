"""Targets, authored and chosen."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model import Body, ElasticMaterial, FlexibleSettings, Frame, Joint, MassProperties, SurfaceMesh
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd.reading import read_shot
from calmotion.usd.reading.targets import default_targets
from pxr import Gf, Sdf, UsdGeom
from small_shots import FORE, HAND, LENGTH, WIDTH, Scale, make_target, write_arm


def read(tmp_path, edit=None, scale=None):
    return read_both(tmp_path, edit, scale)[0]


def read_both(tmp_path, edit=None, scale=None):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit, scale)))[:2]


@pytest.mark.parametrize("scale", [Scale(), Scale(0.01, 0.001)])
def test_an_authored_target_is_a_frame_of_its_body(tmp_path, scale):
    def edit(stage):
        make_target(stage, positionWeight=2.0, rotationWeight=0.5)
        UsdGeom.Xformable(stage.GetPrimAtPath(HAND)).AddRotateZOp().Set(90.0)

    character = read(tmp_path, edit, scale)
    (target,) = character.targets
    assert target.path == HAND and character.bodies[target.body].path == FORE
    assert np.allclose(target.frame.position, [LENGTH, 0, 0], atol=1e-6)
    assert np.allclose(rotation_from_quaternion(target.frame.rotation)[:, 0], [0, 1, 0], atol=1e-6)
    assert (target.position_weight, target.rotation_weight) == (2.0, 0.5)


def test_a_target_on_a_scaled_body_is_where_it_looks(tmp_path):
    def edit(stage):
        make_target(stage)
        UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).AddScaleOp().Set(Gf.Vec3f(1, 1, 2))

    (target,) = read(tmp_path, edit).targets
    assert np.allclose(target.frame.position, [LENGTH, 0, 0], atol=1e-6)
    assert np.allclose(target.frame.rotation, [1, 0, 0, 0], atol=1e-6)


def test_a_body_itself_can_be_a_target(tmp_path):
    (target,) = read(tmp_path, lambda stage: make_target(stage, FORE)).targets
    assert np.allclose(target.frame.position, 0.0) and target.path == FORE


def test_without_targets_the_outermost_point_of_the_leaf_is_taken(tmp_path):
    character = read(tmp_path)
    (target,) = character.targets
    assert target.path == FORE
    assert np.allclose(np.abs(target.frame.position), [LENGTH, WIDTH / 2, WIDTH / 2], atol=1e-6)
    assert any("CalmTargetAPI" in note and FORE in note for note in character.notes)


def test_weights_in_time_become_a_track(tmp_path):
    def edit(stage):
        make_target(stage)
        weight = stage.GetPrimAtPath(HAND).CreateAttribute("calm:target:positionWeight", Sdf.ValueTypeNames.Float)
        weight.Set(3.0, 0.0)
        weight.Set(9.0, 10.0)

    def bad(stage):
        edit(stage)
        stage.GetPrimAtPath(HAND).GetAttribute("calm:target:positionWeight").Set(-1.0, 5.0)

    character, animation = read_both(tmp_path, edit)
    assert character.targets[0].position_weight == 3.0
    (track,) = animation.weights
    assert track.target == 0 and not track.rotation
    assert np.allclose(np.diff(track.times) * 24.0, 10.0) and np.array_equal(track.values, [3.0, 9.0])
    with pytest.raises(ShotError, match="negative") as caught:
        read_both(tmp_path, bad)
    assert caught.value.path == HAND and caught.value.attribute == "calm:target:positionWeight"


UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def lever_with_rod(flexible=(), tip=0.12):
    """Bodies and joints of a horn (0) whose rod (1) turns a lever (2), which ends at the tip above its hinge."""
    steel = ElasticMaterial("/steel", 2e11, 0.3, 7800.0)
    mass = MassProperties(0.1, np.zeros(3), 1e-4 * np.eye(3))
    ends = {"/horn": (0.0, 0.0, 0.02), "/rod": (0.1, 0.0, 0.0), "/lever": (0.0, 0.0, tip)}
    bodies = [
        Body(
            path,
            Frame(np.zeros(3), UPRIGHT),
            mass,
            surfaces=(SurfaceMesh(path, np.array([np.zeros(3), end]), np.zeros((0, 3), dtype=np.int32)),),
            flexible=FlexibleSettings(steel) if path in flexible else None,
        )
        for path, end in ends.items()
    ]
    pins = [(-1, 0, 0.0, 0.0), (0, 1, (0, 0, 0.02), 0.0), (-1, 2, (0.1, 0, 0), 0.0), (1, 2, (0.1, 0, 0), (0, 0, 0.02))]
    joints = [
        Joint(f"/pin{k}", "revolute", a, b, *(Frame(np.zeros(3) + place, UPRIGHT) for place in places))
        for k, (a, b, *places) in enumerate(pins)
    ]
    return bodies, joints


@pytest.mark.parametrize(("flexible", "tip", "expected"), [
    ((), 0.12, "/rod"), (("/lever",), 0.12, "/lever"), (("/rod",), 0.12, "/rod"), (("/lever", "/rod"), 0.12, "/lever"),
    (("/horn",), 0.12, "/rod"), (("/lever",), 0.03, "/rod"),
])  # fmt: skip
def test_the_target_of_a_linkage_is_the_flexible_link_that_reaches_beyond_it(flexible, tip, expected):
    (target,) = default_targets(*lever_with_rod(flexible, tip), [1])
    assert target.path == expected
    if expected == "/lever":
        np.testing.assert_allclose(target.frame.position, [0.0, 0.0, tip])


def test_a_link_that_carries_a_leaf_is_no_target():
    bodies, joints = lever_with_rod(("/lever",))
    hand = Body("/hand", bodies[0].rest, bodies[0].mass)
    wrist = Joint("/wrist", "revolute", 2, 3, Frame(np.array([0.0, 0.0, 0.1]), UPRIGHT), Frame(np.zeros(3), UPRIGHT))
    found = default_targets([*bodies, hand], [*joints, wrist], [1, 3])
    assert [target.path for target in found] == ["/rod", "/hand"]
