"""Cost of a run, estimated before it."""

import dataclasses

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.run import RunSettings
from calmotion.tolerance.cost import ExpectedCost, expected_cost, readable_hours, refuse_unaffordable


def longer(animation, factor):
    """The frames of a shot that is longer by a factor."""
    frame = animation.frame_times[1] - animation.frame_times[0]
    count = factor * (len(animation.frame_times) - 1) + 1
    return dataclasses.replace(animation, frame_times=np.arange(count) * frame)


def test_it_grows_with_the_shot_the_step_and_the_search(arm, animation):
    one = expected_cost(arm, animation, RunSettings(step=1 / 240), False)
    ten = expected_cost(arm, longer(animation, 10), RunSettings(step=1 / 240), False)
    fine = expected_cost(arm, animation, RunSettings(step=1 / 2400), False)
    assert ten.steps - 1 == 10 * (one.steps - 1) and ten.hours == pytest.approx(10 * one.hours, rel=0.01)
    assert fine.steps == ten.steps and fine.memory == ten.memory == pytest.approx(10 * one.memory, rel=0.01)
    search = expected_cost(arm, animation, RunSettings(step=1 / 240), True)
    assert search.hours > 50 * one.hours and search.memory > one.memory
    assert one.coordinates >= 6 * len(arm.bodies)


def test_a_shot_without_animation_costs_one_step(arm, animation):
    still = dataclasses.replace(animation, frame_times=np.zeros(1))
    assert expected_cost(arm, still, RunSettings(), False).steps == 1


def test_the_arm_is_affordable_and_a_year_of_it_is_not(arm, animation):
    refuse_unaffordable(expected_cost(arm, animation, RunSettings(), True), arm.path, 24.0, 1e9)
    cost = ExpectedCost(10**6, 10**8, 60, 100.0, 5e11)
    with pytest.raises(ShotError, match="500.0 GB of memory, and 8.0 GB") as error:
        refuse_unaffordable(cost, arm.path, 1000.0, 8e9)
    assert error.value.path == arm.path and "1000000 frames" in str(error.value.found)
    with pytest.raises(ShotError, match="4 days, more than the allowed 24 hours") as error:
        refuse_unaffordable(cost, arm.path, 24.0, 1e12)
    assert "max_hours=150" in error.value.remedy


def test_hours_are_readable():
    assert [readable_hours(hours) for hours in (0.001, 0.5, 3.2, 47.0, 100.0)] == [
        "less than a minute", "30 minutes", "3 hours", "47 hours", "4 days",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("options", "cause", "remedy"),
    [
        (RunSettings(step=1e-9), "--step", "Use a longer --step"),
        (RunSettings(pre_roll=1e6), "--pre-roll", "Use a shorter --pre-roll"),
        (RunSettings(), "endTimeCode", "Shorten the shot"),
    ],
)
def test_the_option_that_costs_so_much_is_named(arm, animation, options, cause, remedy):
    with pytest.raises(ShotError) as error:
        refuse_unaffordable(expected_cost(arm, animation, options, False), arm.path, 24.0, 1e3)
    assert error.value.attribute == cause and error.value.remedy.startswith(remedy)


def test_a_time_step_of_the_shot_is_named_as_such(arm, animation):
    fine = dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, time_step=1e-8))
    with pytest.raises(ShotError) as error:
        refuse_unaffordable(expected_cost(fine, animation, RunSettings(), False), arm.path, 24.0, 1e3)
    assert error.value.attribute == "calm:retarget:timeStep"
