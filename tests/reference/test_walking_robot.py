"""Published robots on their feet.

One with closed chains in its legs walks, where its shot has it hang on a stand, and gets commands where its motors
give. A quadruped whose motors have the gains of its own file gets commands with which it shifts its weight, and takes a
step.
"""

import calmotion as cm
import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.forward import run_forward
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.preparation import prepare
from pxr import Usd, UsdGeom
from scipy.spatial.transform import Rotation
from standing_barkour import LEGS, RATE, ease, stand
from steppers import TORSO  # registers the schemas

ROBOT, LAST, SWITCH = "/DR_Legs/RigidBodies", 200, 152
assert TORSO


def shot_on(path, source, feet, last=LAST):
    """The beginning of the shot, on its feet or on its stand."""
    stage = Usd.Stage.CreateNew(str(path))
    stage.GetRootLayer().subLayerPaths.append(str(source))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    stage.SetDefaultPrim(stage.GetPrimAtPath("/DR_Legs"))
    stage.SetTimeCodesPerSecond(100)
    stage.SetFramesPerSecond(100)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(last)
    if feet:
        next(prim for prim in stage.Traverse() if prim.GetName() == "Stand").SetActive(False)
        for side in "lr":
            sole = UsdGeom.Xform.Define(stage, f"{ROBOT}/foot_{side}/Sole").GetPrim()
            sole.ApplyAPI("CalmContactAPI")
            active = sole.GetAttribute("calm:contact:active")
            active.Set(side == "r", 0)
            active.Set(side == "l", SWITCH)
    stage.GetRootLayer().Save()
    return stage


def walking(path, source, feet):
    """Two seconds of rigid motors; on its feet, or on its stand."""
    shot_on(path, source, feet)
    shot = cm.open_shot(path)
    found = prepare(compile_shot(shot.character, shot.animation), RunSettings(step=0.01, pre_roll=0.0))
    angles, rates = sample_tracks(shot.animation.tracks, found.grid)
    model = found.model
    run = run_forward(model, Workspace.for_system(model.system), angles, rates, found.grid.h, found.world)
    names = [shot.character.bodies[b].path.rsplit("/", 1)[-1] for b in model.tree.body]
    states = run.trajectory.states
    return run, {
        name: (states.c[:, k], Rotation.from_quat(states.q[:, k], scalar_first=True)) for k, name in enumerate(names)
    }


def of(frame, other):
    """A pose in another's frame: place and rotation."""
    return other[1].inv().apply(frame[0] - other[0]), other[1].inv() * frame[1]


@pytest.mark.long
def test_a_robot_with_closed_chains_walks_as_its_legs_have_it(tmp_path, shared_data):
    source = shared_data / "shots" / "dr_legs_walk.usda"
    if not source.exists():
        pytest.skip("the shared walk is not here")
    run, on_feet = walking(tmp_path / "feet.usda", source, True)
    _, on_stand = walking(tmp_path / "stand.usda", source, False)
    assert run.trajectory.max_joint_gap < 1e-6 and not run.trajectory.refined
    for foot, held in (("foot_r", slice(1, SWITCH + 1)), ("foot_l", slice(SWITCH + 1, LAST + 1))):
        place, turn = on_feet[foot]
        assert np.ptp(place[held], axis=0).max() < 1e-7
        # the pelvis is where the leg has it, seen from the foot that stands
        here, there = (of(poses["pelvis"], poses[foot]) for poses in (on_feet, on_stand))
        np.testing.assert_allclose(here[0][held], there[0][held], atol=1e-6)
        assert (here[1].inv() * there[1])[held].magnitude().max() < 1e-5


@pytest.mark.long
def test_legs_with_closed_chains_get_commands(tmp_path, shared_data):
    # on one foot, while the other leg swings; motors of 5 N m a degree, of which the pelvis would swing by 19 mm
    source = shared_data / "shots" / "dr_legs_walk.usda"
    if not source.exists():
        pytest.skip("the shared walk is not here")
    shot_on(tmp_path / "stiff.usda", source, True, 60)
    stiff = cm.simulate(tmp_path / "stiff.usda", pre_roll=0.0)
    stage = shot_on(tmp_path / "legs.usda", source, True, 60)
    for prim in stage.Traverse():
        if prim.GetAttribute("drive:angular:physics:targetPosition").GetNumTimeSamples():
            prim.ApplyAPI("CalmMotorAPI")
            for name, value in (("model", "drive"), ("positionGain", 5.0), ("velocityGain", 0.1)):
                prim.GetAttribute(f"calm:motor:{name}").Set(value)
    UsdGeom.Xform.Define(stage, f"{ROBOT}/pelvis/Mark").GetPrim().ApplyAPI("CalmTargetAPI")
    stage.GetRootLayer().Save()
    animated, calm = found(tmp_path / "legs.usda", pre_roll=0.0)
    assert largest(animated) > 0.015 and largest(calm) < 0.15 * largest(animated)
    # the foot asks of the ground no more than the animation does with motors that do not give (19.7 N at its end)
    needed, was, now = (run.report()["contacts"][0]["min_normal_force_n"] for run in (stiff, animated, calm))
    assert needed < now and needed < was < 0.0


@pytest.fixture
def barkour(shared_data):
    source = shared_data / "converted" / "barkour" / "barkour v0.usda"
    if not source.exists():
        pytest.skip("the shared Barkour is not here")
    return source


def found(path, pre_roll=None):
    """The shot as animated, and the commands that were found, simulated from what was written."""
    options = {} if pre_roll is None else {"pre_roll": pre_roll}
    animated = cm.simulate(path, step=0.01, **options)
    result = cm.optimize(path, step=0.01, **options)
    result.write(path.parent / "calm.usda")
    calm = cm.simulate(path.parent / "calm_root.usda", step=0.01, **options)
    for target, was in result.targets.items():
        assert calm.targets[target].error.max() == pytest.approx(was.error.max(), rel=0.05, abs=2e-5)
    return animated, calm


def largest(result):
    return max(target.error.max() for target in result.targets.values())


def on_ground(result):
    """What each foot would do that ground cannot have it do, by foot and time."""
    rows = result.report()["contacts"]
    return {(row["path"].split("/")[-2], row["from_s"]): row["unlike_ground"] for row in rows}


@pytest.mark.long
@pytest.mark.parametrize("flexible", [(), ("lower_leg_1to1_front_right=nylon",)], ids=["rigid", "flexible"])
def test_a_quadruped_shifts_its_weight(tmp_path, barkour, flexible):
    # all feet held, as balls; the springs of the motors give 4 cm under its weight
    shift = ease(0.04, 0.40, 31) * np.array([0.0, 0.03, -0.02])
    animated, calm = found(stand(barkour, tmp_path, shift, flexible=flexible))
    assert largest(animated) > 0.03 and largest(calm) < 0.02 * largest(animated)
    assert len(on_ground(calm)) == len(LEGS) and not any(on_ground(calm).values())
    weight = 9.81 * sum(body.mass.mass for body in calm.shot.character.bodies)
    assert sum(row["max_force_n"] for row in calm.report()["contacts"]) > weight


@pytest.mark.long
def test_a_quadruped_takes_a_step(tmp_path, barkour):
    # its weight goes from the front left foot, which then is 3 cm high and lands 3 cm ahead
    frames, away = 51, (20, 38)
    s = np.clip((np.arange(frames)[:, None] / RATE - 0.4) / 0.36, 0.0, 1.0)
    foot = 0.03 * 64.0 * (s * (1.0 - s)) ** 3 * np.array([0.0, 0.0, 1.0])
    foot = foot + ease(0.4, 0.76, frames) * np.array([0.03, 0.0, 0.0])
    shift = ease(0.0, 0.36, frames) * np.array([-0.05, -0.04, 0.0])
    path = stand(barkour, tmp_path, shift, {"front_left": foot}, {"front_left": away})
    animated, calm = found(path)
    assert largest(animated) > 0.05 and largest(calm) < 0.02 * largest(animated)
    # the shift is so fast that the rigid robot's foot pulls by up to 2.4 N before it leaves, so that this is allowed
    was, now = (min(row["min_normal_force_n"] for row in run.report()["contacts"]) for run in (animated, calm))
    assert was < -10.0 and now > -3.0
    was, now = (
        next(row["landing_speed_m_s"] for row in run.report()["contacts"] if row["landing_speed_m_s"] is not None)
        for run in (animated, calm)
    )
    assert now < 0.2 * was
