"""Limits of motors: their terms against differences, and each kind where it binds, kept to the last digit."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.limits.bounds import motor_bounds
from calmotion.model.limits.use import LimitUse, TermUse
from calmotion.model.run import RunSettings
from calmotion.retargeting import search
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem.limits import MARGIN, MOST, LimitTerms
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.testing import small_shot
from posed import ignore_progress

OPTIONS = RunSettings(step=1 / 120, tolerance=2e-4)  # so small that searches end at the same optimum
UNIT = {"velocity": "max_velocity", "acceleration": "max_acceleration", "effort": "max_torque"}


def with_limits(arm, **limits):
    """The arm with limits by name, one value for each motor."""
    motors = tuple(
        dataclasses.replace(motor, **{name: float(values[k]) for name, values in limits.items()})
        for k, motor in enumerate(arm.motors)
    )
    return dataclasses.replace(arm, motors=motors)


@pytest.fixture(scope="module")
def free(arm, animation, bodies):
    """The optimum without limits, and the largest value of each quantity of each motor in it."""
    wide = with_limits(arm, max_velocity=[1e6] * 2, max_acceleration=[1e6] * 2, max_torque=[1e6] * 2)
    result = optimize_shot(compile_shot(wide, animation, bodies), OPTIONS, ignore_progress)
    return result, {
        name: [abs(use.after) for use in result.limits if use.quantity == name] for name in ("position", *UNIT)
    }


@pytest.mark.parametrize("quantity", list(UNIT))
@pytest.mark.parametrize("share", [0.95, 0.85])
def test_limits_that_bind_are_kept_and_cost_no_more_than_they_must(arm, animation, bodies, free, quantity, share):
    without, largest = free
    character = with_limits(arm, **{UNIT[quantity]: share * np.array(largest[quantity])})
    result = optimize_shot(compile_shot(character, animation, bodies), OPTIONS, ignore_progress)
    uses = [use for use in result.limits if use.quantity == quantity]
    assert len(uses) == 2
    for use in uses:
        assert use.excess <= 1e-6 and abs(use.after) <= abs(use.limit) * (1 + 1e-6)
    assert max(abs(use.after / use.limit) for use in uses) > 0.999, "the limits should bind"
    assert 0.99 * without.objective_after < result.objective_after < 0.2 * result.objective_before
    if quantity != "effort" and result.objective_after > 1.01 * without.objective_after:
        assert max(use.cost_m or 0.0 for use in uses) > 0.0
    # the values that the user gets are those that were limited
    motion = result.after.motion
    if quantity == "effort":
        assert np.all(np.abs(motion.motor_efforts).max(axis=0) <= share * np.array(largest[quantity]) * (1 + 1e-6))


def test_ranges_that_the_animation_leaves_are_kept(arm, animation, bodies):
    at_frames = np.array([track.values for track in animation.tracks])
    limits = [(float(v.min()) + 0.01, float(v.max()) - 0.01) for v in at_frames]
    joints = tuple(
        dataclasses.replace(joint, lower=limits[k][0], upper=limits[k][1]) if k < 2 else joint
        for k, joint in enumerate(arm.joints)
    )
    result = optimize_shot(
        compile_shot(dataclasses.replace(arm, joints=joints), animation, bodies), OPTIONS, ignore_progress
    )
    values = result.after.motion.motor_values
    for k, (low, high) in enumerate(limits):
        assert values[:, k].min() >= low and values[:, k].max() <= high
    assert max(use.cost_m or 0.0 for use in result.limits) > 1e-4
    assert result.objective_after < 0.5 * result.objective_before


def test_all_limits_together(arm, animation, bodies, free):
    _, largest = free
    limits = {name: 0.9 * np.array(largest[quantity]) for quantity, name in UNIT.items()}
    result = optimize_shot(compile_shot(with_limits(arm, **limits), animation, bodies), OPTIONS, ignore_progress)
    assert all(use.excess <= 1e-6 for use in result.limits)
    assert result.objective_after < 0.2 * result.objective_before


def test_a_limit_that_cannot_be_kept_is_reported_as_exceeded(arm, animation, bodies, free):
    """The shoulder cannot even hold the arm."""
    compiled = compile_shot(with_limits(arm, max_torque=[np.inf, 0.05]), animation, bodies)
    # iterations that keep no limit take longest
    result = optimize_shot(compiled, dataclasses.replace(OPTIONS, max_iterations=2), ignore_progress)
    (use,) = [use for use in result.limits if use.quantity == "effort"]
    assert use.motor == 1 and use.excess > 0.01 and abs(use.after) > 0.05


def weak_arm(share):
    """A small arm on rigid links, with a share of the efforts that its motion needs."""
    arm, animation = small_shot()
    run = simulate_shot(compile_shot(arm, animation), RunSettings(step=0.01), ignore_progress).before.motion
    largest = np.abs(run.motor_efforts[run.judged]).max(axis=0)
    return compile_shot(with_limits(arm, max_torque=share * largest), animation)


@pytest.mark.parametrize(("share", "tolerance"), [(0.9, None), (0.9, 1e-3), (0.75, 1e-4)])
def test_robots_without_error_keep_limits_that_cost_a_hundred_times_their_tolerance(share, tolerance):
    """Rounding decides how long the longest takes: 22 iterations, or 35 with another order of operations."""
    options = RunSettings(step=0.01, tolerance=tolerance, max_iterations=60)
    found = optimize_shot(weak_arm(share), options, ignore_progress)
    assert found.search.stopped == "converged" and found.search.forward_simulations <= 75
    assert max(use.excess for use in found.limits) <= 1e-3


def test_a_search_whose_limits_stay_exceeded_is_not_told_as_converged():
    found = optimize_shot(weak_arm(1.0), RunSettings(step=0.05, max_iterations=1), ignore_progress)
    over = LimitUse(0, "effort", 1.0, 1.0, 1.002, 0.0, 0.002)
    term = TermUse("strength", "N m", "", 1.0, 1.002, 1.0, 0.0, 0.002)
    touched = (dataclasses.replace(over, excess=0.0009),)
    for stopped, limits, terms, told in (
        ("converged", touched, (), "converged"),
        ("converged", (over,), (), "limits exceeded"),
        ("no further decrease", touched, (term,), "limits exceeded"),
        ("goal reached", (over,), (), "limits exceeded"),
        ("iteration limit", (over,), (), "iteration limit"),
        ("interrupted", (over,), (), "interrupted"),
    ):
        search = dataclasses.replace(found.search, stopped=stopped)
        result = dataclasses.replace(found, search=search, limits=limits, terms=terms)
        assert result.with_limits_told().search.stopped == told


def test_locked_motors_are_limited_in_effort_alone(arm):
    arm = with_limits(arm, max_velocity=[1.0, 2.0], max_torque=[3.0, 4.0])
    bounds = motor_bounds(arm, np.array([False, True]))
    assert np.array_equal(np.isfinite(bounds["velocity"].upper), [False, True])
    assert np.array_equal(bounds["effort"].upper, [3.0, 4.0]) and np.array_equal(bounds["effort"].lower, [-3.0, -4.0])
    assert np.array_equal(np.isfinite(bounds["position"].upper), [False, True]) and "acceleration" not in bounds


@pytest.fixture
def terms(arm):
    arm = with_limits(arm, max_velocity=[1.0, 2.0])
    limits = LimitTerms(motor_bounds(arm), np.arange(9) > 1, 0.1, 7.0, on=True)
    rng = np.random.default_rng(0)
    for name in limits.multipliers:
        limits.multipliers[name] = np.maximum(0.0, rng.normal(size=(2, 9, 2)))
    return limits, {name: 2.0 * rng.normal(size=(9, 2)) for name in limits.bounds}


def test_terms_have_the_derivatives_that_they_say(terms):
    limits, values = terms
    d = {name: np.random.default_rng(1).normal(size=v.shape) for name, v in values.items()}
    e = 1e-6

    def moved(t):
        return {name: v + t * d[name] for name, v in values.items()}

    slope = sum(np.sum(limits.gradient(name, v) * d[name]) for name, v in values.items())
    assert slope == pytest.approx((limits.value(moved(e)) - limits.value(moved(-e))) / (2 * e), rel=1e-6)
    curvature = sum(np.sum(limits.curvature(name, v) * d[name] ** 2) for name, v in values.items())
    second = (limits.value(moved(1e-4)) - 2 * limits.value(values) + limits.value(moved(-1e-4))) / 1e-8
    assert curvature == pytest.approx(second, rel=1e-3)
    assert np.all(limits.gradient("velocity", values["velocity"])[:2] == 0.0), "nothing counts before the shot"


def test_shifted_terms_are_those_of_larger_values(terms):
    limits, values = terms
    more = np.random.default_rng(2).normal(size=(7, 2))
    shifted, moved = limits.shifted("velocity", more), values["velocity"].copy()
    moved[2:] += more
    larger = values | {"velocity": moved}
    assert shifted.value(values) == pytest.approx(limits.value(larger), rel=1e-12)
    assert np.allclose(shifted.gradient("velocity", values["velocity"]), limits.gradient("velocity", moved))
    assert shifted.excess(values) == pytest.approx(limits.excess(larger), rel=1e-12)
    assert limits.shifted("velocity", more[1:]) is limits, "of other instants"
    assert limits.shifted("effort", more) is limits, "of what is not limited"


def test_the_penalty_grows_no_further_than_short_steps_allow(terms):
    limits, values = terms
    for _ in range(30):  # an excess that stays
        limits = limits.updated(values, 0.0)
    assert MOST <= limits.rho / 7.0 <= 10.0 * MOST
    beside = limits.penalty_beside(1e6)
    for _ in range(30):  # where limits cost much more than the input told
        limits = limits.updated(values, 1e6)
    assert MOST <= limits.rho / beside <= 10.0 * MOST


def test_multipliers_grow_where_limits_are_exceeded_and_off_terms_are_nothing(terms):
    limits, values = terms
    before = limits.multipliers
    over = (values["velocity"] - limits.bounds["velocity"].upper) > 0.0
    over[:2] = False
    limits = limits.updated(values, 0.0)
    assert np.all(limits.multipliers["velocity"][0][over] > before["velocity"][0][over])
    off = LimitTerms(limits.bounds, limits.judged, 0.1, 7.0)
    assert off.value(values) == 0.0 and not np.any(off.curvature("velocity", values["velocity"]))
    kept = {name: 0.0 * v for name, v in values.items()}
    assert off.kept(kept) and off.tightened(kept, 0.0) is None and not off.on
    assert off.tightened(values, 0.0).on
    edge = {
        name: np.broadcast_to((1 - 0.5 * MARGIN) * limits.bounds[name].upper, v.shape) for name, v in values.items()
    }
    assert off.kept(edge)


def test_a_search_that_strays_beyond_its_limits_goes_back_to_the_best_point_within_them(
    arm, animation, bodies, free, monkeypatch
):
    """As one under limits of feet may: it ends at its limit of iterations, with curves that err more."""
    minimize, uses = search.minimize, [use for use in free[0].limits if use.quantity == "velocity"]

    def strays(problem, begun, fixed, ends, *hooks):
        zigzag = 0.5 * (-1.0) ** (np.arange(len(begun.x)) // len(arm.motors))
        far = dataclasses.replace(begun, x=np.where(fixed, 0.0, begun.x + zigzag), reason="iteration limit")
        return dataclasses.replace(far, at=problem.at(far.x, begun.at))

    character = with_limits(arm, max_velocity=[1.1 * max(abs(use.before), abs(use.after)) for use in uses])
    shot = compile_shot(character, animation, bodies)
    within = optimize_shot(shot, OPTIONS, ignore_progress)
    assert within.objective_after < 0.2 * within.objective_before
    monkeypatch.setattr(search, "minimize", strays)
    strayed = optimize_shot(shot, OPTIONS, ignore_progress)
    assert strayed.objective_after <= strayed.objective_before and strayed.search.stopped == "iteration limit"
    assert all(use.excess <= 1e-6 for use in strayed.limits)
    monkeypatch.setattr(search, "minimize", lambda *args: strays(args[0], minimize(*args), *args[2:]))
    late = optimize_shot(shot, OPTIONS, ignore_progress)
    assert late.objective_after == pytest.approx(within.objective_after, rel=1e-9)
