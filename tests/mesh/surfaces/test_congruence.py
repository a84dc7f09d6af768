"""The isometries between surfaces."""

import numpy as np
import pytest
from calmotion.mesh.surfaces.congruence import isometries
from mesher_links import bracket, divided

MIRROR = np.diag([1.0, -1.0, 1.0])


def surface_of(part):
    return np.array(part.vertices), np.array(part.faces)


def turned(seed=3):
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return turn if np.linalg.det(turn) > 0.0 else -turn


@pytest.mark.parametrize("turn", [np.eye(3), turned(), MIRROR, turned() @ MIRROR])
def test_the_isometry_of_a_part_is_found_whatever_the_order_of_its_points(turn):
    points, triangles = surface_of(bracket())
    order = np.random.default_rng(1).permutation(len(points))
    place = np.empty(len(points), dtype=int)
    place[order] = np.arange(len(points))
    other = points[order] @ turn.T + [0.3, -0.2, 0.1]
    others = place[triangles][:, ::-1] if np.linalg.det(turn) < 0.0 else place[triangles]
    (found,) = isometries(points, triangles, other, others)
    assert found.turn == pytest.approx(turn, abs=1e-6) and found.mirrors == (np.linalg.det(turn) < 0.0)
    assert found(points)[order] == pytest.approx(other, abs=1e-6)


def test_parts_that_differ_have_none():
    points, triangles = surface_of(bracket())
    assert not list(isometries(points, triangles, 1.01 * points, triangles))
    size = np.linalg.norm(np.ptp(points, axis=0))
    other, others = divided(points, triangles)
    far = other.copy()
    far[np.argmax(other[:, 0]), 0] += 4e-3 * size  # a corner
    assert not list(isometries(points, triangles, far, others))
    wider = other * [1.0, 1.0, 1.004]  # all of it, by less
    assert not list(isometries(points, triangles, wider, others))
    assert list(isometries(points, triangles, 1.0002 * other, others))


@pytest.mark.parametrize("turn", [np.eye(3), turned(), turned() @ MIRROR])
def test_surfaces_with_other_triangles_are_alike_if_they_are_near_each_other(turn):
    points, triangles = surface_of(bracket())
    size = np.linalg.norm(np.ptp(points, axis=0))
    other, others = divided(points, triangles)
    other = other @ turn.T + [0.3, -0.2, 0.1]
    if np.linalg.det(turn) < 0.0:
        others = others[:, ::-1]
    (found,) = isometries(points, triangles, other, others)
    assert found.turn == pytest.approx(turn, abs=1e-6) and found.distance < 1e-6 * size
    moved = other.copy()
    moved[np.argmax(other[:, 0])] += 1e-3 * size / np.sqrt(3.0)
    (found,) = isometries(points, triangles, moved, others)
    assert 1e-4 * size < found.distance <= 1.01e-3 * size


def test_an_open_surface_has_its_isometry_wherever_it_is():
    points, triangles = surface_of(bracket())
    turn = turned(5)
    (found,) = isometries(points, triangles[5:], points @ turn.T + [1.0, 2.0, -1.0], triangles[5:])
    assert found.turn == pytest.approx(turn, abs=1e-6)
    # a mirror image whose triangles were left as they are
    (found,) = isometries(points, triangles[5:], points @ MIRROR, triangles[5:])
    assert found.mirrors
