"""Settings and motions that no simulation supports."""

import dataclasses

import numpy as np
import pytest
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import RetargetSettings
from calmotion.model.run import RunSettings
from calmotion.simulation.inputs.supported import refuse_fast_motors, refuse_half_turns, refuse_unsupported
from calmotion.simulation.inputs.time_grid import make_grid


def test_the_arm_is_supported_by_any_integrator_and_only_by_known_ones(arm, animation):
    refuse_unsupported(arm, animation, RunSettings(integrator="rk4"))
    with pytest.raises(ShotError, match="no such integrator"):
        refuse_unsupported(arm, animation, RunSettings(integrator="rk5"))


def test_a_cyclic_shot_has_no_pre_roll(arm, animation):
    ends = [dataclasses.replace(track, values=0.0 * track.values) for track in animation.tracks]
    still = dataclasses.replace(animation, tracks=tuple(ends), current=tuple(ends))
    cyclic = dataclasses.replace(arm, retarget=RetargetSettings(cyclic=True))
    refuse_unsupported(cyclic, still, RunSettings())
    with pytest.raises(ShotError) as error:
        refuse_unsupported(cyclic, still, RunSettings(pre_roll=1.0))
    assert error.value.attribute == "--pre-roll"


def test_a_step_of_the_shot_is_in_range_as_well(arm, animation):
    short = dataclasses.replace(arm, retarget=RetargetSettings(time_step=1e-30))
    with pytest.raises(ShotError) as error:
        refuse_unsupported(short, animation, RunSettings())
    assert error.value.attribute == "calm:retarget:timeStep"
    refuse_unsupported(short, animation, RunSettings(step=1e-3))


def test_half_a_turn_within_a_step_is_refused_where_it_begins(arm):
    grid = make_grid(np.arange(5) * 0.1, 0.1, 0.0)
    angles = np.zeros((5, len(arm.motors)))
    angles[3:, -1] = 3.1
    refuse_half_turns(arm, grid, angles)
    angles[3:, -1] = -3.2
    with pytest.raises(IntegrationError, match="183 degrees within one step of 100 ms") as error:
        refuse_half_turns(arm, grid, angles)
    assert error.value.path == arm.motors[-1].path and error.value.found == "at 0.200 s"


@pytest.mark.parametrize(("rate", "refused"), [(3000.0, False), (3200.0, True), (-3200.0, True), (np.nan, True)])
def test_rates_are_compared_with_the_shortest_step(arm, rate, refused):
    grid = make_grid(np.arange(5) * 0.1, 0.1, 0.0)
    rates = np.zeros((5, len(arm.motors)))
    rates[2, 0] = rate
    if not refused:
        refuse_fast_motors(arm, grid, rates, 1e-3)
        return
    with pytest.raises(IntegrationError) as error:
        refuse_fast_motors(arm, grid, rates, 1e-3)
    assert error.value.path == arm.motors[0].path
