"""Meshes below Xforms with keys become a robot that does what they do."""

import hashlib
import json

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from calmotion.usd.rigging import RigOptions, rig_shot
from calmotion.usd.writing import WriteOptions, write_result
from performing import result_with, worst_gap
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

FRAMES = 36
TURN = 2.0 * np.pi * np.arange(FRAMES + 1) / FRAMES
CUBE = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


class Scene:
    """A stage whose lengths are given in metres.

    Args:
        path: Of the file.
        meters: Of its unit.
        up: Its axis.
    """

    def __init__(self, path, meters=1.0, up="Z"):
        self.path, self.meters = path, meters
        self.stage = Usd.Stage.CreateNew(str(path))
        UsdGeom.SetStageMetersPerUnit(self.stage, meters)
        UsdGeom.SetStageUpAxis(self.stage, up)
        self.stage.SetStartTimeCode(1)
        self.stage.SetEndTimeCode(FRAMES + 1)
        self.stage.SetDefaultPrim(self.xform("/Scene", (0, 0, 0)).GetPrim())

    def xform(self, path, at):
        xform = UsdGeom.Xform.Define(self.stage, path)
        xform.AddTranslateOp().Set(Gf.Vec3d(*(np.array(at) / self.meters).tolist()))
        return xform

    def box(self, path, size, at=(0, 0, 0)):
        mesh = UsdGeom.Mesh.Define(self.stage, path)
        corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
        points = (corners * size + at) / self.meters
        mesh.CreatePointsAttr([Gf.Vec3f(*point) for point in points.tolist()])
        mesh.CreateFaceVertexCountsAttr([4] * 6)
        mesh.CreateFaceVertexIndicesAttr([k for face in CUBE for k in face])
        mesh.CreateSubdivisionSchemeAttr("none")
        return mesh

    def arm(self, path="/Scene/Robot/Base", fore="rotateY"):
        """A base that stands, a turntable, an upper arm with a pivot, a forearm, and a finger that slides."""
        UsdGeom.Xform.Define(self.stage, "/Scene/Robot")
        self.xform(path, (0.3, 0.1, 0.0))
        self.box(f"{path}/mesh", (0.3, 0.3, 0.1))
        table = self.xform(f"{path}/Table", (0, 0, 0.05))
        keys(table.AddRotateZOp(), 200.0 * np.sin(TURN / 2.0))
        self.box(f"{path}/Table/mesh", (0.2, 0.2, 0.05))
        self.box(f"{path}/Table/bolt", (0.02, 0.02, 0.02), (0.1, 0.1, 0.05))
        upper = self.xform(f"{path}/Table/Upper", (0.02, 0.0, 0.1))
        pivot = Gf.Vec3d(*(np.array([0.01, 0.0, 0.07]) / self.meters).tolist())
        upper.AddTranslateOp(opSuffix="pivot").Set(pivot)
        keys(upper.AddRotateYOp(), 20.0 + 25.0 * np.sin(TURN))
        upper.AddTranslateOp(opSuffix="pivot", isInverseOp=True)
        self.box(f"{path}/Table/Upper/mesh", (0.05, 0.05, 0.5), (0, 0, 0.25))
        below = self.xform(f"{path}/Table/Upper/Fore", (0.0, 0.01, 0.5))
        FORE[fore](below, self.meters)
        self.box(f"{path}/Table/Upper/Fore/mesh", (0.04, 0.04, 0.4), (0, 0, 0.2))
        finger = UsdGeom.Xform.Define(self.stage, f"{path}/Table/Upper/Fore/Finger")
        away = np.stack([0.02 * np.sin(TURN), 0 * TURN, 0.4 + 0.01 * np.sin(TURN)], axis=1) / self.meters
        keys(finger.AddTranslateOp(), [Gf.Vec3d(*at) for at in away.tolist()])
        self.box(f"{path}/Table/Upper/Fore/Finger/mesh", (0.02, 0.02, 0.05))
        return self

    def saved(self):
        self.stage.Save()
        return self.path


def keys(op, values):
    for n, value in enumerate(values):
        op.Set(float(value) if np.isscalar(value) else value, 1 + n)


def turned(angle, axis=(0, 1, 0)):
    return Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(*axis), float(angle)))


ELBOW = 40.0 * np.sin(TURN + 0.7)
LEANT = (0.36, 0.48, 0.8)  # a unit axis


def by_matrix(xform, meters):
    off = Gf.Matrix4d().SetTranslate(Gf.Vec3d(0.03 / meters, 0, 0.02 / meters))
    keys(xform.AddTransformOp(), [off.GetInverse() * turned(a, LEANT) * off for a in ELBOW])


def by_euler(order):
    def add(xform, meters):
        kind = getattr(UsdGeom.XformOp, f"TypeRotate{order}")
        values = [[20 * np.sin(t), 15 * np.cos(2 * t), 30 * np.sin(3 * t)] for t in TURN]
        keys(xform.AddXformOp(kind, UsdGeom.XformOp.PrecisionDouble), [Gf.Vec3d(*v) for v in values])

    return add


def by_orient(xform, meters):
    rotations = [Gf.Rotation(Gf.Vec3d(*LEANT), float(a)).GetQuat() for a in ELBOW]
    keys(xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble), rotations)


def mirrored(xform, meters):
    keys(xform.AddRotateYOp(), ELBOW)
    xform.AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))


def scaled_again(xform, meters):
    """A rotation below a scale that the prim itself undoes, as programs do that keep transforms of children."""
    S = Gf.Matrix4d().SetScale(Gf.Vec3d(1, 2, 0.5))
    xform.AddTransformOp(opSuffix="scale").Set(S)
    keys(xform.AddTransformOp(opSuffix="turn"), [turned(a) * S.GetInverse() for a in ELBOW])


FORE = {
    "rotateY": lambda xform, meters: keys(xform.AddRotateYOp(), ELBOW),
    "matrix": by_matrix,
    "ball": by_euler("XYZ"),
    "ball in another order": by_euler("ZXY"),
    "orient": by_orient,
    "mirrored": mirrored,
    "scaled again": scaled_again,
    "hardly": lambda xform, meters: keys(xform.AddRotateYOp(), 2e-3 * np.sin(TURN)),
    "screw": lambda xform, meters: (
        keys(xform.AddTranslateOp(opSuffix="along"), [Gf.Vec3d(0, 0.02 / meters * np.sin(t), 0) for t in TURN]),
        keys(xform.AddRotateYOp(), 30.0 * np.cos(2 * TURN)),
    ),
    "stretched": lambda xform, meters: keys(xform.AddScaleOp(), [Gf.Vec3f(1, 1, 1 + 0.1 * np.sin(t)) for t in TURN]),
}


def rigged(shot, **options):
    output = shot.with_name("robot.usda")
    return rig_shot(str(shot), str(output), RigOptions(**options)), output


def reproduced(output, mirrors=False):
    """The rigid robot is where USD has the parts, in every frame; by the simulation, and from the written file."""
    character, animation, _ = read_shot(str(output))
    far, turned_off = worst_gap(output, character, animation)
    assert far < 1e-6 and (mirrors or turned_off < 2e-6)
    return character, animation


@pytest.mark.parametrize("fore", ["rotateY", "matrix", "orient", "mirrored", "scaled again"])
@pytest.mark.parametrize(("meters", "up"), [(1.0, "Z"), (0.01, "Y")])
def test_parts_with_one_hinge_each_become_an_arm(tmp_path, fore, meters, up):
    shot = Scene(tmp_path / "arm.usda", meters, up).arm(fore=fore).saved()
    rig, output = rigged(shot)
    assert rig.bodies == 5 and sum(len(joint.motors) for joint in rig.joints) == 4
    assert rig.off < 1e-6 and not rig.notes
    assert rig.targets == ("/Scene/Robot/Base/Table/Upper/Fore/Finger/target",)
    character, animation = reproduced(output, fore == "mirrored")
    kinds = [character.joints[motor.joint].kind for motor in character.motors]
    assert kinds == ["revolute", "revolute", "revolute", "prismatic"]
    table = animation.tracks[0].values
    assert np.degrees(np.ptp(table)) == pytest.approx(200.0, abs=1e-4)
    volume = 0.3 * 0.3 * 0.1 + 0.2 * 0.2 * 0.05 + 0.02**3 + 0.05**2 * 0.5 + 0.04**2 * 0.4 + 0.02**2 * 0.05
    assert rig.mass == pytest.approx(1010.0 * volume, rel=1e-4)


def test_bodies_without_joints_are_parts_that_keep_their_masses(tmp_path):
    """As Omniverse exports bodies with keys: kinematic. Those that no joint connects are switched off."""
    scene = Scene(tmp_path / "arm.usda").arm()
    scene.box("/Scene/Crate", (0.2, 0.2, 0.2), (2, 0, 0))
    base = "/Scene/Robot/Base"
    names = ("Table", "Table/Upper", "Table/Upper/Fore", "Table/Upper/Fore/Finger", "Table/bolt")
    for path in (base, *(f"{base}/{name}" for name in names), "/Scene/Crate"):
        prim = scene.stage.GetPrimAtPath(path)
        UsdPhysics.RigidBodyAPI.Apply(prim).CreateKinematicEnabledAttr(True)
        UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(0.25)
    rig, output = rigged(scene.saved())
    character, _ = reproduced(output)
    assert rig.bodies == 5 and [body.mass.mass for body in character.bodies] == pytest.approx([0.25] * 5)
    assert not any(body.path.endswith(("Crate", "bolt")) for body in character.bodies)


def test_the_hinge_is_where_the_pivot_is(tmp_path):
    _, output = rigged(Scene(tmp_path / "arm.usda", 0.01).arm().saved())
    stage = Usd.Stage.Open(str(output))
    joint, upper = (stage.GetPrimAtPath(p) for p in ("/Scene/Robot_2/joints/Upper", "/Scene/Robot/Base/Table/Upper"))
    local = np.array(joint.GetAttribute("physics:localPos1").Get())
    # by the motion of the place in the upper arm: a pivot stays, in the axes of the table
    table = stage.GetPrimAtPath("/Scene/Robot/Base/Table")
    places = []
    for code in range(1, FRAMES + 2):
        cache = UsdGeom.XformCache(code)
        world = cache.GetLocalToWorldTransform(upper).Transform(Gf.Vec3d(*local.tolist()))
        places.append(cache.GetLocalToWorldTransform(table).GetInverse().Transform(world))
    assert np.ptp(places, axis=0).max() < 1e-4 and local[[0, 2]] == pytest.approx([1.0, 7.0], abs=1e-4)


@pytest.mark.parametrize("fore", ["ball", "ball in another order"])
def test_a_part_that_turns_about_a_point_gets_three_hinges(tmp_path, fore):
    rig, output = rigged(Scene(tmp_path / "arm.usda").arm(fore=fore).saved(), angle_tolerance=1e-7)
    assert {j.joint.split("/")[-1]: len(j.motors) for j in rig.joints} == {
        "Table": 1, "Upper": 1, "Fore": 3, "Finger": 1,
    }  # fmt: skip
    character, animation = reproduced(output)
    assert len(character.motors) == 6 and len(character.bodies) == 7


def test_parts_that_reset_their_transforms_are_seated_by_their_motion(tmp_path):
    nested = Scene(tmp_path / "nested.usda").arm().stage
    flat = Scene(tmp_path / "arm.usda")
    for name in ("Table", "Table/Upper", "Table/Upper/Fore", "Table/Upper/Fore/Finger"):
        xform = UsdGeom.Xform.Define(flat.stage, f"/Scene/Arm/{name}")
        xform.SetResetXformStack(True)
        flat.box(f"/Scene/Arm/{name}/mesh", (0.05, 0.05, 0.1))
        prim = nested.GetPrimAtPath(f"/Scene/Robot/Base/{name}")
        worlds = [UsdGeom.XformCache(1 + n).GetLocalToWorldTransform(prim) for n in range(FRAMES + 1)]
        keys(xform.AddTransformOp(), worlds)
    rig, output = rigged(flat.saved())
    character, _ = reproduced(output)
    assert [len(joint.motors) for joint in rig.joints] == [1, 1, 1, 1]
    paths = [body.path.split("/")[-1] for body in character.bodies]
    assert [(joint.body0 >= 0 and paths[joint.body0], paths[joint.body1]) for joint in character.joints] == [
        (False, "Table"), ("Table", "Upper"), ("Upper", "Fore"), ("Fore", "Finger"),
    ]  # fmt: skip


def test_a_base_that_moves_is_carried_by_its_transform(tmp_path):
    scene = Scene(tmp_path / "arm.usda").arm()
    base = UsdGeom.Xformable(scene.stage.GetPrimAtPath("/Scene/Robot/Base"))
    keys(base.GetOrderedXformOps()[0], [Gf.Vec3d(0.1 * np.sin(t), 0.1 * np.cos(t), 0) for t in TURN])
    keys(base.AddRotateZOp(), 10.0 * np.sin(TURN))
    _, output = rigged(scene.saved())
    _, animation = reproduced(output)
    assert len(animation.moving) == 1 and len(animation.tracks) == 4


def test_what_moves_by_itself_is_left_out_and_told(tmp_path):
    scene = Scene(tmp_path / "arm.usda").arm()
    prop = scene.xform("/Scene/Ball", (1, 0, 0))
    keys(prop.AddTranslateOp(opSuffix="thrown"), [Gf.Vec3d(0.1 * t, 0, t * (6 - t)) for t in TURN])
    scene.box("/Scene/Ball/mesh", (0.1, 0.1, 0.1))
    camera = UsdGeom.Camera.Define(scene.stage, "/Scene/Camera")
    keys(UsdGeom.Xformable(camera).AddTranslateOp(), [Gf.Vec3d(t, 0, 0) for t in TURN])
    rig, output = rigged(scene.saved())
    assert len(rig.joints) == 4 and [note.split(":")[0] for note in rig.notes] == ["/Scene/Ball"]
    reproduced(output)


def test_instances_become_prims_that_can_have_physics(tmp_path):
    scene = Scene(tmp_path / "arm.usda").arm()
    scene.stage.DefinePrim("/Model")
    spinner = UsdGeom.Xform.Define(scene.stage, "/Model/Spinner")
    keys(spinner.AddRotateXOp(), 50.0 * np.sin(TURN))
    scene.box("/Model/Spinner/mesh", (0.02, 0.1, 0.1), (0.05, 0, 0))
    tool = scene.xform("/Scene/Robot/Base/Table/Upper/Fore/Finger/Tool", (0, 0, 0.05)).GetPrim()
    tool.GetReferences().AddInternalReference("/Model")
    tool.SetInstanceable(True)
    scene.stage.GetPrimAtPath("/Model").SetActive(True)
    scene.stage.GetPrimAtPath("/Model").SetSpecifier(Sdf.SpecifierClass)
    rig, output = rigged(scene.saved())
    assert [joint.joint.split("/")[-1] for joint in rig.joints][-1] == "Spinner"
    reproduced(output)


def test_an_xform_without_geometry_between_two_is_a_servo(tmp_path):
    scene = Scene(tmp_path / "arm.usda")
    keys(scene.xform("/Scene/Pan", (0, 0, 0.2)).AddRotateZOp(), 30.0 * np.sin(TURN))
    keys(scene.xform("/Scene/Pan/Tilt", (0, 0, 0.1)).AddRotateYOp(), 20.0 * np.cos(TURN))
    scene.box("/Scene/Pan/Tilt/mesh", (0.1, 0.1, 0.1), (0.1, 0, 0))
    rig, output = rigged(scene.saved())
    character, _ = reproduced(output)
    assert [body.mass.mass for body in character.bodies] == pytest.approx([0.05 * 1.01, 1.01], rel=1e-4)


def test_parts_may_turn_in_the_world(tmp_path):
    scene = Scene(tmp_path / "door.usda")
    keys(scene.xform("/Scene/Door", (0.2, 0, 1.0)).AddRotateZOp(), 40.0 * np.sin(TURN) ** 2)
    scene.box("/Scene/Door/mesh", (0.8, 0.04, 2.0), (0.4, 0, 0))
    keys(scene.xform("/Scene/Other", (0.2, 3.0, 1.0)).AddRotateZOp(), 30.0 * np.sin(TURN) ** 2)
    scene.box("/Scene/Other/mesh", (0.8, 0.04, 2.0), (0.4, 0, 0))
    rig, output = rigged(scene.saved())
    assert rig.targets == ("/Scene/Door/target", "/Scene/Other/target")
    character, animation = reproduced(output)
    assert [joint.kind for joint in character.joints] == ["revolute"] * 2 and len(animation.tracks) == 2


def test_what_resets_its_transforms_below_a_part_stands_still(tmp_path):
    scene = Scene(tmp_path / "arm.usda").arm()
    sign = scene.xform("/Scene/Robot/Base/Table/Upper/Sign", (2.0, 0, 0))
    sign.SetResetXformStack(True)
    scene.box("/Scene/Robot/Base/Table/Upper/Sign/mesh", (1, 1, 1))
    rig, output = rigged(scene.saved())
    character, _ = reproduced(output)
    assert not rig.notes and len(rig.joints) == 4
    upper = next(body for body in character.bodies if body.path.endswith("/Upper"))
    assert upper.mass.mass == pytest.approx(1010.0 * 0.05**2 * 0.5, rel=1e-4)  # without the sign


def test_the_distance_that_is_told_is_that_of_the_written_robot(tmp_path):
    scene = Scene(tmp_path / "arm.usda").arm()
    # joints have single precision, which is microns at hundreds of metres
    UsdGeom.Xformable(scene.stage.GetPrimAtPath("/Scene/Robot")).AddTranslateOp().Set(Gf.Vec3d(200, 300, 0))
    rig, output = rigged(scene.saved())
    character, animation, _ = read_shot(str(output))
    far, _ = worst_gap(output, character, animation)
    assert 1e-6 < far < 1e-4 and rig.off == pytest.approx(far, rel=1e-3)


def test_results_that_are_baked_move_the_parts(tmp_path):
    _, output = rigged(Scene(tmp_path / "arm.usda", 0.01).arm(fore="mirrored").saved())
    character, animation, provenance = read_shot(str(output))
    result = result_with(character, animation, {1: 0.1, 3: 0.01})
    options = WriteOptions(bake="motors")
    _, root = write_result(character, animation, provenance, result, str(tmp_path / "calm.usda"), options)
    _, again, _ = read_shot(root)
    assert np.abs(again.current[1].values - animation.tracks[1].values).max() == pytest.approx(0.1, rel=1e-2)
    assert worst_gap(root, character, animation)[0] > 1e-2
    assert worst_gap(root, character, animation, again.current)[0] < 1e-6


def test_a_hinge_that_hardly_turns_is_told(tmp_path):
    rig, output = rigged(Scene(tmp_path / "arm.usda").arm(fore="hardly").saved())
    assert len(rig.notes) == 1 and "/Fore: it turns by 0.004 deg only" in rig.notes[0]
    reproduced(output)


@pytest.mark.parametrize(
    ("fore", "problem", "found"),
    [
        ("screw", "neither about a hinge, nor along a line", "mm and 0.000 deg off"),
        ("stretched", "scale is animated", "a change by 0.1"),
    ],
)
def test_a_part_that_no_joint_follows_is_refused(tmp_path, fore, problem, found):
    shot = Scene(tmp_path / "arm.usda").arm(fore=fore).saved()
    with pytest.raises(ShotError, match=problem) as caught:
        rigged(shot)
    assert caught.value.path == "/Scene/Robot/Base/Table/Upper/Fore" and found in str(caught.value.found)
    assert caught.value.remedy and not shot.with_name("robot.usda").exists()


def test_parts_that_do_not_move_on_each_other_are_refused(tmp_path):
    scene = Scene(tmp_path / "ball.usda")
    op = scene.xform("/Scene/Ball", (1, 0, 0)).AddTranslateOp(opSuffix="thrown")
    keys(op, [Gf.Vec3d(0.1 * t, 0, t * (6 - t)) for t in TURN])
    scene.box("/Scene/Ball/mesh", (0.1, 0.1, 0.1))
    with pytest.raises(ShotError, match="no part moves on another"):
        rigged(scene.saved())


def test_a_shot_of_parts_without_physics_names_the_command(tmp_path):
    shot = Scene(tmp_path / "arm.usda").arm().saved()
    with pytest.raises(ShotError, match="no bodies") as caught:
        read_shot(str(shot))
    assert "calmotion rig arm.usda -o LAYER" in caught.value.remedy


def test_the_command_makes_a_shot_that_is_valid_and_keeps_the_file(calmotion, tmp_path):
    shot = Scene(tmp_path / "arm.usda", 0.01).arm().saved()
    before = hashlib.sha256(shot.read_bytes()).hexdigest()
    done = calmotion("rig", shot, "-o", tmp_path / "robot.usda", "--set", "rig.skeleton.flexible=Upper,Fore", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["motors"] == 4 and report["max_error_m"] < 1e-6 and len(report["flexible"]) == 2
    assert hashlib.sha256(shot.read_bytes()).hexdigest() == before
    done = calmotion("inspect", tmp_path / "robot.usda", "--strict", "--json")
    assert json.loads(done.stdout)["findings"] == []
