"""The skin of a printed part: its volume, and where it is."""

import numpy as np
import pytest
from calmotion.mesh.mass import mass_of_tets
from calmotion.mesh.parts import makeup_of, skin_share
from calmotion.mesh.tetrahedra import tet_volumes
from calmotion.model.character import ElasticMaterial
from calmotion.model.meshes import Core

SIZE = np.array([0.2, 0.02, 0.03])


@pytest.mark.parametrize("counts", [(8, 1, 1), (20, 2, 3), (40, 4, 6)])
@pytest.mark.parametrize("skin", [0.9e-3, 2e-3])
def test_the_skin_of_a_box_has_its_volume_on_any_mesh(helpers, counts, skin):
    points, tets = helpers.box(counts, tuple(SIZE))
    share = skin_share(np.asarray(points), tets, Core(skin, 0.2, 0.1))
    found = tet_volumes(points, tets) @ (0.2 + 0.8 * share.shares.mean(axis=1))
    inner = float(np.prod(SIZE - 2.0 * skin))
    assert found == pytest.approx(float(np.prod(SIZE)) - 0.8 * inner, rel=0.01)


def test_places_are_in_the_tetrahedron_and_mean_its_center(helpers):
    points, tets = helpers.box((2, 1, 1), tuple(SIZE))
    places = skin_share(np.asarray(points), tets, Core(1e-3, 0.2, 0.1)).places
    assert places.min() > 0.0 and places.sum(axis=1) == pytest.approx(1.0)
    assert places.mean(axis=0) == pytest.approx(0.25, abs=1e-12)


def test_a_skin_that_is_thicker_than_the_body_is_all_of_it(helpers):
    points, tets = helpers.box((8, 1, 1), tuple(SIZE))
    assert skin_share(np.asarray(points), tets, Core(0.02, 0.2, 0.1)).shares == pytest.approx(1.0)


def test_the_mass_of_a_print_is_less_and_its_moments_are_larger_for_it(helpers):
    points, tets = helpers.box((20, 2, 3), tuple(SIZE))
    points = np.asarray(points)
    solid = mass_of_tets(points, tets, 1000.0)
    makeup = makeup_of(points, tets, ElasticMaterial("/PLA", 2e9, 0.3, 1000.0, core=Core(1e-3, 0.2, 0.1)))
    printed = mass_of_tets(points, tets, 1000.0, makeup=makeup)
    assert 0.2 * solid.mass < printed.mass < 0.6 * solid.mass
    assert printed.center == pytest.approx(solid.center, abs=2e-4)
    assert printed.inertia[0, 0] / printed.mass > 1.1 * solid.inertia[0, 0] / solid.mass
    assert mass_of_tets(points, tets, 1000.0, 0.05, makeup).mass == pytest.approx(0.05)
