"""Delayed commands: cubic curves shifted exactly, rest before the start, loops, and the transpose."""

import numpy as np
import pytest
from calmotion.simulation.inputs.curves import CommandDelay

H = 0.01


def test_cubics_are_shifted_exactly_and_rest_before_the_start():
    times, delay = H * np.arange(40), 0.0234
    cubic = np.polynomial.Polynomial([0.3, 0.0, 2.0, -4.0])
    values, rates = cubic(times)[:, None], cubic.deriv()(times)[:, None]
    found = CommandDelay((delay,), H, False).apply(values, rates)
    late = np.maximum(times - delay, 0.0)
    assert found[0][:, 0] == pytest.approx(cubic(late), abs=1e-14)
    assert found[1][:, 0] == pytest.approx(np.where(times < delay, 0.0, cubic.deriv()(late)), abs=1e-12)


def test_motors_have_their_own_delays_and_none_changes_nothing():
    rng = np.random.default_rng(0)
    values, rates = rng.normal(size=(2, 20, 3))
    found = CommandDelay((0.0, 0.02, 0.02), H, False).apply(values, rates)
    assert np.array_equal(found[0][:, 0], values[:, 0])
    assert found[0][2:, 1:] == pytest.approx(values[:-2, 1:]) and found[1][3:, 1:] == pytest.approx(rates[1:-2, 1:])
    assert CommandDelay((0.0, 0.0, 0.0), H, False).apply(values, rates)[0] is values


def test_a_loop_has_its_end_before_its_beginning():
    n = 50
    times = H * (np.arange(n + 2) - 1)
    w = 2 * np.pi / (n * H)
    found, _ = CommandDelay((0.013,), H, True).apply(np.sin(w * times)[:, None], w * np.cos(w * times)[:, None])
    assert found[:, 0] == pytest.approx(np.sin(w * (times - 0.013)), abs=1e-5)


@pytest.mark.parametrize("cyclic", [False, True])
def test_transpose(cyclic):
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 2, 30, 2))
    delay = CommandDelay((0.004, 0.031), H, cyclic)
    forward = sum(np.sum(x * y) for x, y in zip(delay.apply(*a), b, strict=True))
    backward = sum(np.sum(x * y) for x, y in zip(a, delay.transposed(*b), strict=True))
    assert forward == pytest.approx(backward, rel=1e-12)
