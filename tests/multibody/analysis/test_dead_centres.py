"""Dead centres out of the margins of closed loops."""

import numpy as np
from calmotion.multibody.analysis.joint_faults import dead_centres


def test_sharp_minima_far_below_what_is_usual_are_named():
    t = np.linspace(0.0, 2.0 * np.pi, 201)
    margins = 1e-3 * np.abs(np.cos(t)) + 1e-9
    margins[0] = 0.0  # before the first step nothing is known
    assert dead_centres(margins) == [50, 150]


def test_smooth_minima_and_trees_without_closed_chains_are_not_named():
    t = np.linspace(0.0, 2.0 * np.pi, 201)
    assert dead_centres(1e-3 * (2.0 + np.cos(t))) == []
    assert dead_centres(np.zeros(201)) == [] and dead_centres(np.zeros(2)) == []
