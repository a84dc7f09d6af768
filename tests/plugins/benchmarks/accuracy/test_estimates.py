"""Random shots by error over estimate: drawn alike every time, measured against regular meshes."""

import numpy as np
import pytest
from calmotion_plugins.benchmarks.accuracy import estimates
from calmotion_plugins.benchmarks.accuracy.estimates import Judged, counts, drawn


def row(number, ratio, reference=1e-5):
    return Judged(number, 1e-3, 1e-3, 2e-4, ratio * 1e-3, reference, 600, 5000)


def test_a_shot_is_known_by_its_number():
    one, again, other = drawn(3), drawn(3), drawn(4)
    assert one.tolerance == again.tolerance != other.tolerance
    assert np.array_equal(one.meshes.meshes[0].points, again.meshes.meshes[0].points)
    assert all(mesh.quality.frequency_error <= estimates.MESH_ACCURACY for mesh in one.meshes.meshes)


def test_links_that_are_alike_take_the_same_stiffness_from_finer_meshes():
    """Loads choose other bases on finer meshes of the first link: it took a factor of 0.925, the other one 0.982."""
    shot = drawn(145)
    options = estimates.RunSettings(tolerance=shot.tolerance)
    reduction = estimates.reduction_for(shot.character, shot.animation, shot.meshes, options)
    finer = reduction.with_finer_meshes(shot.tolerance, {0: 1e-4, 1: 1e-4}, 2500)
    first, second = (mesh.quality.stiffness_factor for mesh in finer.meshes.meshes)
    assert first == pytest.approx(second, rel=1e-3) and 0.97 < first < 1.0


def test_every_shot_is_counted_once():
    table = counts([row(k, ratio) for k, ratio in enumerate([0.01, 0.3, 0.4, 0.9, 1.2, 7.0])])
    assert [int(n) for _, n, _ in table[:-1]] == [1, 0, 0, 2, 1, 1, 1, 0]
    assert table[0][0] == "0 to 0.05" and table[6] == ["above 1.5", "1", "17%"]
    assert table[-1] == ["largest", "7.00", "-"]
