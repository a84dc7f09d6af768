"""`calmotion bench measured`: which recordings are fitted together, and how often intervals hold."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion_plugins.benchmarks.accuracy.measured import choices, covered, machine_in
from calmotion_plugins.benchmarks.accuracy.two_mode_beam import Reading, Strip, fitted, predicted
from calmotion_plugins.calibration import Calibration, Estimate
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

NAMES = ("sweep_100", "sweep_400", "hold_100", "hold_400")


def test_fits_take_different_motions_and_are_spread_over_all():
    found = choices(NAMES, 2, None)
    assert len(found) == 4 and all(a.split("_")[0] != b.split("_")[0] for a, b in found)
    assert choices(NAMES, 2, 2) == [found[0], found[-1]]
    assert choices(("h20", "h30", "hm20"), 1, None) == [("h20",), ("h30",), ("hm20",)]


def fit(value, deviation, nominal=1.0):
    own = Estimate("position_gain", "/a", -1, "", nominal, 0.3, value, deviation, True, True)
    clock = Estimate("clock_offset", "f", -1, "s", 0.0, 0.01, 0.0, 0.01, False, True)
    return Calibration((own, clock), np.eye(2), {}, (), (), True, 1, 1, 1e-3, 0.0, 1.0)


def test_intervals_are_compared_with_estimates_of_disjoint_fits_as_factors():
    fits = {("a", "b"): fit(1.0, 0.1), ("c", "d"): fit(2.3, 0.01, nominal=2.0), ("a", "c"): fit(9.0, 0.1)}
    assert covered(fits) == {"position_gain /a": (1, 2)}


def test_a_folder_without_recorded_shots_is_refused(tmp_path):
    (tmp_path / "a.usda").write_text("#usda 1.0\n")
    with pytest.raises(ShotError, match="two recorded shots") as caught:
        machine_in(tmp_path)
    assert "NAME.csv" in caught.value.remedy


STRIP = Strip(0.2, 0.076, 0.00127, 0.08, 7850.0, 2e11, 1.5, 0.05, 2.0, 0.9)


def motion(turn, seconds):
    times = np.arange(0.0, 4.0, 1 / 500)
    s = np.clip(times / seconds, 0.0, 1.0)
    return times, turn * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def recorded(turn, seconds, factor=0.7, damping=0.05, gain=1.2):
    """A strip of another modulus, by its equations of motion."""
    times, hub = motion(turn, seconds)
    spline = CubicSpline(times, hub)
    w, turned, strains, _ = dataclasses.replace(STRIP, modulus=factor * STRIP.modulus).modes()
    f, z = 2.0 * np.pi * STRIP.corner, STRIP.filter_damping

    def rates(t, y):
        q, v, s, sv = y[:2], y[2:4], y[4], y[5]
        force = -2.0 * damping * w * v - w**2 * q - turned * spline(t, 2)
        return np.concatenate([v, force, [sv, f * f * (strains @ q - s) - 2.0 * z * f * sv]])

    start = [1e-3, 0.0, 0.0, 0.0, strains[0] * 1e-3, 0.0]
    found = solve_ivp(rates, (0.0, times[-1]), start, t_eval=times, rtol=1e-8, atol=1e-11, max_step=0.01)
    return Reading(times, hub, gain * found.y[4] + 0.01)


def test_a_beam_of_two_modes_tells_modulus_damping_and_gain_of_a_strip_and_predicts_another_motion():
    found = fitted(STRIP, [recorded(0.5, 0.8)])
    assert found.modulus == pytest.approx(0.7, rel=0.01) and found.damping == pytest.approx(0.05, rel=0.05)
    assert found.gain == pytest.approx(1.2, rel=0.02) and found.left < 0.02
    assert predicted(found, recorded(-0.8, 1.1)) < 0.03


def test_the_end_of_a_beam_moves_as_its_equations_of_motion_say():
    times, hub = motion(0.5, 0.6)
    spline, (w, turned, _, deflections) = CubicSpline(times, hub), STRIP.modes()

    def rates(t, y):
        return np.concatenate([y[2:], -0.06 * w * y[2:] - w**2 * y[:2] - turned * spline(t, 2)])

    found = solve_ivp(rates, (0.0, times[-1]), np.zeros(4), t_eval=times, rtol=1e-9, atol=1e-12, max_step=0.01)
    end = (STRIP.root + STRIP.length) * hub + deflections @ found.y[:2]
    assert np.abs(STRIP.end(times, hub, 0.03) - end).max() < 2e-3 * np.abs(deflections @ found.y[:2]).max()
