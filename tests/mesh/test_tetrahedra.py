"""Linear tetrahedra."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh import tetrahedra as t

REGULAR = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


def test_a_regular_tetrahedron_has_its_known_volume_and_angle():
    tets, turned = t.oriented_tets(REGULAR, np.array([[0, 1, 2, 3]]))
    assert t.tet_volumes(REGULAR, tets) == pytest.approx([8.0 / 3.0])
    assert t.min_dihedral_deg(REGULAR, tets) == pytest.approx(np.degrees(np.arccos(1.0 / 3.0)))
    assert turned == 1 - int((t.tet_volumes(REGULAR, np.array([[0, 1, 2, 3]])) > 0)[0])


def test_inverted_tetrahedra_are_reoriented_and_counted(helpers):
    points, tets = helpers.box((2, 2, 2), (1, 2, 3))
    mixed = tets.copy()
    mixed[::3] = mixed[::3][:, [1, 0, 2, 3]]
    again, turned = t.oriented_tets(points, mixed)
    assert turned == len(mixed[::3])
    assert (t.tet_volumes(points, again) > 0.0).all()
    assert t.tet_volumes(points, again).sum() == pytest.approx(6.0, rel=1e-14)


def test_the_boundary_of_a_box_is_closed_outward_and_has_its_area(helpers):
    points, tets = helpers.box((3, 2, 2), (1, 2, 3), origin=(5, -7, 2))
    triangles = t.boundary_triangles(tets)
    assert t.surface_volume(points, triangles) == pytest.approx(6.0, rel=1e-13)
    assert t.surface_area(points, triangles) == pytest.approx(22.0, rel=1e-13)


def test_keys_of_edges_and_triangles_are_equal_where_their_corners_are():
    rng = np.random.default_rng(0)
    for k in (2, 3):
        rows = np.vstack([rng.integers(0, 5, (200, k)), t.MOST_POINTS - 1 - rng.integers(0, 5, (200, k))])
        shuffled = np.array([rng.permutation(row) for row in rows])
        keys = t.corner_keys(shuffled)
        assert (keys >= 0).all() and np.array_equal(keys, t.corner_keys(rows))
        ordered = np.sort(rows, axis=1)
        _, first = np.unique(ordered, axis=0, return_index=True)
        assert np.array_equal(np.unique(keys, return_index=True)[1], first)


def test_more_points_than_keys_have_room_for_are_refused():
    points = np.broadcast_to(0.0, (t.MOST_POINTS + 1, 3))
    with pytest.raises(ShotError, match=r"/A.points: .*too many points"):
        t.oriented_tets(points, np.array([[0, 1, 2, 3]]), "/A")


def test_parts_that_share_no_point_are_counted(helpers):
    points, tets = helpers.box((2, 2, 2), (1, 1, 1))
    assert t.connected_parts(tets) == 1
    assert t.connected_parts(np.vstack([tets, tets + len(points)])) == 2


def test_the_largest_part_is_that_of_the_largest_volume(helpers):
    points, tets = helpers.box((1, 1, 1), (1, 1, 1))
    more, smaller = helpers.box((3, 3, 3), (0.9, 0.9, 0.9))
    both = np.vstack([more, points + 5.0]), np.vstack([smaller, tets + len(more)])
    assert np.array_equal(t.largest_part(*both), tets + len(more))
    joined, welded, _ = t.welded_tets(
        np.vstack([points, points + [1.0, 1.0, 0.0]]), np.vstack([tets, tets + len(points)]), 1e-9
    )
    assert t.connected_parts(welded) == 1  # by an edge, which is a hinge
    assert len(t.largest_part(joined, welded)) == len(tets)


def test_points_in_one_place_become_one(helpers):
    points, tets = helpers.box((1, 1, 1), (1, 1, 1))
    doubled = np.vstack([points, points + [1.0 + 1e-9, 0.0, 0.0]])
    welded, joined, merged = t.welded_tets(doubled, np.vstack([tets, tets + len(points)]), 1e-6)
    assert merged == 4 and len(welded) == 12 and t.connected_parts(joined) == 1
    assert t.tet_volumes(welded, joined).sum() == pytest.approx(2.0, rel=1e-8)
    assert t.welded_tets(doubled, np.vstack([tets, tets + len(points)]), 1e-12)[2] == 0


def test_points_without_an_element_are_dropped(helpers):
    points, tets = helpers.box((1, 1, 1), (1, 1, 1))
    loose = np.vstack([[[9.0, 9, 9]], points])
    kept, renumbered = t.without_unused_points(loose, tets + 1)
    assert np.array_equal(kept, points) and np.array_equal(renumbered, tets)


@pytest.mark.parametrize(
    ("points", "tets", "found"),
    [
        (REGULAR, np.zeros((0, 4), int), "0"),
        (REGULAR, [[0, 1, 2, 4]], "4"),
        (np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), [[0, 1, 2, 3]], "element 0"),
    ],
)
def test_elements_that_do_not_exist_are_refused_with_their_place(points, tets, found):
    with pytest.raises(ShotError) as caught:
        t.oriented_tets(points, tets, "/Arm/Tets")
    assert caught.value.path == "/Arm/Tets" and found in str(caught.value.found)


def test_the_volume_error_is_relative_to_the_surface(helpers):
    points, tets = helpers.box((1, 1, 1), (1, 1, 1))
    assert t.measure_quality(points, tets, surface_volume=1.25).volume_error == pytest.approx(0.2)
    assert t.measure_quality(points, tets).volume_error == 0.0


CORNER = np.array(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.2, 0.2], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], float
)


def neighbours(*tets):
    return t.refuse_bad_neighbours(t.oriented_tets(CORNER, np.array(tets))[0], "/Body/Tets")


def test_neighbours_on_both_sides_of_a_face_are_a_body():
    neighbours((0, 1, 2, 3))
    neighbours((0, 1, 2, 3), (0, 1, 2, 7))
    neighbours((0, 1, 2, 3), (0, 1, 2, 7), (0, 1, 3, 6), (3, 2, 0, 5))


@pytest.mark.parametrize("second", [(0, 1, 2, 3), (1, 0, 2, 3), (3, 2, 1, 0), (0, 1, 2, 4)])
def test_tetrahedra_that_fill_the_same_place_are_refused(second):
    with pytest.raises(ShotError, match="fill the same place") as error:
        neighbours((0, 1, 2, 3), (0, 1, 3, 6), second)
    assert error.value.path == "/Body/Tets" and error.value.remedy


@pytest.mark.parametrize("second", [(0, 5, 6, 7), (0, 1, 6, 7)])
def test_tetrahedra_that_share_no_face_are_refused(second):
    with pytest.raises(ShotError, match="points or edges"):
        neighbours((0, 1, 2, 3), second)
