"""The tempo against closed forms: one hinge under limits of speed, acceleration, jerk and effort; pinned times."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.tempo import TempoSettings
from calmotion.retargeting.retiming.program import Path, TempoProgram
from calmotion.retargeting.retiming.splines import StretchBasis
from calmotion.retargeting.retiming.tempo import TempoInput, find_tempo
from calmotion.simulation import MotorEfforts, TempoLimits
from scipy.interpolate import CubicSpline

PEAK = 1.875  # fastest rate of a quintic over a turn in a second
FRAME = 1.0 / 24.0
INERTIA = 0.4


def limits(**given):
    return TempoLimits(**{name: np.full(1, given.get(name, np.inf)) for name in TempoLimits.__dataclass_fields__})


def moves(*starts, seconds=1.0, length=None):
    """Quintics of a turn each, in seconds each, that begin at some times; at rest between."""
    times = np.linspace(0.0, length or seconds, 2001)

    def values(at):
        s = np.clip((at[:, None] - np.array(starts)) / seconds, 0.0, 1.0)
        return np.sum(s**3 * (10.0 - 15.0 * s + 6.0 * s * s), axis=1, keepdims=True)

    return times, CubicSpline(times, values(times))


def tempo_of(times, curve, largest, settings=None, efforts=None):
    given = TempoInput(times, lambda at, order: curve(at, order), largest, efforts, FRAME)
    return find_tempo(given, settings or TempoSettings(slowest=10.0), "/Robot")


def most(times, curve, found, order):
    """Largest derivative of the performed curve, by differences of fine samples of it."""
    at = np.linspace(0.0, found.map.performance[-1], 8001)
    values = curve(found.map.animated(at))[:, 0]
    return float(np.max(np.abs(np.diff(values, order)))) / (at[1] - at[0]) ** order


def test_nothing_changes_where_all_limits_are_kept():
    found = tempo_of(*moves(0.0), limits(velocity=2.0, acceleration=6.0, jerk=61.0))
    assert found.map is None and found.report.lower_bound == 0.0 and not found.report.stretches
    assert found.frames == 25


@pytest.mark.parametrize("share", [0.8, 0.6, 0.4])
def test_a_limit_of_speed_gives_a_trapezoid(share):
    """Where the animation is faster than the limit, its path is covered at the limit; elsewhere nothing changes."""
    times, curve = moves(0.0)
    found = tempo_of(times, curve, limits(velocity=share * PEAK))
    exact = np.trapezoid(np.maximum(curve(times, 1)[:, 0] / (share * PEAK) - 1.0, 0.0), times)
    assert found.report.lower_bound == pytest.approx(exact, rel=1e-2)
    assert exact < found.map.added < 1.03 * exact + FRAME
    assert most(times, curve, found, 1) <= share * PEAK
    (stretch,) = found.report.stretches
    assert stretch.because == ((0, "velocity"),) and stretch.start > 0.02 and stretch.end < 0.98
    assert found.map.performance[-1] / FRAME == pytest.approx(found.frames - 1, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "order", "largest"), [("acceleration", 2, 1.2), ("acceleration", 2, 3.0), ("jerk", 3, 20.0)]
)
def test_limits_of_acceleration_and_jerk_are_kept(name, order, largest):
    times, curve = moves(0.0)
    found = tempo_of(times, curve, limits(**{name: largest}))
    assert most(times, curve, found, order) <= 1.001 * largest
    assert found.map.added < 0.75 * found.report.uniform_added
    if order == 2:
        assert found.map.added < 1.05 * found.report.lower_bound + FRAME


def test_a_limit_of_effort_gives_bang_bang():
    """A quintic over the whole turn is left where the effort is at its limit: two phases, 2 sqrt(turn I / effort)."""
    times, curve = moves(0.0)
    rate, acceleration = curve(times, 1), curve(times, 2)
    efforts = MotorEfforts(np.zeros_like(rate), INERTIA * acceleration, INERTIA * rate)
    largest = 0.05 * INERTIA * 5.7735
    found = tempo_of(times, curve, limits(effort=largest), efforts=efforts)
    bang_bang = 2.0 * np.sqrt(INERTIA / largest)
    assert found.map.performance[-1] == pytest.approx(bang_bang, rel=0.03)
    assert most(times, curve, found, 2) * INERTIA <= 1.001 * largest
    heavy = MotorEfforts(np.full_like(rate, 2.0), INERTIA * acceleration, INERTIA * rate)
    with pytest.raises(ShotError, match=r"no tempo helps.*1\.5 N m, where it takes 2 N m at \d"):
        tempo_of(times, curve, limits(effort=1.5), efforts=heavy)


def test_pins_around_what_needs_no_stretch_leave_it_untouched():
    times, curve = moves(0.0, 2.0, length=4.0)
    slower = np.where(times < 1.5, 1.0, 0.3)  # the second turn is slow enough
    curve = CubicSpline(times, curve(times) * slower[:, None] + 0.7 * (times >= 1.5)[:, None])
    settings = TempoSettings(slowest=10.0, pinned=(1.5, 2.0, 3.5))
    found = tempo_of(times, curve, limits(velocity=0.5 * PEAK), settings)
    inside = np.linspace(1.6, 3.4, 50)
    shift = found.map.performed(inside) - inside
    assert np.ptp(shift) < 1e-4 and shift[0] > 0.1
    assert [late for _, late in found.report.pins] == pytest.approx([shift[0]] * 3, abs=1e-3)


def test_parts_catch_up_between_pins_or_are_refused_with_the_least_change():
    times, curve = moves(0.0, 1.5, length=3.0)
    largest = limits(velocity=0.8 * PEAK)
    settings = TempoSettings(slowest=3.0, fastest=0.8, pinned=(0.0, 1.5, 3.0))
    found = tempo_of(times, curve, largest, settings)
    assert found.excess < 1e-3 and most(times, curve, found, 1) <= 0.8 * PEAK
    assert np.max(np.abs([late for _, late in found.report.pins])) < 1e-3
    assert found.map.stretch(np.linspace(0.0, 3.0, 500)).min() >= 0.8 - 1e-9
    with pytest.raises(ShotError) as refused:
        tempo_of(times, curve, largest, TempoSettings(slowest=3.0, pinned=(0.0, 1.5, 3.0)))
    text = refused.value.message()
    assert "0.000 s and 1.500 s" in text and "fastest=0." in text
    fastest = float(text.split("fastest=")[1].rstrip("."))
    assert tempo_of(times, curve, largest, TempoSettings(3.0, fastest, (0.0, 1.5, 3.0))).excess < 1e-3
    less = float(text.split("let the second be ")[1].split(" s later")[0])
    later = tempo_of(times, curve, largest, TempoSettings(slowest=3.0, pinned=(0.0,)))
    assert less == pytest.approx(later.map.performed(np.array([1.5]))[0] - 1.5, abs=0.02)


def test_what_may_not_be_slower_keeps_the_largest_stretch():
    times, curve = moves(0.0)
    found = tempo_of(times, curve, limits(velocity=0.4 * PEAK), TempoSettings(slowest=2.0))
    assert found.map.stretch(times).max() <= 2.0 + 1e-9 and found.excess == pytest.approx(0.25, abs=0.01)
    assert found.report.lacking == pytest.approx(2.5, rel=0.01)


def test_slopes_of_the_program_are_those_of_differences():
    times, curve = moves(0.0)
    basis = StretchBasis.over(1.0, 0.1)
    derivatives = tuple(curve(basis.times, order) for order in (1, 2, 3))
    efforts = MotorEfforts(np.cos(derivatives[0]), derivatives[1] ** 2, derivatives[0])
    largest = limits(velocity=2.0, acceleration=3.0, jerk=20.0, effort=4.0)
    program = TempoProgram(basis, Path(derivatives, largest, efforts), 3.0, 1.0, 0.02)
    rng = np.random.default_rng(3)
    c, d, h = 1.5 + 0.3 * rng.random(basis.count), rng.standard_normal(basis.count), 1e-5
    matrices = basis.matrices(basis.times)
    for term, above, below in zip(program.terms(c), program.terms(c + h * d), program.terms(c - h * d), strict=True):
        told = sum(slope * (matrix @ d)[:, None] for slope, matrix in zip(term.slopes, matrices, strict=True))
        assert told == pytest.approx((above.value - below.value) / (2.0 * h), rel=1e-7, abs=1e-7)


def toppra_added(times, curve, largest):
    """What TOPP-RA adds to motors under limits of speed and acceleration that are never faster than the animation."""
    toppra = pytest.importorskip("toppra")
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    toppra.setup_logging("ERROR")
    path = toppra.SplineInterpolator(times, np.column_stack([curve(times), times]))
    speeds, accelerations = np.append(largest.velocity, 1.0), np.append(largest.acceleration, 1e6)
    rules = [JointVelocityConstraint(np.stack([-speeds, speeds], axis=1))]
    if np.isfinite(accelerations).all():
        rules.append(JointAccelerationConstraint(np.stack([-accelerations, accelerations], axis=1)))
    _, speed, _ = TOPPRA(rules, path, gridpoints=times).compute_parameterization(1.0, 1.0)
    return float(np.sum(2.0 * np.diff(times) / (speed[1:] + speed[:-1]))) - times[-1]


@pytest.mark.parametrize("share", [0.8, 0.4])
@pytest.mark.parametrize("name", ["velocity", "acceleration"])
def test_a_rigid_arm_takes_as_long_as_by_toppra(name, share):
    rng, frames = np.random.default_rng(1), np.arange(49) * FRAME
    ways = [moves(*rng.uniform(0.1, 0.9, 3), length=2.0)[1](frames) * rng.uniform(0.5, 1.5) for _ in range(6)]
    curve = CubicSpline(frames, np.hstack(ways), bc_type="clamped")
    times = np.linspace(0.0, frames[-1], 961)
    order = ("velocity", "acceleration").index(name) + 1
    bounds = {key: np.full(6, np.inf) for key in TempoLimits.__dataclass_fields__}
    largest = TempoLimits(**bounds | {name: share * np.abs(curve(times, order)).max(axis=0)})
    found = tempo_of(times, curve, largest)
    assert found.added <= 1.02 * toppra_added(times, curve, largest)
    at = np.linspace(0.0, found.map.performance[-1], 20001)
    reached = np.abs(np.diff(curve(found.map.animated(at)), order, axis=0)).max(axis=0) / (at[1] - at[0]) ** order
    assert np.max(reached / getattr(largest, name)) <= 1.001
    # a robot that vibrates slowly takes a smoother tempo
    soft = TempoInput(times, lambda at, order: curve(at, order), largest, None, FRAME, lowest_frequency=2.0)
    assert found.added < find_tempo(soft, TempoSettings(slowest=10.0), "/Robot").added
