"""Motor inputs between instants."""

import numpy as np
from calmotion.multibody.motors.between_instants import hermite_drive, stage_inputs
from scipy.interpolate import CubicSpline


def test_a_cubic_spline_with_knots_on_instants_is_reproduced():
    times = np.linspace(0.0, 1.0, 11)
    spline = CubicSpline(times[::2], np.sin(5.0 * times[::2])[:, None] * [1.0, -2.0])
    drive = hermite_drive(times, spline(times), spline(times, 1))
    t = np.linspace(0.01, 0.99, 37)
    for order, values in enumerate(drive(t)):
        assert np.abs(values - spline(t, order)).max() < 1e-11


def test_a_step_sees_its_own_side_of_a_jump_in_acceleration():
    times = np.array([0.0, 1.0, 2.0])
    # at rest, then x = (t - 1)^2
    drive = hermite_drive(times, np.array([[0.0], [0.0], [1.0]]), np.array([[0.0], [0.0], [2.0]]))
    found = stage_inputs(drive, times, np.array([0.0, 0.5, 1.0]))
    assert found.shape == (2, 3, 3, 1)
    assert np.allclose(found[0], 0.0) and np.allclose(found[1, :, 2], 2.0)
    assert np.allclose(found[1, :, 0, 0], [0.0, 0.25, 1.0]) and np.allclose(found[1, :, 1, 0], [0.0, 1.0, 2.0])
