"""Tetrahedra whose boundary is fitted to a surface: a round bar has its section, a box stays as it is."""

import numpy as np
import pytest
from calmotion.mesh.mesh_shaping import fitted
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import surface_volume, tet_volumes
from round_bars import LENGTH, RADIUS, bar_surface, coarse_bar


def second_moment(points, tets):
    """Integral of z^2 over the tetrahedra."""
    z = points[tets][:, :, 2]
    return float((tet_volumes(points, tets) / 20.0 * ((z**2).sum(axis=1) + z.sum(axis=1) ** 2)).sum())


def test_a_coarse_round_bar_has_the_volume_and_the_second_moment_of_a_fine_one(helpers):
    surface, (points, tets) = bar_surface(), coarse_bar(helpers)
    volume, moment = surface_volume(*surface), 0.25 * np.pi * RADIUS**4 * LENGTH
    assert tet_volumes(points, tets).sum() < 0.97 * volume and second_moment(points, tets) < 0.94 * moment
    found = fitted(points, tets, NearbyTriangles(*surface, 0.2 * RADIUS))
    assert tet_volumes(found, tets).min() > 0.0
    assert tet_volumes(found, tets).sum() == pytest.approx(volume, rel=2e-3)
    assert second_moment(found, tets) == pytest.approx(moment, rel=5e-3)
