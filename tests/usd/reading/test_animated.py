"""What a spline animates is seen where what time samples animate is."""

import numpy as np
import pytest
import small_shots as shots
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from calmotion.usd.reading.animated import animation_codes
from posed_shots import still_drives
from pxr import Gf, Sdf, Ts, Usd, UsdGeom, UsdPhysics
from small_shots import BASE, ELBOW, FORE, FRAMES, HAND, UPPER, make_target, write_arm

KNOTS = ((0.0, 0.0), (12.0, 0.2), (24.0, 0.0))


def spline(kind, knots=KNOTS, **extrapolation):
    curve = Ts.Spline(kind)
    for time, value in knots:
        knot = Ts.Knot(typeName=kind, time=time, value=value, nextInterp=Ts.InterpCurve)
        knot.SetPreTanWidth(4.0)
        knot.SetPostTanWidth(4.0)
        curve.SetKnot(knot)
    if extrapolation:
        curve.SetPostExtrapolation(Ts.Extrapolation(extrapolation["post"]))
    return curve


def attribute_with(curve):
    stage = Usd.Stage.CreateInMemory()
    attribute = stage.DefinePrim("/a").CreateAttribute("a", Sdf.ValueTypeNames.Double)
    attribute.SetSpline(curve)
    return attribute, stage


def test_codes_of_a_spline_are_its_knots_and_points_between():
    attribute, _stage = attribute_with(spline("double"))
    assert animation_codes(attribute) == pytest.approx([0, 4, 8, 12, 16, 20, 24])
    assert animation_codes(attribute, 1) == [0, 12, 24]
    attribute, _stage = attribute_with(spline("double", KNOTS[:1], post=Ts.ExtrapLinear))
    assert animation_codes(attribute) == [0.0, 1.0]


def test_samples_go_before_a_spline_and_nothing_has_no_codes():
    attribute, _stage = attribute_with(spline("double"))
    attribute.Set(3.0, 7.0)
    assert animation_codes(attribute) == [7.0]
    attribute.Clear()
    assert animation_codes(attribute) == []


def moving_base(by_spline):
    def edit(stage):
        make_target(stage, HAND)
        stage.RemovePrim("/Arm/joints/stand")
        base = stage.GetPrimAtPath(BASE)
        UsdPhysics.RigidBodyAPI(base).CreateKinematicEnabledAttr(True)
        xform = UsdGeom.Xformable(base)
        xform.ClearXformOpOrder()
        along, curve = xform.AddTranslateXOp(), spline("double")
        xform.AddTranslateZOp().Set(1.0)
        if by_spline:
            along.GetAttr().SetSpline(curve)
        else:
            for frame in range(FRAMES + 1):
                along.Set(curve.Eval(frame), frame)

    return edit


def test_a_root_that_a_spline_moves_moves(tmp_path):
    frames = []
    for by_spline in (True, False):
        _, animation, _ = read_shot(str(write_arm(tmp_path / f"{by_spline}.usda", moving_base(by_spline))))
        (frame,) = animation.moving
        frames.append({round(24.0 * t): p for t, p in zip(frame.times, frame.positions, strict=True)})
    assert np.ptp([place[0] for place in frames[0].values()]) == pytest.approx(0.2)
    assert all(np.allclose(frames[0][k], frames[1][k], atol=1e-9) for k in range(FRAMES + 1))


def test_bodies_that_splines_pose_move_the_motors(tmp_path):
    def edit(stage):
        still_drives(stage)
        for path, sign in ((UPPER, 1.0), (FORE, 0.0)):
            turn = UsdGeom.Xformable(stage.GetPrimAtPath(path)).AddRotateYOp(UsdGeom.XformOp.PrecisionDouble)
            turn.GetAttr().SetSpline(spline("double", [(t, sign * 100.0 * v) for t, v in KNOTS]))

    character, animation, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    for motor, track in zip(character.motors, animation.tracks, strict=True):
        highest = -20.0 if motor.path == ELBOW else 20.0
        assert np.rad2deg(track.values[np.isclose(track.times, 0.5)]) == pytest.approx(highest)


def test_a_limit_and_a_mass_by_splines_are_those_of_their_first_knots(tmp_path):
    def edit(stage):
        for path, name, value in ((ELBOW, "physics:upperLimit", 50.0), (FORE, "physics:mass", 0.75)):
            attribute = stage.GetPrimAtPath(path).GetAttribute(name)
            attribute.Clear()
            attribute.SetSpline(spline("float", [(0.0, value), (24.0, 60.0)]))

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    (elbow,) = [joint for joint in character.joints if joint.path == ELBOW]
    assert np.rad2deg(elbow.upper) == pytest.approx(50.0)
    assert [body.mass.mass for body in character.bodies if body.path == FORE] == [0.75]
    for name in (f"{ELBOW}.physics:upperLimit", f"{FORE}.physics:mass"):
        assert any(note.startswith(f"{name}: it is animated") for note in character.notes)


def test_a_weight_by_a_spline_changes_in_time(tmp_path):
    def edit(stage):
        make_target(stage, HAND, positionWeight=1.0)
        weight = stage.GetPrimAtPath(HAND).GetAttribute("calm:target:positionWeight")
        weight.Clear()
        weight.SetSpline(spline("float", [(0.0, 0.0), (24.0, 3.0)]))

    _, animation, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    (weights,) = animation.weights
    assert weights.values[0] == 0.0 and weights.values[-1] == 3.0 and len(weights.times) > 24


MASS = "physics:mass"


def arm(folder, *samples, default=None):
    def edit(stage):
        attribute = stage.GetPrimAtPath(shots.FORE).GetAttribute(MASS)
        attribute.Clear()
        if default is not None:
            attribute.Set(default)
        for code, value in samples:
            attribute.Set(value, code)

    character, _, _ = read_shot(str(shots.write_arm(folder / "shot.usda", edit)))
    (body,) = [body for body in character.bodies if body.path == shots.FORE]
    return body.mass.mass, [note for note in character.notes if MASS in note]


def test_a_single_sample_is_the_value(tmp_path):
    assert arm(tmp_path, (7.0, 0.75)) == (pytest.approx(0.75), [])


@pytest.mark.parametrize(("default", "used"), [(None, 0.75), (2.0, 2.0)])
def test_samples_that_differ_are_told_with_the_value_that_is_used(tmp_path, default, used):
    mass, notes = arm(tmp_path, (0.0, 0.75), (12.0, 3.0), default=default)
    assert mass == pytest.approx(used)
    (note,) = notes
    assert note.startswith(f"{shots.FORE}.{MASS}: it is animated") and f"{used} is used" in note


def read(tmp_path, edit):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0]


def move(stage, path: str, far: float) -> None:
    op = UsdGeom.Xformable(stage.GetPrimAtPath(path)).AddTranslateOp(opSuffix="moved")
    op.Set(Gf.Vec3d(0, 0, 0), 0)
    op.Set(Gf.Vec3d(far, 0, 0), 12)


@pytest.mark.parametrize("path", [BASE, "/Arm"])
def test_a_moving_root_that_is_fixed_to_the_world_is_refused_with_the_prim_that_moves_it(tmp_path, path):
    with pytest.raises(ShotError, match="holds it in the world") as caught:
        read(tmp_path, lambda stage: move(stage, path, 0.1))
    assert caught.value.path == path and "12" in caught.value.found and "kinematicEnabled" in caught.value.remedy


def test_a_root_with_samples_that_stands_still_is_fine(tmp_path):
    assert len(read(tmp_path, lambda stage: move(stage, "/Arm", 0.0)).bodies) == 3


def test_baked_transforms_of_other_bodies_give_a_note(tmp_path):
    character = read(tmp_path, lambda stage: move(stage, FORE, 0.5))
    assert any(FORE in note and "drives alone" in note for note in character.notes)
