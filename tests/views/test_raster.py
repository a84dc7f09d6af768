"""The renderer: it shows what is in front, without gaps, and at the right distance."""

import numpy as np
import pytest
from calmotion.views.raster import barycentric, rasterize


def test_the_renderer_shows_the_nearer_triangle_and_not_the_back_of_one():
    def triangle(depth, mirrored=False):
        corners = [(1.0, 1.0, depth), (1.0, 15.0, depth), (15.0, 15.0, depth)]
        return corners[::-1] if mirrored else corners

    hits = rasterize(np.array([triangle(5.0), triangle(2.0), triangle(1.0, True)]), 16, 16)
    assert set(np.unique(hits.triangle)) == {-1, 1}
    assert (hits.triangle == 1).sum() == pytest.approx(0.5 * 14 * 14, rel=0.1)
    np.testing.assert_allclose(hits.depth[hits.triangle == 1], 2.0)
    assert np.all(np.isinf(hits.depth[hits.triangle < 0]))
    rows, columns = np.nonzero(hits.triangle == 1)
    shares = np.array([barycentric(hits.corners[1], x + 0.5, y + 0.5) for x, y in zip(columns, rows, strict=True)])
    shares = np.column_stack([shares, 1.0 - shares.sum(axis=1)])
    middle = shares @ np.array([(1.0, 1.0), (1.0, 15.0), (15.0, 15.0)])
    np.testing.assert_allclose(middle, np.column_stack([columns, rows]) + 0.5, atol=1e-5)


def test_triangles_that_share_an_edge_leave_no_gap_and_those_outside_are_clipped():
    a, b, c, d = (-30.0, -30.0, 1.0), (-30.0, 50.0, 1.0), (50.0, 50.0, 1.0), (50.0, -30.0, 1.0)
    far = np.array([(100.0, 100.0, 1.0), (100.0, 120.0, 1.0), (120.0, 120.0, 1.0)])
    hits = rasterize(np.array([[a, b, c], [a, c, d], far]), 20, 16)
    assert hits.triangle.shape == (16, 20) and set(np.unique(hits.triangle)) == {0, 1}


def test_the_distance_is_that_of_the_plane_seen_in_perspective():
    # A plane z = 2 + x, seen by an eye with 10 pixels for a slope of one: x = 10 X / Z, so 1 / Z = (1 - x / 10) / 2.
    corners = np.array([[(0.0, 0.0, 2.0), (0.0, 8.0, 2.0), (5.0, 0.0, 4.0)]])
    hits = rasterize(corners, 8, 8)
    rows, columns = np.nonzero(hits.filled)
    assert len(rows) > 10
    np.testing.assert_allclose(hits.depth[rows, columns], 2.0 / (1.0 - (columns + 0.5) / 10.0))


def test_both_sides_are_drawn_on_request_and_nothing_behind_the_eye():
    away = np.array([[(15.0, 15.0, 1.0), (1.0, 15.0, 1.0), (1.0, 1.0, 1.0)]])
    assert not rasterize(away, 16, 16).filled.any()
    assert rasterize(away, 16, 16, both_sides=True).filled.sum() > 50
    assert not rasterize(-away, 16, 16, both_sides=True).filled.any()
