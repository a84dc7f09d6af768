"""The same character in other units, with another axis up, or read again, is the same."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.usd.reading import read_shot
from calmotion.usd.writing import write_result
from performing import result_with
from posed_shots import posed, skeletal
from pxr import Gf, Sdf, Usd, UsdGeom
from small_shots import HAND, Scale, make_target, write_arm

Z_TO_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # what was up along z is up along y
SOURCES = {"drives": None, "bodies": posed, "skeleton": skeletal}


def targeted(edit, scale=None):
    def change(stage):
        if edit is not None:
            edit(stage)
        make_target(stage, HAND)

    return change


def y_up(stage) -> None:
    """Turn the whole shot so that y is up: every prim of the world that nothing else carries."""
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 0, 0), -90.0))
    top = UsdGeom.Xformable(stage.GetPrimAtPath("/Arm"))
    top.AddTransformOp().Set(turn)
    # the stand holds the base in the world, whose axes are others now
    stand = stage.GetPrimAtPath("/Arm/joints/stand")
    stand.GetAttribute("physics:localPos0").Set(Gf.Vec3f(turn.Transform(stand.GetAttribute("physics:localPos0").Get())))
    stand.GetAttribute("physics:localRot0").Set(Gf.Quatf(turn.ExtractRotationQuat()))


def motion_of(path):
    character, animation, _ = read_shot(str(path))
    result = simulate_shot(compile_shot(character, animation, None), RunSettings(step=1 / 240), lambda *_: None)
    return result.before.motion


def apart(one, other, turn=None) -> tuple[float, float]:
    """Largest differences of positions, over the size of the arm, and of efforts, over the largest."""
    there = one.target_positions if turn is None else one.target_positions @ turn.T
    effort = np.abs(one.motor_efforts).max()
    return np.abs(there - other.target_positions).max() / 0.8, np.abs(
        one.motor_efforts - other.motor_efforts
    ).max() / effort


@pytest.mark.parametrize("source", SOURCES)
def test_units_do_not_matter(tmp_path, source):
    metres = motion_of(write_arm(tmp_path / "m.usda", targeted(SOURCES[source])))
    centimetres = motion_of(write_arm(tmp_path / "cm.usda", targeted(SOURCES[source]), Scale(0.01, 0.001)))
    far, effort = apart(metres, centimetres)
    assert far < 1e-6 and effort < 1e-6


@pytest.mark.parametrize("source", SOURCES)
def test_the_axis_that_is_up_does_not_matter(tmp_path, source):
    z = motion_of(write_arm(tmp_path / "z.usda", targeted(SOURCES[source])))

    def turned(stage):
        targeted(SOURCES[source])(stage)
        y_up(stage)

    y = motion_of(write_arm(tmp_path / "y.usda", turned))
    far, effort = apart(z, y, Z_TO_Y)
    assert far < 1e-6 and effort < 1e-5  # the turn's quaternion is in single precision


def same(one, other) -> float:
    """Largest difference of all numbers of two values of dataclasses."""
    if dataclasses.is_dataclass(one):
        return max((same(getattr(one, f.name), getattr(other, f.name)) for f in dataclasses.fields(one)), default=0.0)
    if isinstance(one, (tuple, list)):
        assert len(one) == len(other)
        return max((same(a, b) for a, b in zip(one, other, strict=True)), default=0.0)
    if isinstance(one, (np.ndarray, float)):
        both_infinite = np.isinf(one) & np.isinf(other)
        with np.errstate(invalid="ignore"):
            return float(np.max(np.where(both_infinite, 0.0, np.abs(np.subtract(one, other))), initial=0.0))
    assert one == other
    return 0.0


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("changed", [False, True], ids=["unchanged", "changed"])
def test_what_is_written_and_read_again_is_the_same(tmp_path, source, changed):
    shot = write_arm(tmp_path / "arm.usda", targeted(SOURCES[source]))
    character, animation, provenance = read_shot(str(shot))
    result = result_with(character, animation, {1: 0.1} if changed else {})
    _, root = write_result(character, animation, provenance, result, str(tmp_path / "calm.usda"))
    again, animated, _ = read_shot(root)
    assert same(dataclasses.replace(character, notes=()), dataclasses.replace(again, notes=())) < 1e-9
    assert same(animation.tracks, animated.tracks) < 1e-9
    if not changed:
        assert same(animation.tracks, animated.current) < 1e-9


@pytest.mark.parametrize("source", SOURCES)
def test_a_shot_that_is_saved_by_usd_is_the_same(tmp_path, source):
    shot = write_arm(tmp_path / "arm.usda", targeted(SOURCES[source]))
    stage = Usd.Stage.Open(str(shot))
    stage.Flatten().Export(str(tmp_path / "flat.usdc"))
    Sdf.Layer.FindOrOpen(str(shot)).Export(str(tmp_path / "again.usda"))
    first = read_shot(str(shot))
    for name in ("flat.usdc", "again.usda"):
        character, animation, _ = read_shot(str(tmp_path / name))
        assert same(first[0], character) < 1e-9 and same(first[1], animation) < 1e-9
