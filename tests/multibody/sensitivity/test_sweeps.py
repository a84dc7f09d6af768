"""Tangent and adjoint sweeps: transpose test, and central differences of the whole simulation (identities 6, 7)."""

import numpy as np
import pytest
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.sensitivity.adjoint import adjoint
from calmotion.multibody.sensitivity.linearization import linearize
from calmotion.multibody.sensitivity.linearized_steps import bytes_of_an_instant
from calmotion.multibody.sensitivity.tangent import tangent
from motor_runs import transmitted
from sweep_cases import CASES, TIMES, Case, curves


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES)
def case(request):
    case = Case(*request.param)
    trajectory, angles, rates = case.simulate(case.p)
    lin = linearize(case.system, trajectory, angles, rates, case.ws)
    return case, lin, case.gradient(trajectory.states)


def test_adjoint_is_the_transpose_of_the_tangent(case):
    case, lin, gradient = case
    d_angle, d_rate = curves(case.dp)
    products = tangent(lin, d_angle, d_rate)[0] * gradient
    g_angle, g_rate = adjoint(lin, gradient)
    backward = float(np.sum(g_angle * d_angle) + np.sum(g_rate * d_rate))
    assert abs(float(np.sum(products)) - backward) < 1e-12 * float(np.abs(products).sum())


def test_windows_of_a_few_instants_give_the_same_sweeps(case):
    case, lin, gradient = case
    d_angle, d_rate = curves(case.dp)
    angles, rates = curves(case.p)
    few = linearize(case.system, lin.trajectory, angles, rates, case.ws, memory=7 * bytes_of_an_instant(case.system))
    assert few.size == 7 and len(few.windows()) == 5 and few.windows()[-1] == (28, 31)
    assert np.array_equal(tangent(few, d_angle, d_rate)[0], tangent(lin, d_angle, d_rate)[0])
    for found, expected in zip(adjoint(few, gradient), adjoint(lin, gradient), strict=True):
        assert np.array_equal(found, expected)
    # what the case's other tests use has been made with the same workspace, and is whole
    again = linearize(case.system, lin.trajectory, angles, rates, case.ws, few)
    assert len(again.windows()) == 1


def test_gradient_matches_central_differences_of_the_whole_simulation(case):
    case, lin, gradient = case
    g_angle, g_rate = adjoint(lin, gradient)
    d_angle, d_rate = curves(case.dp)
    found = float(np.sum(g_angle * d_angle) + np.sum(g_rate * d_rate))
    e = 5e-4

    def difference(e):
        return (case.value(case.p + e * case.dp) - case.value(case.p - e * case.dp)) / (2 * e)

    # Richardson extrapolation of two central differences
    expected = (4.0 * difference(e) - difference(2 * e)) / 3.0
    assert abs(found - expected) < 1e-7 * abs(expected)


def test_what_motors_transmit_matches_differences_and_its_transpose(case):
    case, lin, gradient = case
    driven = case.system.rows == 6
    weights = np.random.default_rng(8).normal(size=(len(TIMES), len(driven))) * driven
    # holding torques are large, and would hide the rest; those of a free slider at rest are not determined
    weights[0] *= 0.0 if np.any((case.system.rows == 5) & (case.system.sliding == 1)) else 1e-2

    def effort(p):
        trajectory, angles, rates = case.simulate(p)
        found = reactions(case.system, trajectory, angles, rates)
        own = driven & (case.system.rotor < 0)  # a servo's motor also turns its rotor
        through = transmitted(case.system, found)
        assert np.allclose(found.efforts[:, own], through[:, own], rtol=1e-12, atol=1e-12)
        return float(np.sum(weights * through))

    d_angle, d_rate = curves(case.dp)
    moved, change = tangent(lin, d_angle, d_rate, efforts=True)
    found = float(np.sum(weights * change))
    e = 1e-3
    steps = [(effort(case.p + k * e * case.dp) - effort(case.p - k * e * case.dp)) / (2 * k * e) for k in (1, 2)]
    expected = (4.0 * steps[0] - steps[1]) / 3.0
    assert abs(found - expected) < 1e-6 * abs(expected)
    g_angle, g_rate = adjoint(lin, gradient, weights)
    forward = found + float(np.sum(moved * gradient))
    backward = float(np.sum(g_angle * d_angle) + np.sum(g_rate * d_rate))
    size = sum(float(np.abs(part).sum()) for part in (weights * change, moved * gradient, g_angle * d_angle))
    assert abs(forward - backward) < 1e-12 * size
