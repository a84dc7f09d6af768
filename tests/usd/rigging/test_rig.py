"""A skinned character becomes a robot that does what the skeleton does."""

import hashlib
import json

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.usd import gf
from calmotion.usd.reading import read_shot
from calmotion.usd.rigging import RigOptions, rig_shot
from calmotion.usd.writing import write_result
from performing import followed, result_with
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

FRAMES, RATE = 24, 24.0
NAMES = ("root", "root/upper", "root/upper/hand")
LENGTH, WIDTH = 1.0, 0.2


def skinned(path, meters=1.0, turning_root=False, roll=True, animated=True, skin=True, up="Y"):
    """A tube with three joints along x: a still root, a hinge about z, and a hand that turns about two axes."""
    stage = Usd.Stage.CreateInMemory()
    stage.SetTimeCodesPerSecond(RATE)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(FRAMES)
    UsdGeom.SetStageMetersPerUnit(stage, meters)
    UsdGeom.SetStageUpAxis(stage, up)
    root = UsdSkel.Root.Define(stage, "/Worm")
    stage.SetDefaultPrim(root.GetPrim())
    root.AddTranslateOp().Set(Gf.Vec3d(0, 0.5 / meters, 0))
    skeleton = UsdSkel.Skeleton.Define(stage, "/Worm/Skeleton")
    step = LENGTH / meters
    rests = [Gf.Matrix4d(1.0), *(Gf.Matrix4d().SetTranslate(Gf.Vec3d(step, 0, 0)) for _ in range(2))]
    worlds = [Gf.Matrix4d().SetTranslate(Gf.Vec3d(step * k, 0, 0)) for k in range(3)]
    skeleton.CreateJointsAttr(NAMES)
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray(rests))
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray(worlds))
    animation = UsdSkel.Animation.Define(stage, "/Worm/Animation")
    UsdSkel.BindingAPI.Apply(root.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    animation.CreateJointsAttr(NAMES)
    animation.CreateScalesAttr([Gf.Vec3h(1, 1, 1)] * 3)
    translations, rotations = animation.CreateTranslationsAttr(), animation.CreateRotationsAttr()
    still = [Gf.Vec3f(m.ExtractTranslation()) for m in rests]
    translations.Set(still)
    rotations.Set([Gf.Quatf(1)] * 3)
    for frame in range(FRAMES + 1) if animated else ():
        s = np.sin(2 * np.pi * frame / FRAMES)
        hand = Gf.Rotation(Gf.Vec3d(0, 1, 0), 40.0 * s)
        if roll:
            hand = Gf.Rotation(Gf.Vec3d(1, 0, 0), 10.0 + 50.0 * np.cos(2 * np.pi * frame / FRAMES)) * hand
        turns = [
            Gf.Rotation(Gf.Vec3d(0, 1, 0), 20.0 * s if turning_root else 0.0),
            Gf.Rotation(Gf.Vec3d(0, 0, 1), 15.0 + 30.0 * s),
            hand,
        ]
        rotations.Set(Vt.QuatfArray([Gf.Quatf(turn.GetQuat()) for turn in turns]), frame)
        if turning_root:
            translations.Set([still[0] + Gf.Vec3f(0, 0, 0.1 * frame / FRAMES / meters), *still[1:]], frame)
    if skin:
        _skin(stage, root, skeleton, step, meters)
    stage.Export(str(path))
    return path


def _skin(stage, root, skeleton, step, meters):
    cells, width = 24, WIDTH / meters
    xs = np.linspace(-0.25, 2.75, cells + 1) * step
    ring = 0.5 * width * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    points = np.array([[x, y, z] for x in xs for y, z in ring])
    sides = [(i, k, (k + 1) % 4) for i in range(cells) for k in range(4)]
    quads = [(4 * i + k, 4 * i + n, 4 * (i + 1) + n, 4 * (i + 1) + k) for i, k, n in sides]
    quads += [(3, 2, 1, 0), (4 * cells, 4 * cells + 1, 4 * cells + 2, 4 * cells + 3)]
    mesh = UsdGeom.Mesh.Define(stage, "/Worm/Skin")
    mesh.CreatePointsAttr(gf.to_points(points))
    mesh.CreateFaceVertexCountsAttr([4] * len(quads))
    mesh.CreateFaceVertexIndicesAttr([int(k) for quad in quads for k in quad])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    owner = np.clip(np.floor(points[:, 0] / step + 1e-9), 0, 2).astype(int)
    binding.CreateJointIndicesPrimvar(False, 1).Set(Vt.IntArray([int(k) for k in owner]))
    binding.CreateJointWeightsPrimvar(False, 1).Set(Vt.FloatArray([1.0] * len(owner)))


def test_joints_get_the_fewest_hinges_that_follow_them(tmp_path):
    rig = rig_shot(str(skinned(tmp_path / "worm.usda")), str(tmp_path / "rig.usda"))
    assert {joint.joint: len(joint.motors) for joint in rig.joints} == {"root/upper": 1, "root/upper/hand": 2}
    assert max(joint.off for joint in rig.joints) < 1e-5
    assert rig.robot == "/Worm/Robot" and rig.bodies == 4  # with one servo
    assert rig.targets == ("/Worm/Robot/hand/target",)
    volume = 3.0 * LENGTH * WIDTH**2
    assert 1010.0 * volume == pytest.approx(rig.mass, rel=0.1)


@pytest.mark.parametrize("options", [{}, {"meters": 0.01}, {"turning_root": True}, {"up": "Z", "turning_root": True}])
def test_the_robot_does_what_the_skeleton_does(tmp_path, options):
    shot = skinned(tmp_path / "worm.usda", **options)
    rig = rig_shot(str(shot), str(tmp_path / "rig.usda"), RigOptions(angle_tolerance=1e-6))
    far, turned = followed(tmp_path / "rig.usda", rig.robot)
    assert far < 1e-6 and turned < 2e-6


def _scaled(stage):
    xform = UsdGeom.Xformable(stage.GetPrimAtPath("/Worm/Skeleton"))
    xform.AddRotateXOp().Set(-90.0)
    xform.AddScaleOp().Set(Gf.Vec3f(0.01))  # as Blender and Mixamo export characters


def _mirrored(stage):
    UsdGeom.Xformable(stage.GetPrimAtPath("/Worm")).AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))


def _large_joint(stage):
    UsdSkel.Animation(stage.GetPrimAtPath("/Worm/Animation")).GetScalesAttr().Set(
        [Gf.Vec3h(1, 1, 1), Gf.Vec3h(1.5, 1.5, 1.5), Gf.Vec3h(1, 1, 1)]
    )


@pytest.mark.parametrize("change", [_scaled, _mirrored, _large_joint])
def test_the_robot_follows_a_skeleton_with_scales(tmp_path, change):
    shot = skinned(tmp_path / "worm.usda")
    stage = Usd.Stage.Open(str(shot))
    change(stage)
    stage.Save()
    rig = rig_shot(str(shot), str(tmp_path / "rig.usda"), RigOptions(angle_tolerance=1e-6))
    far, turned = followed(tmp_path / "rig.usda", rig.robot)
    assert far < 1e-6 and turned < (2e-6 if change is not _mirrored else 3.0)  # a mirror image has no rotation
    assert rig.off < 1e-6 and rig.notes == ()


@pytest.mark.parametrize("turns", [True, False])
@pytest.mark.parametrize("what", ["translations", "scales"])
def test_joints_that_the_animation_moves_on_their_links_are_reported_with_the_distance(tmp_path, what, turns):
    shot = skinned(tmp_path / "worm.usda")
    stage = Usd.Stage.Open(str(shot))
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/Worm/Animation"))
    for frame in range(FRAMES + 1):
        grown = 1.0 + 0.2 * np.sin(np.pi * frame / FRAMES)
        if what == "translations":
            animation.GetTranslationsAttr().Set([Gf.Vec3f(0), Gf.Vec3f(1, 0, 0), Gf.Vec3f(grown, 0, 0)], frame)
        else:
            animation.GetScalesAttr().Set([Gf.Vec3h(1), Gf.Vec3h(grown), Gf.Vec3h(1)], frame)
        if not turns:  # the hand is a part of the link of the arm
            rotations = list(animation.GetRotationsAttr().Get(frame))
            animation.GetRotationsAttr().Set(Vt.QuatfArray([*rotations[:2], Gf.Quatf(1)]), frame)
    stage.Save()
    rig = rig_shot(str(shot), str(tmp_path / "rig.usda"))
    assert rig.off == pytest.approx(0.2, rel=2e-3)  # scales are half floats
    (note,) = rig.notes
    assert "/Worm/Skeleton" in note and "root/upper/hand by 200 mm at time code 12" in note
    character, _, _ = read_shot(str(tmp_path / "rig.usda"))
    assert any("is moved away from the joint above it" in told for told in character.notes) == turns


@pytest.mark.parametrize("instanced", [False, True])
def test_of_characters_side_by_side_the_one_that_moves_becomes_a_robot(tmp_path, instanced):
    skinned(tmp_path / "worm.usda")
    stage = Usd.Stage.CreateNew(str(tmp_path / "scene.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(FRAMES)
    for name in ("Still", "Moving"):
        prim = stage.DefinePrim(f"/{name}")
        prim.GetReferences().AddReference("./worm.usda", "/Worm")
        prim.SetInstanceable(instanced)
    stage.GetPrimAtPath("/Still").GetRelationship("skel:animationSource").SetTargets([])
    stage.SetDefaultPrim(stage.GetPrimAtPath("/Moving"))
    stage.Save()
    rig = rig_shot(str(tmp_path / "scene.usda"), str(tmp_path / "rig.usda"), RigOptions(angle_tolerance=1e-6))
    assert rig.robot == ("/Robot" if instanced else "/Moving/Robot") and rig.off < 1e-6
    assert {joint.joint: len(joint.motors) for joint in rig.joints} == {"root/upper": 1, "root/upper/hand": 2}


def test_rotations_of_a_skeleton_are_not_said_to_be_degrees_taken_for_radians(tmp_path):
    shot = skinned(tmp_path / "worm.usda")
    stage = Usd.Stage.Open(str(shot))
    stage.SetTimeCodesPerSecond(1000)
    stage.Save()
    rig_shot(str(shot), str(tmp_path / "rig.usda"))
    character, _, _ = read_shot(str(tmp_path / "rig.usda"))
    (told,) = (note for note in character.notes if "mean speed" in note)
    assert "timeCodesPerSecond" in told and "radians" not in told


def test_a_looser_tolerance_needs_fewer_hinges_and_reports_the_residual_angle(tmp_path):
    shot = skinned(tmp_path / "worm.usda")
    rig = rig_shot(str(shot), str(tmp_path / "rig.usda"), RigOptions(angle_tolerance=np.radians(80.0)))
    assert len(rig.joints) == 0 or sum(len(j.motors) for j in rig.joints) < 3


def test_a_root_that_moves_is_carried_by_its_transform(tmp_path):
    rig_shot(str(skinned(tmp_path / "worm.usda", turning_root=True)), str(tmp_path / "rig.usda"))
    _, animation, _ = read_shot(str(tmp_path / "rig.usda"))
    assert len(animation.moving) == 1
    assert np.ptp(animation.moving[0].positions[:, 2]) == pytest.approx(0.1, abs=1e-6)


def test_the_requested_links_are_flexible(tmp_path):
    shot = skinned(tmp_path / "worm.usda")
    rig_shot(str(shot), str(tmp_path / "rig.usda"), RigOptions(material="pla", flexible=("upper",)))
    character, _, _ = read_shot(str(tmp_path / "rig.usda"))
    bending = {body.path: body.flexible for body in character.bodies if body.flexible}
    assert list(bending) == ["/Worm/Robot/upper"]
    material = bending["/Worm/Robot/upper"].material
    assert material.youngs_modulus == pytest.approx(3.0e9) and material.density == pytest.approx(1240.0)
    assert material.damping_ratio == pytest.approx(0.015)


def test_results_go_back_to_the_skeleton(tmp_path):
    shot = skinned(tmp_path / "worm.usda")
    rig_shot(str(shot), str(tmp_path / "rig.usda"))
    before = {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in tmp_path.iterdir()}
    character, animation, provenance = read_shot(str(tmp_path / "rig.usda"))
    hand = [k for k, motor in enumerate(character.motors) if "hand" in motor.path]
    result = result_with(character, animation, {hand[1]: 0.1})
    _, root = write_result(character, animation, provenance, result, str(tmp_path / "calm.usda"))
    assert all(hashlib.sha256((tmp_path / n).read_bytes()).hexdigest() == h for n, h in before.items())
    _, again, _ = read_shot(root)
    for track, curve in zip(again.current, result.curves, strict=True):
        assert np.abs(track.values - curve.frame_values).max() < 1e-5


def test_the_layer_passes_usd_s_validators_and_keeps_the_shot(calmotion, tmp_path):
    shot = skinned(tmp_path / "worm.usda")
    before = hashlib.sha256(shot.read_bytes()).hexdigest()
    done = calmotion("rig", shot, "-o", tmp_path / "rig.usda", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["motors"] == 3 and report["max_angle_error_rad"] < 1e-3 and report["layer"].endswith("rig.usda")
    assert hashlib.sha256(shot.read_bytes()).hexdigest() == before
    done = calmotion("inspect", tmp_path / "rig.usda", "--strict", "--json")
    assert json.loads(done.stdout)["findings"] == []
    stage = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    assert [path.lstrip("./") for path in stage.GetRootLayer().subLayerPaths] == ["worm.usda"]
    assert UsdGeom.Imageable(stage.GetPrimAtPath("/Worm/Robot")).ComputePurpose() == "guide"


REFUSED = {
    "not animated": ({"animated": False}, "not animated", "/Worm/Skeleton"),
    "no skin": ({"skin": False}, "no mesh is skinned", "/Worm/Skeleton"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_character_that_cannot_be_rigged_is_refused(tmp_path, case):
    options, problem, path = REFUSED[case]
    with pytest.raises(ShotError, match=problem) as caught:
        rig_shot(str(skinned(tmp_path / "worm.usda", **options)), str(tmp_path / "rig.usda"))
    assert caught.value.path == path and caught.value.remedy
    assert not (tmp_path / "rig.usda").exists()


def test_a_robot_is_not_rigged_again(tmp_path):
    rig_shot(str(skinned(tmp_path / "worm.usda")), str(tmp_path / "rig.usda"))
    with pytest.raises(ShotError, match="has physics already"):
        rig_shot(str(tmp_path / "rig.usda"), str(tmp_path / "again.usda"))


def test_the_shot_is_never_the_output(tmp_path):
    shot = skinned(tmp_path / "worm.usda")
    with pytest.raises(ShotError, match="never written to"):
        rig_shot(str(shot), str(shot))


def test_unknown_links_and_materials_are_refused_with_those_there_are(tmp_path):
    shot = str(skinned(tmp_path / "worm.usda"))
    with pytest.raises(ShotError, match="no such link") as caught:
        rig_shot(shot, str(tmp_path / "rig.usda"), RigOptions(flexible=("arm",)))
    assert "upper" in caught.value.remedy
    with pytest.raises(ShotError, match="no such material") as caught:
        rig_shot(shot, str(tmp_path / "rig.usda"), RigOptions(material="wood"))
    assert "nylon" in caught.value.remedy
