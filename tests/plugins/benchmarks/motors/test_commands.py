"""Commands for compliant motors, confirmed by MuJoCo, and the cut of shots."""

import json
from dataclasses import replace

import numpy as np
import pytest
from arms import chain
from calmotion.model import Animation, Track
from calmotion.model.motor import Rotor
from calmotion.simulation.compiled_shot import compile_shot
from calmotion_plugins.benchmarks.motors.commands import ALLOWED, compare, main
from pxr import UsdPhysics
from small_shots import ELBOW, SHOULDER, write_arm

FRAMES = np.arange(25) / 24.0


def arm(**more):
    character = chain(2, driven=(0, 1), length=0.3)
    changes = {"model": "servo", "position_gain": 150.0, "velocity_gain": 6.0, "rotor": Rotor(0.02)} | more
    wave = 1.0 - np.cos(2 * np.pi * FRAMES)
    tracks = (Track(FRAMES, 0.3 * wave), Track(FRAMES, -0.5 * wave))
    return replace(character, motors=tuple(replace(m, **changes) for m in character.motors)), Animation(
        FRAMES, tracks, tracks
    )


@pytest.mark.parametrize("damping_on", ["error", "joint"])
def test_commands_with_the_model_leave_a_tenth_of_the_error_also_in_mujoco(damping_on):
    pytest.importorskip("mujoco")
    row = compare("arm", compile_shot(*arm(damping_on=damping_on)), step=1 / 240)
    assert row.ideal_mm > 10.0 and row.mujoco_ideal_mm == pytest.approx(row.ideal_mm, rel=0.02)
    assert row.share < ALLOWED and row.mujoco_share < ALLOWED and row.apart < 2e-3
    assert row.optimised_mm == pytest.approx(row.share * row.ideal_mm) and row.motors == 2


def test_the_command_reads_a_shot_whose_motors_have_gains(tmp_path, capsys):
    pytest.importorskip("mujoco")

    def edit(stage):
        for path in (ELBOW, SHOULDER):
            drive = UsdPhysics.DriveAPI(stage.GetPrimAtPath(path), "angular")
            drive.CreateStiffnessAttr(2.0)
            drive.CreateDampingAttr(0.1)

    status = main([str(write_arm(tmp_path / "arm.usda", edit)), "--json"])
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert status == int(max(row["share"], row["mujoco_share"]) > ALLOWED) and row["motors"] == 2
    assert row["mujoco_ideal_mm"] == pytest.approx(row["ideal_mm"], rel=0.05)
