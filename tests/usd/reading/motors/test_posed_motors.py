"""Motors that are animated by the transforms of their bodies."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from performing import worst_gap
from posed_shots import pose, posed, posed_by_pivots, still_drives
from pxr import Gf, UsdGeom, UsdPhysics
from small_shots import ELBOW, FORE, FRAMES, SHOULDER, TARGET_POSITION, UPPER, Scale, angles, write_arm

FRAME = np.arange(FRAMES + 1)


def read(tmp_path, edit, scale=None):
    path = write_arm(tmp_path / "arm.usda", edit, scale)
    return path, *read_shot(str(path))[:2]


@pytest.mark.parametrize("edit", [posed, posed_by_pivots], ids=lambda edit: edit.__name__)
def test_angles_follow_from_any_stack_of_transforms(tmp_path, edit):
    path, character, animation = read(tmp_path, edit)
    assert [motor.source for motor in character.motors] == ["bodies", "bodies"]
    for track, meant in zip(animation.tracks, angles(FRAME), strict=True):
        assert np.allclose(track.times, FRAME / 24.0) and np.abs(track.values - np.radians(meant)).max() < 1e-7
    far, turned = worst_gap(path, character, animation)
    assert far < 1e-6 and turned < 1e-6


def test_many_revolutions_are_unwrapped(tmp_path):
    def turn(frame):
        return 60.0 * frame, -45.0 * frame

    def edit(stage):
        posed(stage, turn=turn)
        for path in (SHOULDER, ELBOW):
            for side in ("lower", "upper"):
                stage.GetPrimAtPath(path).GetAttribute(f"physics:{side}Limit").Clear()

    _, _, animation = read(tmp_path, edit)
    for track, meant in zip(animation.tracks, turn(FRAME), strict=True):
        assert np.abs(track.values - np.radians(meant)).max() < 1e-6


@pytest.mark.parametrize("first", [-92.0, 120.0, 179.0, -179.0])
def test_an_angle_beyond_90_degrees_is_read_unchanged(tmp_path, first):
    _, _, animation = read(tmp_path, lambda stage: posed(stage, turn=lambda frame: (first + 0.01 * frame, -first)))
    assert np.degrees([track.values[0] for track in animation.tracks]) == pytest.approx([first, -first])


def test_sparse_samples_follow_what_usd_composes_at_the_frames(tmp_path):
    path, character, animation = read(tmp_path, lambda stage: posed(stage, frames=(0, 7.5, 24)))
    assert 7.5 / 24 in animation.tracks[0].times
    # between samples USD blends matrices, whose translation leaves the anchors; the turn is what a motor can do
    _, turned = worst_gap(path, character, animation)
    assert turned < 1e-6
    assert any("away from its joint frame" in note for note in character.notes)


def test_nested_bodies_are_read_with_their_composed_transforms(tmp_path):
    def edit(stage):
        posed(stage)
        # a forearm whose transform is relative to a prim that moves as well
        carrier = UsdGeom.Xform.Define(stage, "/Arm/carrier")
        sway = carrier.AddTranslateOp()
        for frame in range(FRAMES + 1):
            sway.Set(Gf.Vec3d(0, 0.01 * frame, 0), frame)
        fore = UsdGeom.Xformable(stage.GetPrimAtPath(UPPER))
        fore.SetResetXformStack(True)

    path, character, animation = read(tmp_path, edit)
    assert max(worst_gap(path, character, animation)) < 1e-6


def test_an_animated_drive_beats_animated_bodies(tmp_path):
    def edit(stage):
        posed(stage, turn=lambda frame: (5.0 * np.sin(frame), 0.0 * frame))
        drive = stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION)
        for frame in FRAME:
            drive.Set(float(angles(frame)[1]), float(frame))

    _, character, animation = read(tmp_path, edit)
    assert [motor.source for motor in character.motors] == ["bodies", "drive"]
    assert np.abs(animation.tracks[1].values - np.radians(angles(FRAME)[1])).max() < 1e-6


def test_a_motor_that_rests_in_a_posed_shot_holds_its_pose(tmp_path):
    _, character, animation = read(tmp_path, lambda s: posed(s, turn=lambda f: (f, 25.0 + 0.0 * f)))
    assert character.motors[1].source == "bodies"
    assert np.abs(animation.tracks[1].values - np.radians(25.0)).max() < 1e-7


def test_what_a_motor_cannot_do_is_reported_with_its_size(tmp_path):
    def edit(stage):
        posed(stage)
        op = UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).GetOrderedXformOps()[0]
        for frame in range(FRAMES + 1):
            tilt = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 0, 0), 0.25 * frame))
            away = Gf.Matrix4d().SetTranslate(Gf.Vec3d(0, 0.002 * frame / FRAMES, 0))
            op.Set(tilt * pose(frame, 1.0)[1] * away, frame)

    _, character, _ = read(tmp_path, edit)
    tilted, gap = (
        next(n for n in character.notes if word in n) for word in ("off its axis", "away from its joint frame")
    )
    assert ELBOW in tilted and "6 degrees" in tilted and "time code 24" in tilted
    assert ELBOW in gap and "2 mm" in gap


def test_a_joint_without_a_drive_stays_free_in_a_posed_shot(tmp_path):
    def edit(stage):
        posed(stage)
        stage.GetPrimAtPath(ELBOW).RemoveAppliedSchema("PhysicsDriveAPI:angular")

    _, character, _ = read(tmp_path, edit)
    assert len(character.motors) == 1 and len(character.joints) == 3


def test_a_character_that_nothing_animates_is_read_where_that_is_allowed(tmp_path):
    def edit(stage):
        still_drives(stage)
        for code in (0, 3):
            UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).GetOrderedXformOps()[0].Set(Gf.Vec3d(0.4, 0, 1), code)
        for path in (SHOULDER, ELBOW):
            stage.GetPrimAtPath(path).AddAppliedSchema("CalmMotorAPI")

    path = str(write_arm(tmp_path / "arm.usda", edit))
    with pytest.raises(ShotError, match="motor without animation"):
        read_shot(path)
    character, animation, _ = read_shot(path, still=True)
    assert len(character.motors) == 2 and all(np.ptp(track.values) < 1e-9 for track in animation.tracks)


def test_a_length_follows_from_bodies_that_slide(tmp_path):
    lift = 0.05 * (1.0 - np.cos(2.0 * np.pi * FRAME / FRAMES))

    def edit(stage):
        stage.RemovePrim(ELBOW)
        joint = UsdPhysics.PrismaticJoint.Define(stage, ELBOW)
        joint.CreateBody0Rel().SetTargets([UPPER])
        joint.CreateBody1Rel().SetTargets([FORE])
        joint.CreateAxisAttr("X")
        joint.CreateLocalPos0Attr(Gf.Vec3f(40.0, 0, 0))  # of a shot in centimetres
        UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "linear")
        stage.GetPrimAtPath(SHOULDER).GetAttribute(TARGET_POSITION).Clear()
        op = UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).GetOrderedXformOps()[0]
        for frame in range(FRAMES + 1):
            op.Set(Gf.Vec3d(40.0 + 100.0 * lift[frame], 0, 100.0), frame)

    path, character, animation = read(tmp_path, edit, Scale(0.01, 1.0))
    (motor,) = (motor for motor in character.motors if motor.linear)
    assert motor.source == "bodies" and motor.path == ELBOW
    assert np.abs(animation.tracks[character.motors.index(motor)].values - lift).max() < 1e-9
    assert max(worst_gap(path, character, animation)) < 1e-6
