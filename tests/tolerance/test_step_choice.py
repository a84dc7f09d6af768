"""A step that was chosen counts with the error that a run with half of it tells, or becomes shorter."""

import numpy as np
import pytest
from calmotion.errors import IntegrationError
from calmotion.tolerance.step_choice import LEAST, MISSED, MOST, WHOLE, confirmed_step, step_allowance
from calmotion.tolerance.step_error import StepRun, distance


def vibrating(step):
    """A target on a decaying vibration that steps slow down and damp, as BDF2 does, at a dozen frames."""
    t = np.linspace(0.0, 0.5, 13)
    angle = 2.0 * np.pi * 15.0 * step
    slower, damped = 1.0 / (1.0 + angle**2 / 6.0), np.exp(-0.25 * angle**3 * 15.0 * t)
    phase = 2.0 * np.pi * 15.0 * slower * t
    places = (np.exp(-4.0 * t) * damped)[:, None] * np.stack([np.sin(phase), np.cos(phase), 0.0 * t], axis=1)
    return StepRun(step, places[:, None])


def error_of(step):
    return distance(vibrating(step).positions, vibrating(1e-7).positions)


@pytest.mark.parametrize("allowed", [0.3, 0.1, 0.03, 0.01])
@pytest.mark.parametrize("first", [1 / 60, 1 / 120, 1 / 300])
def test_a_step_whose_error_was_told_too_small_becomes_shorter(first, allowed):
    step, error = confirmed_step(vibrating, first, 1e-3 * allowed, 1e-5, lambda run: allowed)
    assert step < first or error_of(first) < 1.2 * allowed
    assert error_of(step) < 1.25 * allowed and error == pytest.approx(error_of(step), rel=0.25)


def test_a_step_that_is_confirmed_is_kept_and_costs_two_runs():
    tried = []

    def run(step):
        tried.append(step)
        return vibrating(step)

    step, error = confirmed_step(run, 1 / 480, 0.0, 1e-5, lambda run: 1.0)
    assert step == 1 / 480 and tried == [1 / 480, 1 / 960]
    assert error == pytest.approx(error_of(1 / 480), rel=0.1)


def test_the_larger_of_two_errors_counts():
    told = 1.5 * error_of(1 / 480)
    assert confirmed_step(vibrating, 1 / 480, told, 1e-5, lambda run: 1.0) == (1 / 480, told)


def test_a_shorter_step_is_no_shorter_than_it_must_be():
    step, _ = confirmed_step(vibrating, 1 / 240, 0.0, 1e-5, lambda run: 0.5 * error_of(1 / 240))
    assert 1 / 480 < step < 0.8 / 240


def test_what_was_told_counts_where_no_run_tells_more():
    def fragile(step):
        if step < 1 / 480:
            raise IntegrationError("diverges")
        return vibrating(step)

    for run in (fragile, lambda step: StepRun(1 / 480, vibrating(1 / 480).positions)):
        assert confirmed_step(run, 1 / 480, 0.02, 1e-5, lambda run: 1e-9) == (1 / 480, 0.02)


def test_the_shortest_step_ends_it():
    step, error = confirmed_step(vibrating, 1 / 120, 0.0, 1 / 1000, lambda run: 1e-12)
    assert 1 / 1000 <= step <= 2 / 1000 and error == pytest.approx(error_of(step), rel=0.1)


def test_the_step_takes_what_the_others_leave():
    assert step_allowance(1e-3, 0.0) == pytest.approx(MOST * 1e-3)
    assert step_allowance(1e-3, 0.5e-3) == pytest.approx((WHOLE - 0.5) * 1e-3)
    assert step_allowance(1e-3, (WHOLE - 0.5 * LEAST) * 1e-3) == pytest.approx(MISSED * 1e-3)
