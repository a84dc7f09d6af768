"""Settings and motions that no simulation supports."""

import numpy as np
import pytest
from calmotion.errors import IntegrationError, ShotError
from calmotion.model.run import RunSettings
from calmotion.simulation.inputs.supported import refuse_fast_motors, refuse_half_turns, refuse_unsupported
from calmotion.simulation.inputs.time_grid import make_grid


def test_an_integrator_that_is_not_there_is_refused(arm, animation):
    with pytest.raises(ShotError, match="no such integrator"):
        refuse_unsupported(arm, animation, RunSettings(integrator="rk5"))


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
