"""Mass properties of tetrahedra."""

import numpy as np
import pytest
from calmotion.mesh.parts.mesh_mass import mass_of_tets


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
