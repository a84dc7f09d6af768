"""Normals for drawing: one for each smooth side of a point."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic
from calmotion.views.raster import split_at_creases


def test_a_box_has_three_normals_at_each_corner_and_keeps_its_shape():
    points, triangles = synthetic.box((0, 0, 0), (1, 2, 3))
    sources, split, normals = split_at_creases(points, triangles)
    assert np.bincount(sources).tolist() == [3] * 8
    assert np.array_equal(sources[split], triangles)
    faces = np.cross(*(points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2)))
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    for corner in range(3):
        np.testing.assert_allclose(normals[split[:, corner]], faces, atol=1e-12)


def test_a_round_tube_stays_smooth_around_and_sharp_at_its_end():
    count = 24
    angle = 2.0 * np.pi * np.arange(count) / count
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.vstack([np.column_stack([ring, np.full(count, z)]) for z in (0.0, 1.0)] + [[0.0, 0.0, 1.0]])
    triangles = []
    for k in range(count):
        after = (k + 1) % count
        triangles += [(k, after, count + after), (k, count + after, count + k), (2 * count, count + k, count + after)]
    sources, _, normals = split_at_creases(points, np.array(triangles, dtype=np.int32))
    assert np.bincount(sources).tolist() == [1] * count + [2] * count + [1]
    side = normals[sources < count]
    np.testing.assert_allclose(side[:, :2], points[sources[sources < count]][:, :2], atol=0.1)
    assert np.abs(side[:, 2]).max() == pytest.approx(0.0)
