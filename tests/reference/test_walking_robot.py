"""A published robot with closed chains in its legs walks on its feet, where the shot has it hang on a stand."""

from __future__ import annotations

import calmotion as cm
import numpy as np
import pytest
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.shot.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.forward import run_forward
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.prepare import prepare
from pxr import Usd, UsdGeom
from scipy.spatial.transform import Rotation
from steppers import TORSO  # registers the schemas

ROBOT, LAST, SWITCH = "/DR_Legs/RigidBodies", 200, 152
assert TORSO


def walking(path, source, feet):
    """The shot's first two seconds; on its feet, or on its stand."""
    stage = Usd.Stage.CreateNew(str(path))
    stage.GetRootLayer().subLayerPaths.append(str(source))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    stage.SetDefaultPrim(stage.GetPrimAtPath("/DR_Legs"))
    stage.SetTimeCodesPerSecond(100)
    stage.SetFramesPerSecond(100)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(LAST)
    if feet:
        next(prim for prim in stage.Traverse() if prim.GetName() == "Stand").SetActive(False)
        for side in "lr":
            sole = UsdGeom.Xform.Define(stage, f"{ROBOT}/foot_{side}/Sole").GetPrim()
            sole.ApplyAPI("CalmContactAPI")
            active = sole.GetAttribute("calm:contact:active")
            active.Set(side == "r", 0)
            active.Set(side == "l", SWITCH)
    stage.GetRootLayer().Save()
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
