"""Newmark's family: orders on a flexible tree, its formulas, and its spectral radius on an oscillator."""

import numpy as np
import pytest
from calmotion.multibody.integrators.coefficients import IMPLICIT, generalized_alpha_integrator, newmark_integrator


@pytest.mark.parametrize("integrator", IMPLICIT)
def test_it_is_of_second_order_in_positions_velocities_and_multipliers(flexible_tree, integrator):
    exact = flexible_tree(3200, integrator).states
    errors = []
    for steps in (100, 200):
        states, every = flexible_tree(steps, integrator).states, 3200 // steps
        errors.append(
            [
                np.abs(getattr(states, part) - getattr(exact, part)[::every])[steps // 20 :].max()
                for part in ("c", "u", "V", "lam")
            ]
        )
    orders = np.log2(np.divide(*errors))
    assert np.all(np.abs(orders - 2.0) < 0.12), (orders, errors)


def test_all_schemes_go_to_the_same_motion(flexible_tree):
    ends = [flexible_tree(1600, integrator).states.c[-1] for integrator in IMPLICIT]
    assert np.abs(np.ptp(ends, axis=0)).max() < 3e-7


@pytest.mark.parametrize("radius", [1.0, 0.8, 0.3, 0.0])
def test_spectral_radius_at_infinite_frequency(radius):
    """The recursion of (D, h V, h^2 a) for a motion whose V' must vanish (an infinite stiffness holds D at 0)."""
    scheme = generalized_alpha_integrator(1.0, radius)
    beta, gamma = scheme.newmark_beta, scheme.newmark_gamma
    # x_n = 0 gives a_n from V and a before it; then V_n
    a = np.array([-1.0 / beta, -(0.5 / beta - 1.0)])
    V = np.array([1.0, 1.0 - gamma]) + gamma * a
    roots = np.linalg.eigvals(np.array([V, a]))
    assert np.abs(roots).max() <= 1.0 + 1e-9
    # the third root is that of V' itself: (1 - alpha_f) V'_n + alpha_f V'_n-1
    assert max(np.abs(roots).max(), scheme.alpha_f / (1.0 - scheme.alpha_f)) == pytest.approx(radius, abs=1e-6) or (
        radius == 0.0 and np.abs(roots).max() < 1e-6
    )


def test_newmark_is_the_trapezoidal_rule():
    scheme = newmark_integrator(0.01)
    assert (scheme.velocity, scheme.acceleration) == (200.0, 200.0)
    assert generalized_alpha_integrator(0.01, 1.0).alpha_m == generalized_alpha_integrator(0.01, 1.0).alpha_f == 0.5
