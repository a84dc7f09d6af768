"""Which integrator simulates, and what happens where it cannot."""

import pytest
from calmotion.errors import IntegrationError, ShotError
from calmotion.model.run import RunSettings
from calmotion.tolerance.integrator_choice import FAST, by_fast_scheme


class Simulation:
    """Tells by what it was asked to run, and fails for some of it."""

    def __init__(self, *failing):
        self.failing, self.asked = failing, []

    def __call__(self, options):
        self.asked.append(options.scheme)
        if options.scheme in self.failing:
            raise IntegrationError("joints come apart")
        return options.scheme


def test_the_fast_one_is_taken_where_it_does():
    run = Simulation()
    assert by_fast_scheme(RunSettings(), run) == FAST and run.asked == [FAST]


def test_the_safe_one_follows_where_it_fails():
    run = Simulation(FAST)
    assert by_fast_scheme(RunSettings(), run) == "bdf2" and run.asked == [FAST, "bdf2"]


def test_a_shot_that_no_integrator_can_simulate_is_tried_once():
    asked = []

    def simulate(options):
        asked.append(options.scheme)
        raise ShotError("no static equilibrium")

    with pytest.raises(ShotError, match="equilibrium"):
        by_fast_scheme(RunSettings(), simulate)
    assert asked == [FAST]


@pytest.mark.parametrize("asked", ["bdf2", "newmark", FAST])
def test_a_requested_integrator_is_the_only_one(asked):
    run = Simulation(asked)
    with pytest.raises(ShotError, match="apart"):
        by_fast_scheme(RunSettings(integrator=asked), run)
    assert run.asked == [asked]
