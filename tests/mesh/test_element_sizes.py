"""Element size from the wanted accuracy, and how closely a mesh follows the surface."""

import numpy as np
import pytest
from calmotion.mesh.element_sizes import (
    ACCURACY,
    Shape,
    element_size,
    envelope,
    expected_nodes,
    shape_of,
    smallest_size,
    wall_thickness,
)
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.mesh.tetrahedra import boundary_triangles
from calmotion.reduction.basis.natural_modes import clamped_modes
from calmotion.reduction.elements.assembly import assemble


def skin(helpers, size, counts=(4, 2, 2)):
    points, tets = helpers.box(counts, size)
    return points, boundary_triangles(tets)


def test_the_thickness_of_a_plate_is_measured_under_most_of_its_surface(helpers):
    points, triangles = skin(helpers, (0.2, 0.1, 0.004), (8, 8, 1))
    walls = wall_thickness(points, triangles)
    assert np.quantile(walls, [0.05, 0.5, 0.9]) == pytest.approx([0.004] * 3)
    shape = shape_of(points, triangles)
    assert shape.thickness == pytest.approx(0.004) and shape.length == pytest.approx(0.2)
    assert shape.volume == pytest.approx(8e-5) and shape.area == pytest.approx(2 * (0.02 + 8e-4 + 4e-4))


def test_the_walls_of_a_hollow_box_are_thin(helpers):
    points, triangles = skin(helpers, (0.2, 0.1, 0.1))
    inner = (points - [0.1, 0.05, 0.05]) * [0.97, 0.94, 0.94] + [0.1, 0.05, 0.05]
    hollow = np.vstack([points, inner]), np.vstack([triangles, triangles[:, ::-1] + len(points)])
    assert shape_of(*hollow).thickness == pytest.approx(0.003, rel=1e-6)


def test_the_size_follows_the_unit_and_the_wanted_accuracy():
    shape = Shape(thickness=0.02, length=0.4, volume=1.6e-4, area=0.0328)
    small = Shape(thickness=2e-5, length=4e-4, volume=1.6e-13, area=3.28e-8)
    assert element_size(small) == pytest.approx(1e-3 * element_size(shape), rel=1e-6)
    assert element_size(shape, 4.0 * ACCURACY) == pytest.approx(2.0 * element_size(shape))
    assert 0.5 < element_size(shape) / 0.02 < 1.5  # about one element across a slender beam


def test_cost_limits_the_size():
    shell = Shape(thickness=1e-3, length=1.0, volume=1e-3, area=2.0)
    size = element_size(shell, 1e-4, max_nodes=5000)
    assert size == smallest_size(shell, 5000) > element_size(shell, 1e-4, max_nodes=10**9)
    assert expected_nodes(shell, size) == pytest.approx(5000, rel=1e-3)


@pytest.mark.parametrize(("size", "counts"), [((0.4, 0.02, 0.02), (40, 2, 2)), ((0.1, 0.1, 0.005), (20, 20, 1))])
def test_the_number_of_nodes_is_estimated_from_volume_and_area(helpers, size, counts):
    """The mesher's tetrahedra are nearly regular; these bricks cut in six, which are not, need up to twice as many."""
    points, tets = helpers.box(counts, size)
    found = expected_nodes(shape_of(points, boundary_triangles(tets)), size[0] / counts[0])
    assert 0.4 < found / len(quadratic_mesh(points, tets).nodes) < 1.1


@pytest.mark.parametrize(("length", "cells"), [(0.4, (24, 1, 1)), (0.1, (12, 2, 2))])
def test_the_size_gives_the_wanted_accuracy_on_a_clamped_beam(helpers, plastic, length, cells):
    """Cells no finer than the rule asks for, against a mesh of several times as many."""
    width = 0.02
    shape = Shape(thickness=width, length=length, volume=length * width**2, area=4 * length * width)
    assert length / cells[0] >= 0.8 * element_size(shape) and width / cells[1] >= 0.8 * element_size(shape)

    def first(counts):
        model = assemble(*helpers.box(counts, (length, width, width)), plastic)
        return clamped_modes(model, 3, np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9))[0]

    finest = first(tuple(3 * n if k == 0 else max(4, 3 * n) for k, n in enumerate(cells)))
    assert np.abs(first(cells) / finest - 1.0)[:2].max() < 1.5 * ACCURACY


def walls(thickness):
    return Shape(thickness, length=0.5, volume=1e-3, area=0.1)


def test_the_envelope_shrinks_with_the_elements_and_the_walls():
    assert envelope(0.02, 0.6, walls(1.0), 12) == pytest.approx(2e-4)
    assert envelope(0.01, 0.6, walls(1.0), 5000) == pytest.approx(5e-4)
    assert envelope(1.0, 0.1, walls(1.0), 5000) == pytest.approx(2e-4)  # never more than a part of the body
    assert envelope(0.01, 0.6, walls(1e-6), 5000) == pytest.approx(1.2e-4)  # but it can be met
    assert envelope(0.01, 0.6, walls(1e-3), 5000) == pytest.approx(2e-4)  # nor of its walls
