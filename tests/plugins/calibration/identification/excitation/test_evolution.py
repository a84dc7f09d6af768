"""The search for levels and phases."""

import numpy as np
import pytest
from calmotion_plugins.calibration.identification.excitation.evolution import least_point


def test_a_bowl_is_searched_to_its_middle_with_as_many_values_as_asked_for():
    middle, asked = np.array([0.5, -0.3, 1.0, 2.0]), []

    def value(point):
        asked.append((float(np.sum((point - middle) ** 2)), point))
        return asked[-1][0]

    found = least_point(value, 4, 600, np.random.default_rng(0))
    assert len(asked) == 600
    assert np.array_equal(found, min(asked, key=lambda pair: pair[0])[1])
    assert found == pytest.approx(middle, abs=0.1)
