"""What a simulation would refuse is refused from the shot alone; what it would simulate is not."""

import dataclasses

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.model.run import RunSettings
from calmotion.simulation.inputs.time_grid import MAX_STEP
from calmotion.tolerance.run_checks import check_simulation


def test_a_shot_that_can_be_simulated_gets_the_grid_of_its_step(arm, animation):
    grid = check_simulation(arm, animation, RunSettings())
    assert grid.h == pytest.approx(1.0 / 72.0)  # the first step that is tried divides a frame of 1/24 s
    assert check_simulation(arm, animation, RunSettings(step=MAX_STEP)).h == pytest.approx(MAX_STEP)


@pytest.mark.parametrize("options", [RunSettings(), RunSettings(step=1.0 / 48.0)])
def test_a_motor_that_turns_too_fast_for_the_shortest_step_is_refused(arm, animation, options):
    turn = 40.0 if options.step else 4e4
    jump = Track(animation.frame_times, np.where(animation.frame_times > 0.7, turn, 0.0))
    fast = dataclasses.replace(animation, tracks=(jump, animation.tracks[1]), current=animation.tracks)
    with pytest.raises(ShotError, match="/Arm/Shoulder"):
        check_simulation(arm, fast, options)


@pytest.mark.parametrize("step", [5.0, 1e6])
def test_a_step_that_is_longer_than_the_shot_is_refused(arm, animation, step):
    with pytest.raises(ShotError, match="longer than the shot") as error:
        check_simulation(arm, animation, RunSettings(step=step))
    assert error.value.attribute == "--step" and "5ms" in error.value.remedy
    authored = dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, time_step=step))
    with pytest.raises(ShotError) as error:
        check_simulation(authored, animation, RunSettings())
    assert error.value.attribute == "calm:retarget:timeStep"
