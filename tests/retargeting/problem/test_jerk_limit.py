"""The limit of jerk: read, differentiated, and kept by the curves that `optimize` writes."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.simulation.compiled_shot import compile_shot
from posed import ignore_progress, make_problem
from scipy.interpolate import CubicSpline


def jerk_of(times, values, fine):
    """Largest third difference over milliseconds of the cubic through samples, by no code of the engine."""
    curve, e = CubicSpline(times, values), 1e-3
    inside = fine[(fine > times[0] + 2 * e) & (fine < times[-1] - 2 * e)]
    inside = inside[np.abs(inside[:, None] - times).min(axis=1) > 2 * e]  # where it has one
    stencil = (
        curve(inside + 1.5 * e) - 3 * curve(inside + 0.5 * e) + 3 * curve(inside - 0.5 * e) - curve(inside - 1.5 * e)
    )
    return np.abs(stencil).max() / e**3


def with_jerk(arm, largest):
    motors = (dataclasses.replace(arm.motors[0]), dataclasses.replace(arm.motors[1], max_jerk=float(largest)))
    return dataclasses.replace(arm, motors=motors)


def test_its_values_are_third_differences_of_the_offsets(arm, bodies, animation):
    problem = make_problem(with_jerk(arm, 100.0), bodies, animation, limited=True)
    rng = np.random.default_rng(3)
    x = 1e-2 * rng.normal(size=problem.size)
    curves, grid, e = problem.space.changed(problem.curves, x), problem.grid, 1e-3 / 240
    at, jerks = grid.times[grid.judged][1:-1] + e, curves.derivatives[3][grid.judged][1:-1]
    offset = problem.space.basis.at_frames @ x.reshape(-1, 2)
    for motor, track in enumerate(animation.tracks):
        whole = CubicSpline(grid.frame_times, track.values + offset[:, motor])
        slopes = (whole(at + e, 2) - whole(at, 2)) / e
        np.testing.assert_allclose(jerks[:, motor], slopes, rtol=1e-5, atol=1e-5 * np.abs(slopes).max())
    assert kinds_of_limits()["jerk"].unit(None, "rad") == "rad/s^3"


def test_its_terms_are_differentiated_as_all_others(arm, bodies, animation):
    problem = make_problem(with_jerk(arm, 60.0), bodies, animation, limited=True)
    rng = np.random.default_rng(4)
    x, d = (1e-2 * rng.normal(size=problem.size) for _ in range(2))
    e = 1e-6
    ends = [problem.at(x + sign * e * d).merit for sign in (1, -1)]
    assert problem.at(x).linearized().gradient @ d == pytest.approx((ends[0] - ends[1]) / (2 * e), rel=1e-5)


@pytest.mark.parametrize("share", [0.7, 0.4])
def test_the_written_curves_keep_it_to_a_thousandth(arm, animation, bodies, share):
    times, fine = animation.frame_times, np.linspace(0.0, animation.frame_times[-1], 2001)
    needed = jerk_of(times, animation.tracks[1].values, fine)
    result = optimize_shot(
        compile_shot(with_jerk(arm, share * needed), animation, bodies), RunSettings(step=1 / 120, tolerance=2e-4),
        ignore_progress,
    )  # fmt: skip
    (use,) = [use for use in result.limits if use.quantity == "jerk"]
    assert abs(use.before) == pytest.approx(needed, rel=1e-3)
    assert jerk_of(times, result.curves[1].frame_values, fine) <= share * needed * 1.001
    assert abs(use.after) == pytest.approx(share * needed, rel=2e-3), "the limit should bind"
    assert result.objective_after < 0.5 * result.objective_before
