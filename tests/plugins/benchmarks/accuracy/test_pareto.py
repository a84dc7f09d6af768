"""The front, and how far a choice is from the fastest that does as well."""

import numpy as np
import pytest
from calmotion_plugins.benchmarks.accuracy.reference_bench import Point, front, over_fastest


def test_the_front_has_the_settings_that_no_other_beats():
    made = [(1.0, 5.0), (2.0, 3.0), (2.5, 4.0), (3.0, 1.0), (0.5, np.nan), (4.0, 1.0)]
    points = [Point("a", "bdf2", str(k), 0.1, 1, *pair) for k, pair in enumerate(made)]
    assert [point.setting for point in front(points)] == ["0", "1", "3"]


@pytest.fixture
def points():
    return [
        Point("a", "bdf2", "fast and wrong", 0.1, 1, 0.1, 2e-3),
        Point("a", "rk4", "fails", 0.1, 1, np.nan, np.nan),
        Point("a", "newmark", "fastest", 0.1, 1, 0.5, 9e-4),
        Point("a", "tolerance", "1 mm", 0.1, 1, 0.8, 5e-4),
    ]


def test_a_choice_is_compared_with_the_fastest_that_keeps_the_tolerance(points):
    ratio, fastest = over_fastest(points, [1e-2, 1e-3])[1e-3]
    assert ratio == pytest.approx(1.6) and fastest.setting == "fastest"
    assert over_fastest(points[-1:], [1e-2, 1e-3]) == {1e-3: (1.0, points[-1])}
