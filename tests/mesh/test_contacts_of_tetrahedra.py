"""Contacts in points and edges hold nothing, and faces everything."""

from itertools import product

import numpy as np
import pytest
from calmotion.mesh import tetrahedra as t
from calmotion.mesh.tetrahedra import without_contacts


def joined(helpers, *places):
    """Unit cubes at places, with the points that they have in common."""
    points, tets = helpers.box((1, 1, 1), (1, 1, 1))
    stacked = np.vstack([points + np.asarray(place, float) for place in places])
    return t.welded_tets(stacked, np.vstack([tets + k * len(points) for k in range(len(places))]), 1e-9)[:2]


def test_a_mesh_whose_neighbours_share_faces_stays_as_it_is(helpers):
    points, tets = joined(helpers, *product((0, 1), (0, 1), (0, 1)))
    same, also = without_contacts(points, tets)
    assert same is points and also is tets


@pytest.mark.parametrize(("place", "doubled"), [((1, 1, 0), 2), ((1, 1, 1), 1)], ids=["edge", "point"])
def test_cubes_that_touch_come_apart(helpers, place, doubled):
    points, tets = joined(helpers, (0, 0, 0), place)
    assert t.connected_parts(tets) == 1
    apart, parted = without_contacts(points, tets)
    assert len(apart) == len(points) + doubled and t.connected_parts(parted) == 2
    assert len(np.unique(apart, axis=0)) == len(apart)  # two points in one place cannot be told apart
    volumes = t.tet_volumes(points, tets)
    assert t.tet_volumes(apart, parted) == pytest.approx(volumes, rel=0.2)
    assert (t.tet_volumes(apart, parted) >= 0.5 * volumes).all()


def test_each_element_keeps_its_corners(helpers):
    rng = np.random.default_rng(3)
    cells = np.argwhere(rng.random((4, 4, 4)) < 0.5)
    points, tets = joined(helpers, *cells)
    apart, parted = without_contacts(points, tets)
    assert len(apart) > len(points) and parted.dtype == tets.dtype
    assert np.linalg.norm(apart[parted] - points[tets], axis=-1).max() < 0.05
    # every point is one of elements that hang together by faces at it
    again, same = without_contacts(apart, parted)
    assert again is apart and same is parted
