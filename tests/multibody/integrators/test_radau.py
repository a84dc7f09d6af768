"""Radau IIA: its published orders on trees and loops, and agreement with an explicit method."""

import numpy as np
import pytest
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators import radau
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.system import State


def errors(run, steps, exact, total):
    states = run(steps, "radau").states
    every = total // steps
    return [
        np.abs(getattr(states, part)[1:] - getattr(exact, part)[::every][1:]).max() for part in ("c", "u", "V", "lam")
    ]


def test_orders_are_five_in_the_motion_and_three_in_multipliers(flexible_tree):
    """Between instants the integrator must see the polynomial itself: its own drive."""
    system, duration = flexible_tree.system, flexible_tree.duration
    first = State(*[part[0] for part in flexible_tree(4, "bdf2").states])

    def run(steps, _):
        times = np.linspace(0.0, duration, steps + 1)
        ws = Workspace.for_system(system)
        return type("Run", (), {"states": radau.integrate(system, first, flexible_tree.drive, times, ws)})

    exact = run(160, "").states
    orders = np.log2(np.divide(*(errors(run, steps, exact, 160) for steps in (20, 40))))
    assert np.all(np.abs(orders[:3] - 5.0) < 0.5) and abs(orders[3] - 3.0) < 0.4, orders


def test_it_agrees_with_an_explicit_method(flexible_tree):
    one, other = flexible_tree(80, "radau").states, flexible_tree(800, "rk4").states
    for part in ("c", "u", "V"):
        size = np.abs(getattr(one, part)).max()
        assert np.abs(getattr(one, part)[-1] - getattr(other, part)[-1]).max() < 1e-7 * size


def test_the_tableau_is_that_of_the_collocation_method():
    """sum_j a_ij c_j^(k-1) = c_i^k / k for k = 1, 2, 3."""
    c = radau.NODES
    for k in (1, 2, 3):
        assert np.allclose(radau.BUTCHER @ c ** (k - 1), c**k / k, atol=1e-15)


def test_a_step_that_cannot_be_solved_is_named(flexible_tree):
    system = flexible_tree.system
    first = State(*[part[0].copy() for part in flexible_tree(4, "bdf2").states])

    def broken(t):
        return tuple(np.full((len(t), 4), np.nan) for _ in range(3))

    with pytest.raises(SimulationFailure) as failure:
        radau.integrate(system, first, broken, np.array([0.0, 0.1]), Workspace.for_system(system))
    assert failure.value.time_s == pytest.approx(0.1) and 0 <= failure.value.component < 4
