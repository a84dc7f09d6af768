"""Residuals of the play of gears: the sides that are wanted, and derivatives of the whole chain by differences."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.model.motor import Rotor
from calmotion.retargeting.avoided_reversals import play_of, with_reversals
from calmotion.retargeting.quantities import gear_play as module
from calmotion.retargeting.quantities.gear_play import REVERSAL, gear_play, wanted_sides
from posed import make_problem

H = 1 / 240


def stroke(peak, seconds):
    return peak * np.sin(np.pi * np.arange(round(seconds / H)) / round(seconds / H))


def test_short_and_weak_excursions_are_unwanted_and_long_ones_are_accepted():
    rest = np.ones(60)
    weak, brief, long = stroke(-0.15, 0.3), stroke(-1.0, 0.02), stroke(-1.0, 0.3)
    for part in (weak, brief):
        assert 2 * REVERSAL > H * np.sum(part**2)
        assert np.all(wanted_sides(np.concatenate([rest, part, rest]), H) == 1.0)
    sides = wanted_sides(np.concatenate([rest, long, rest]), H)
    assert np.all(sides[:60] == 1.0) and np.all(sides[-60:] == 1.0) and np.all(sides[62:-62] == -1.0)
    assert np.all(wanted_sides(-rest, H) == -1.0)


def test_sides_have_the_least_cost_of_all():
    share = np.random.default_rng(0).normal(size=12)
    share /= np.abs(share).max()
    h = 0.02

    def cost(sides):
        return h * np.sum(np.maximum(0.0, -sides * share) ** 2) + REVERSAL * np.count_nonzero(np.diff(sides))

    every = [2.0 * np.array(list(f"{k:012b}"), float) - 1.0 for k in range(2**12)]
    assert cost(wanted_sides(share, h)) == pytest.approx(min(map(cost, every)), rel=1e-12)


def test_nothing_counts_while_a_gear_changes_its_side_or_lies_clearly_on_the_wanted_one(monkeypatch):
    monkeypatch.setattr(module, "transmitted_by", lambda model, run: run)  # the efforts themselves
    efforts = np.concatenate([np.full(100, 5.0), np.linspace(5.0, -5.0, 41), np.full(100, -5.0)])[:, None]
    levers = np.ones((241, 1, 6, 1))
    terms = gear_play(None, np.array([0.01]), efforts, H, np.ones(241, bool), levers, 4.0)
    lost = terms.values(efforts)[:, 0]
    full = 2.0 * np.sqrt(6.0) * 0.01  # twice the way, from one side to the other
    assert np.all(lost[118:123] == 0.0) and np.all(np.abs(lost) < 0.04 * full)
    assert terms.values(-efforts)[0, 0] == pytest.approx(full, rel=1e-8)
    e = 1e-6
    moved = (terms.values(0.3 * efforts + e) - terms.values(0.3 * efforts - e)) / (2 * e)
    assert terms.slopes(0.3 * efforts).by_effort == pytest.approx(moved, abs=1e-7 * np.abs(moved).max())


@pytest.fixture(scope="module", params=["prescribed", "servo"])
def counted(request, arm, animation, bodies):
    rotor = Rotor(0.02, 4e3, 1.0, 0.1, 0.2, 0.5, 40.0, 0.2)
    motors = tuple(
        replace(m, backlash=0.02, model=request.param, position_gain=300.0, velocity_gain=5.0, rotor=rotor)
        for m in arm.motors
    )
    character = replace(arm, motors=motors)
    problem = make_problem(character, bodies, animation)
    problem = with_reversals(problem.at(np.zeros(problem.size)), play_of(character), 100.0).problem
    at = problem.at(0.02 * np.random.default_rng(0).normal(size=problem.size))
    return at, at.linearized()


def test_gradient_matches_central_differences(counted):
    at, linear = counted
    x, gradient = at.x, linear.gradient
    errors = float(np.sum(at.runs[0].errors ** 2))
    assert float(np.sum(at.residuals**2)) > 1.1 * errors, "play should count"
    d = np.random.default_rng(1).normal(size=len(x))

    def difference(e):
        return (at.problem.at(x + e * d).merit - at.problem.at(x - e * d).merit) / (2 * e)

    found = [(4.0 * difference(e) - difference(2 * e)) / 3.0 for e in (1e-4, 3e-5)]
    assert min(abs(gradient @ d - value) for value in found) < 1e-6 * abs(gradient @ d)


def test_products_are_those_of_the_residuals(counted):
    at, problem = counted
    x = at.x
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, len(x)))
    (residuals, _), Ha = problem.jvp(a), problem.product(a)
    change = np.sum(residuals**2) + a @ problem.space.penalty_product(a)
    assert abs(a @ Ha - change) < 5e-11 * change
    assert abs(a @ problem.product(b) - b @ Ha) < 5e-11 * (np.abs(b) @ np.abs(Ha))
    inverse = problem.precondition(np.zeros(len(x), bool))
    assert a @ inverse(b) == pytest.approx(b @ inverse(a), rel=1e-6)
