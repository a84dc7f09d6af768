"""Bodies cut from a skin by its weights, closed."""

from __future__ import annotations

import numpy as np
from calmotion.mesh.moments import is_closed, surface_moments
from calmotion.rigging.links import cut_skin
from tubes import tube


def weights_of(points, joints, length=2.0):
    along = np.clip((points[:, 0] / length * joints).astype(int), 0, joints - 1)
    return np.eye(joints)[along]


def test_pieces_are_closed_outward_and_make_up_the_whole():
    points, triangles = tube()
    pieces = cut_skin(points, triangles, weights_of(points, 2))
    assert set(pieces) == {0, 1}
    for x, t in pieces.values():
        assert is_closed(t, x)
        a, b, c = (x[t[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", np.cross(b - a, c - a), a) > 0.0
    volumes = [surface_moments(x, t).volume for x, t in pieces.values()]
    assert np.isclose(sum(volumes), 0.2 * 0.2 * 2.0)


def test_seams_of_the_skin_are_no_cuts():
    points, triangles = tube()
    # every triangle with corners of its own, as exporters make for texture seams
    loose, own = points[triangles.ravel()], np.arange(triangles.size, dtype=np.int32).reshape(-1, 3)
    pieces = cut_skin(loose, own, weights_of(loose, 2))
    assert np.isclose(sum(surface_moments(x, t).volume for x, t in pieces.values()), 0.08)
    assert all(is_closed(t, x) for x, t in pieces.values())


def test_a_joint_without_triangles_has_no_piece():
    points, triangles = tube()
    weights = np.zeros((len(points), 3))
    weights[:, 1] = 1.0
    assert set(cut_skin(points, triangles, weights)) == {1}


def test_a_sheet_is_not_a_body():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert cut_skin(points, np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.ones((4, 1))) == {}


def test_an_inward_skin_is_reoriented():
    points, triangles = tube()
    (x, t), *_ = cut_skin(points, triangles[:, ::-1].copy(), np.ones((len(points), 1))).values()
    a, b, c = (x[t[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", np.cross(b - a, c - a), a) > 0.0
