"""Which poses are baked."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.shot import Motion, MotorCurve
from calmotion.usd.reading import read_shot
from calmotion.usd.writing.motions import rigid_motion, simulated_motion
from pxr import UsdPhysics
from small_shots import BASE, ELBOW, FORE, LENGTH, TARGET_POSITION, make_flexible, write_arm


def motion(times: np.ndarray) -> Motion:
    count = len(times)
    positions = np.zeros((count, 1, 3))
    positions[:, 0, 0] = times
    none = np.zeros((count, 0))
    return Motion(times, positions, np.tile([1.0, 0, 0, 0], (count, 1, 1)), (times[:, None],), none, none, none, none)


def test_frames_are_picked_out_of_the_steps_without_the_pre_roll():
    frames = np.arange(25) / 24.0
    found = simulated_motion(motion((np.arange(24 * 20 + 48 + 1) - 48) / 480.0), frames)
    assert np.array_equal(found.times, frames)
    assert np.allclose(found.positions[:, 0, 0], frames) and np.allclose(found.elastic[0][:, 0], frames)


def test_an_interrupted_run_gives_the_frames_it_reached():
    found = simulated_motion(motion(np.arange(100) / 480.0), np.arange(25) / 24.0)
    assert len(found.times) == 5


def test_frames_that_are_no_steps_are_a_mistake_of_ours():
    with pytest.raises(ValueError, match="not steps"):
        simulated_motion(motion(np.arange(100) / 100.0), np.arange(20) / 24.0)


def shot(tmp_path, edit=None):
    character, animation, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    return character, animation


def test_without_curves_the_rigid_robot_performs_the_animation(tmp_path):
    character, animation = shot(tmp_path)
    found = rigid_motion(character, animation, SimpleNamespace(curves=()))
    fore = [b.path for b in character.bodies].index(FORE)
    shoulder = animation.tracks[0].values
    expected = np.stack([LENGTH * np.cos(shoulder), 0 * shoulder, 1.0 - LENGTH * np.sin(shoulder)], axis=1)
    assert np.allclose(found.positions[:, fore], expected, atol=1e-6)
    assert found.elastic is None


def test_a_flexible_body_of_unknown_mass_is_moved_all_the_same(tmp_path):
    def edit(stage):
        make_flexible(stage)
        stage.GetPrimAtPath(FORE).RemoveProperty("physics:mass")

    character, animation = shot(tmp_path, edit)
    curves = tuple(MotorCurve(k, True, np.zeros(0), 0.0 * animation.frame_times, 0.0) for k in range(2))
    found = rigid_motion(character, animation, SimpleNamespace(curves=curves))
    assert np.allclose(found.positions[:, 2], [LENGTH, 0, 1], atol=1e-6)


def free_elbow(stage) -> None:
    stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION).Clear()


def loop(stage) -> None:
    joint = UsdPhysics.RevoluteJoint.Define(stage, "/Arm/joints/loop")
    joint.CreateBody0Rel().SetTargets([BASE])
    joint.CreateBody1Rel().SetTargets([FORE])


@pytest.mark.parametrize("edit", [free_elbow, loop])
def test_joints_that_only_a_simulation_moves_are_refused(tmp_path, edit):
    character, animation = shot(tmp_path, edit)
    with pytest.raises(ShotError) as caught:
        rigid_motion(character, animation, SimpleNamespace(curves=()))
    assert caught.value.remedy
