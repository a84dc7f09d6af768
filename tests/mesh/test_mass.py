"""Mass properties of tetrahedra and of closed surfaces, against those of boxes."""

import numpy as np
import pytest
from calmotion.mesh.mass import mass_of_solid, mass_of_tets
from calmotion.mesh.tetrahedra import boundary_triangles


def test_a_box_has_the_mass_properties_of_a_box(helpers):
    size, origin = np.array([0.3, 0.2, 0.1]), np.array([1.0, -2.0, 0.5])
    points, tets = helpers.box((2, 3, 1), size, origin)
    mass = mass_of_tets(points, tets, 1000.0)
    assert mass.mass == pytest.approx(6.0)
    assert np.allclose(mass.center, origin + size / 2)
    squares = size**2
    assert np.allclose(mass.inertia, np.diag(6.0 / 12.0 * (squares.sum() - squares)), rtol=0, atol=1e-12)
    scaled = mass_of_tets(points, tets[:, [1, 0, 2, 3]], 1000.0, 3.0)
    assert scaled.mass == pytest.approx(3.0) and np.allclose(scaled.inertia, 0.5 * mass.inertia)


def test_a_surface_weighs_what_it_encloses(helpers):
    place = np.array([3.0, -5.0, 7.0])
    outer, inner = (helpers.box((3, 2, 1), np.array(size), place + at) for size, at in (
        ([0.3, 0.04, 0.04], 0.0), ([0.2, 0.02, 0.02], 0.01)))  # fmt: skip
    (points, tets), (hole, hollow) = outer, inner
    whole, hole_tets = mass_of_tets(points, tets, 1200.0), mass_of_tets(hole, hollow, 1200.0)
    surface = np.vstack([boundary_triangles(tets), boundary_triangles(hollow)[:, ::-1] + len(points)])
    found = mass_of_solid(np.vstack([points, hole]), surface, 1200.0)
    total = whole.mass - hole_tets.mass
    assert found.mass == pytest.approx(total)
    assert np.allclose(found.center, (whole.mass * whole.center - hole_tets.mass * hole_tets.center) / total)
    same = mass_of_solid(points, boundary_triangles(tets), 1200.0, 2.0)
    assert np.allclose(same.inertia, whole.inertia * 2.0 / whole.mass, rtol=0, atol=1e-9)
