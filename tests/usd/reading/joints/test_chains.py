"""Joints of several directions: their hinges and sliders, and dynamics that MuJoCo's agree with."""

import calmotion as cm
import numpy as np
import pytest
from calmotion.model import Frame, MotorCurve
from calmotion.model.curves import commanded_curves
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd.clock import Clock
from calmotion.usd.reading import read_shot
from calmotion.usd.reading.joints.chains import axis_values
from calmotion.usd.reading.joints.joint_prims import JointPrim
from calmotion.usd.writing.curves import author_curves
from generic_arm import driven, generic
from pxr import Gf, Sdf, UsdGeom, UsdPhysics
from scipy.spatial.transform import Rotation
from small_shots import ELBOW, FORE, FRAMES, LENGTH, UPPER, make_target, write_arm

STILL = Frame(np.zeros(3), np.array([1.0, 0, 0, 0]))
PHASE = 2.0 * np.pi * np.arange(FRAMES + 1) / FRAMES
CURVES = {"rotX": 25.0 * (1.0 - np.cos(PHASE)), "rotY": 15.0 * np.sin(PHASE) ** 3, "rotZ": -20.0 * np.sin(PHASE) ** 3}


def made(tmp_path, free, curves=(), more=lambda stage: None):
    def edit(stage):
        generic(stage, ELBOW, free)
        driven(stage, ELBOW, {name: CURVES[name] for name in curves})
        make_target(stage)
        more(stage)

    return str(write_arm(tmp_path / "arm.usda", edit))


def test_a_universal_joint_is_two_hinges_with_a_part_between_that_weighs_nothing(tmp_path):
    character, animation, _ = read_shot(made(tmp_path, ["rotX", "rotZ"], ["rotX"]))
    by_path = {joint.path: joint for joint in character.joints}
    first, second = by_path[f"{ELBOW}.rotX"], by_path[f"{ELBOW}.rotZ"]
    part = character.bodies[first.body1]
    assert (part.between, part.path, second.body0) == (ELBOW, f"{ELBOW}.rotX_part", first.body1)
    assert part.mass.mass < 1e-5 * character.bodies[second.body1].mass.mass
    assert character.bodies[first.body0].path == UPPER and character.bodies[second.body1].path == FORE
    assert np.allclose(rotation_from_quaternion(first.frame0.rotation)[:, 2], [1, 0, 0], atol=1e-12)
    assert np.allclose(rotation_from_quaternion(second.frame1.rotation)[:, 2], [0, 0, 1], atol=1e-12)
    assert (first.lower, first.upper) == pytest.approx((np.deg2rad(-90), np.deg2rad(120)))
    motors = {motor.path: track for motor, track in zip(character.motors, animation.tracks, strict=True)}
    assert f"{ELBOW}.rotZ" not in motors, "it has no drive, and moves freely"
    assert np.allclose(motors[f"{ELBOW}.rotX"].values, np.deg2rad(CURVES["rotX"]), atol=1e-6)
    assert character.motors[1].prim_path == ELBOW and character.motors[1].attribute.startswith("drive:rotX:")


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("free", [("rotX", "rotY"), ("rotX", "rotZ"), ("rotY", "rotZ"), ("rotX", "rotY", "rotZ"),
                                  ("transX", "transZ", "rotY")])  # fmt: skip
def test_values_of_the_axes_are_those_of_the_pose_also_beyond_a_right_angle(free, turned):
    times = np.linspace(0.0, 1.0, 60)
    values = np.stack([(2.0 + 0.4 * k) * np.sin(times * (2 + k)) for k in range(len(free))], axis=1)
    turns = [(name[-1], values[:, k]) for k, name in enumerate(free) if name.startswith("rot")]
    R = Rotation.from_euler("".join(axis for axis, _ in turns), np.stack([v for _, v in turns], axis=1)).as_matrix()
    x = np.zeros((60, 3))
    for k, name in enumerate(free):
        if name.startswith("trans"):
            x[:, "XYZ".index(name[-1])] = values[:, k]
    if turned:
        R, x = np.swapaxes(R, 1, 2), -np.einsum("nji,nj->ni", R, x)
    joint = JointPrim(None, "/j", "several", "", "/b", STILL, STILL, free=free, turned=turned)
    found, tilt, gap = axis_values(joint, R, x)
    np.testing.assert_allclose(found, values, atol=1e-9)
    assert tilt.max() < 1e-7 and gap.max() < 1e-12


def test_poses_of_the_bodies_move_the_axes(tmp_path):
    def pose(stage):
        generic(stage, ELBOW, ["rotX", "rotY"])
        for name in ("rotX", "rotY"):
            UsdPhysics.DriveAPI.Apply(stage.GetPrimAtPath(ELBOW), name)
        stage.GetPrimAtPath("/Arm/joints/shoulder").GetAttribute("drive:angular:physics:targetPosition").Clear()
        fore = UsdGeom.Xformable(stage.GetPrimAtPath(FORE))
        fore.ClearXformOpOrder()
        fore.AddTranslateOp().Set(Gf.Vec3d(LENGTH, 0, 1))
        op = fore.AddOrientOp(UsdGeom.XformOp.PrecisionDouble)
        for frame in range(FRAMES + 1):
            q = Rotation.from_euler("XY", [CURVES["rotX"][frame], CURVES["rotY"][frame]], degrees=True).as_quat()
            op.Set(Gf.Quatd(q[3], *q[:3]), frame)

    path = str(write_arm(tmp_path / "arm.usda", pose))
    character, animation, _ = read_shot(path)
    tracks = {motor.path: track for motor, track in zip(character.motors, animation.tracks, strict=True)}
    for name in ("rotX", "rotY"):
        np.testing.assert_allclose(tracks[f"{ELBOW}.{name}"].values, np.deg2rad(CURVES[name]), atol=1e-9)
    assert character.motors[1].source == "bodies"


def test_curves_are_written_to_the_drive_of_each_axis_and_motions_to_bodies_alone(tmp_path):
    path = made(tmp_path, ["rotX", "rotZ"], ["rotX", "rotZ"])
    cm.simulate(path, step=1 / 24, pre_roll=0.0).write(tmp_path / "motion.usda", bake="simulated")
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "motion.usda"))
    assert layer.GetPrimAtPath(FORE) and not layer.GetPrimAtPath(ELBOW)
    character, animation, _ = read_shot(path)
    curve = MotorCurve(2, True, animation.frame_times, animation.tracks[2].values, 0.0)
    clock, written = Clock(0.0, FRAMES, 24.0, 24.0), Sdf.Layer.CreateAnonymous(".usda")
    author_curves(written, character, animation, (curve,), None, clock, 1.0)
    assert [spec.name for spec in written.GetPrimAtPath(ELBOW).properties] == ["drive:rotZ:physics:targetPosition"]
    sample = written.QueryTimeSample(f"{ELBOW}.drive:rotZ:physics:targetPosition", 6.0)
    assert sample == pytest.approx(CURVES["rotZ"][6], abs=1e-5)


@pytest.mark.parametrize("closing", [False, True])
def test_a_closed_chain_with_a_universal_joint_moves_and_loads_its_motor_as_one_of_hinges(tmp_path, closing):
    """Base, upper arm, rod and rocker in a plane, with hinges about y; one of them may be universal."""

    def edit(stage, universal=""):
        stage.GetPrimAtPath(ELBOW).RemoveAppliedSchema("PhysicsDriveAPI:angular")
        stage.GetPrimAtPath(ELBOW).RemoveProperty("drive:angular:physics:targetPosition")
        rocker = UsdGeom.Xform.Define(stage, "/Arm/rocker")
        rocker.AddTranslateOp().Set(Gf.Vec3d(LENGTH, 0.0, 0.7))
        UsdPhysics.RigidBodyAPI.Apply(rocker.GetPrim())
        mass = UsdPhysics.MassAPI.Apply(rocker.GetPrim())
        mass.CreateMassAttr(0.3)
        mass.CreateDiagonalInertiaAttr(Gf.Vec3f(0.01, 0.01, 0.01))
        stage.RemovePrim("/Arm/fore/skin")
        for name, bodies, at0, at1 in (
            ("tip", (FORE, "/Arm/rocker"), (0.3, 0.0, 0.0), (0.3, 0.0, 0.3)),
            ("foot", ("/Arm/base", "/Arm/rocker"), (LENGTH, 0.0, -0.3), (0.0, 0.0, 0.0)),
        ):
            joint = UsdPhysics.RevoluteJoint.Define(stage, f"/Arm/joints/{name}")
            joint.CreateBody0Rel().SetTargets([bodies[0]])
            joint.CreateBody1Rel().SetTargets([bodies[1]])
            joint.CreateLocalPos0Attr(Gf.Vec3f(*at0))
            joint.CreateLocalPos1Attr(Gf.Vec3f(*at1))
            joint.CreateAxisAttr("Y")
            joint.CreateLowerLimitAttr(-90.0)
            joint.CreateUpperLimitAttr(90.0)
        if universal:
            generic(stage, universal, ["rotX", "rotY"])
            for name in ("rotX", "rotY"):
                stage.GetPrimAtPath(universal).RemoveProperty(f"drive:{name}:physics:targetPosition")

    universal = "/Arm/joints/foot" if closing else ELBOW
    results = [
        cm.simulate(write_arm(tmp_path / f"{k}.usda", lambda s, u=u: edit(s, u)), step=1 / 96, pre_roll=0.0)
        for k, u in enumerate(("", universal))
    ]
    efforts, targets = zip(
        *[(r.motors["/Arm/joints/shoulder"].effort, list(r.targets.values())[0]) for r in results], strict=True
    )
    assert np.abs(efforts[1] - efforts[0]).max() < 1e-5 * np.abs(efforts[0]).max()
    np.testing.assert_allclose(targets[1].position, targets[0].position, atol=1e-8)
    assert results[1].result.before.max_joint_gap < 1e-8


MUJOCO = """<mujoco><compiler angle="radian" inertiafromgeom="false"/><option gravity="0 0 -9.81"/><worldbody>
<body pos="0 0 1"><inertial pos="0.2 0 0" mass="{0}" diaginertia="{1} {2} {3}"/><joint axis="0 1 0"/>
<body pos="0.4 0 0"><inertial pos="0.2 0 0" mass="0.5" diaginertia="1e-4 7e-3 7e-3"/>{4}
</body></body></worldbody></mujoco>"""


def mujoco_model(character, free):
    mujoco = pytest.importorskip("mujoco")
    upper = next(body for body in character.bodies if body.path == UPPER)
    axes = {"rotX": "1 0 0", "rotY": "0 1 0", "rotZ": "0 0 1"}
    hinges = "".join(f'<joint axis="{axes[name]}"/>' for name in free)
    text = MUJOCO.format(upper.mass.mass, *np.diag(upper.mass.inertia), hinges)
    return mujoco, mujoco.MjModel.from_xml_string(text)


@pytest.mark.parametrize("free", [("rotX", "rotZ"), ("rotX", "rotY", "rotZ")])
def test_motors_of_a_universal_and_a_ball_joint_need_the_torques_that_mujoco_finds(tmp_path, free):
    result = cm.simulate(made(tmp_path, list(free), free), step=1 / 960, integrator="bdf2", pre_roll=0.0)
    character = result.shot.character
    mujoco, model = mujoco_model(character, free)
    data, rows = mujoco.MjData(model), slice(20, None, 40)
    curve = commanded_curves(character, result.shot.animation, None)
    expected = []
    for q, v, a in zip(*(curve(result.times[rows], order) for order in range(3)), strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        expected.append(data.qfrc_inverse.copy())
    found = np.stack([motor.effort[rows] for motor in result.motors.values()], axis=1)
    assert np.abs(found - expected).max() < 2e-4 * np.abs(expected).max()


def test_a_passive_universal_joint_swings_without_torque(tmp_path):
    free = ("rotY", "rotZ")
    result = cm.simulate(made(tmp_path, list(free)), step=1 / 960, integrator="bdf2", pre_roll=0.0)
    character, motion = result.shot.character, result.result.before.motion
    mujoco, model = mujoco_model(character, free)
    index = {body.path: k for k, body in enumerate(character.bodies)}
    R = {path: rotation_from_quaternion(motion.rotations[:, index[path]]) for path in (UPPER, FORE)}
    joint = JointPrim(None, "/j", "several", UPPER, FORE, STILL, STILL, free=free)
    passive = axis_values(joint, np.swapaxes(R[UPPER], 1, 2) @ R[FORE], np.zeros((len(R[UPPER]), 3)))[0]
    h = 1 / 960
    q = np.column_stack([commanded_curves(character, result.shot.animation, None)(motion.times, 0), passive])
    v, a = (q[2:] - q[:-2]) / (2 * h), (q[2:] - 2 * q[1:-1] + q[:-2]) / h**2
    data, torques = mujoco.MjData(model), []
    for row in range(30, len(v), 30):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[row + 1], v[row], a[row]
        mujoco.mj_inverse(model, data)
        torques.append(data.qfrc_inverse.copy())
    torques = np.array(torques)
    assert np.ptp(passive[:, 0]) > 0.1, "it swings"
    assert np.abs(torques[:, 1:]).max() < 1e-3 * np.abs(torques[:, 0]).max()
