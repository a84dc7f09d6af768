"""The continuous adjoint: its gradient approaches that of the discrete one, which is exact, at second order."""

import numpy as np
import pytest
import sweep_cases
from calmotion.multibody.sensitivity.adjoint import adjoint
from calmotion.multibody.sensitivity.continuous_adjoint import continuous_adjoint
from calmotion.multibody.sensitivity.linearization import linearize
from calmotion.multibody.sensitivity.linearized_steps import bytes_of_an_instant
from sweep_cases import CASES, Case

EASE = 0.12


def smooth(p):
    """Angles and rates like those of `sweep_cases`, but with an acceleration that starts from zero."""
    w, t = 3.0 + 2.0 * np.arange(4), sweep_cases.TIMES[:, None]
    s = np.minimum(t / EASE, 1.0)
    share, rate = s**3 * (10.0 - 15.0 * s + 6.0 * s * s), 30.0 * s**2 * (1.0 - s) ** 2 / EASE
    return (1.0 + share * (np.cos(w * t) - 1.0)) @ p, (rate * (np.cos(w * t) - 1.0) - share * w * np.sin(w * t)) @ p


def gradients(monkeypatch, name, h, memory=4e9):
    """Gradients by all coefficients of an integral over time, by both adjoints, shape [4, J] each."""
    monkeypatch.setattr(sweep_cases, "H", h)
    monkeypatch.setattr(sweep_cases, "TIMES", np.arange(0.0, 0.3 + h / 2, h))
    monkeypatch.setattr(sweep_cases, "curves", smooth)
    case, times = Case(*CASES[name]), sweep_cases.TIMES
    weight = np.full(len(times), h)
    weight[[0, -1]] *= 0.5
    rng = np.random.default_rng(3)
    for integrand in ("wc", "wq", "wu"):
        shape = getattr(case, integrand).shape[1:]
        steady, swaying = rng.normal(size=(2, *shape))
        wave = np.cos(5.0 * times)[:, None, None]
        setattr(case, integrand, weight[:, None, None] * (swaying * wave + steady))
    trajectory, angles, rates = case.simulate(case.p)
    at = case.system, trajectory, angles, rates, case.ws
    density = case.gradient(trajectory.states)
    by_angle, by_rate = smooth(np.eye(4))
    exact = adjoint(linearize(*at), density)
    found = continuous_adjoint(linearize(*at, memory=memory, continuous=True), density)
    return [by_angle.T @ g_angle + by_rate.T @ g_rate for g_angle, g_rate in (exact, found)]


def error(monkeypatch, name, h):
    exact, found = gradients(monkeypatch, name, h)
    return np.linalg.norm(found - exact) / np.linalg.norm(exact)


# steps that resolve each case, whose undamped modes ring
@pytest.mark.parametrize(
    ("name", "h"),
    [
        ("with a free hinge", 0.00125),
        ("bodies of large deflection", 0.0025),
        ("sliders", 0.00125),
        ("a loop", 0.000625),
        ("a loop closed by a free slider", 0.000625),
    ],
)
def test_it_approaches_the_exact_gradient_at_second_order(monkeypatch, name, h):
    coarse, fine = error(monkeypatch, name, h), error(monkeypatch, name, h / 4)
    assert fine < 1e-5
    assert np.log2(coarse / fine) / 2.0 > 1.7


def test_windows_change_nothing(monkeypatch):
    name = "driven"
    _, whole = gradients(monkeypatch, name, 0.01)
    few = 7 * bytes_of_an_instant(Case(*CASES[name]).system)
    _, found = gradients(monkeypatch, name, 0.01, few)
    assert np.array_equal(whole, found)


def test_it_refuses_the_linearisation_of_the_other(monkeypatch):
    case = Case(*CASES["driven"])
    trajectory, angles, rates = case.simulate(case.p)
    lin = linearize(case.system, trajectory, angles, rates, case.ws)
    with pytest.raises(ValueError, match="continuous=True"):
        continuous_adjoint(lin, np.zeros(trajectory.states.V.shape))
