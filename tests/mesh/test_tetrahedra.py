"""Linear tetrahedra."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh import tetrahedra as t
from calmotion.mesh.bisection import bisected
from calmotion.mesh.mass import mass_of_solid, mass_of_tets
from calmotion.mesh.mesh_shaping import Surface, fitted, shaped
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import (
    boundary_triangles,
    measure_quality,
    min_dihedral_deg,
    surface_area,
    surface_volume,
    tet_volumes,
    without_contacts,
)
from calmotion.model import Body, FEMesh, FlexibleSettings
from round_bars import LENGTH, RADIUS, bar_surface, coarse_bar

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


@pytest.mark.parametrize("seed", [0, 1])
def test_the_solid_stays_and_marked_tetrahedra_become_smaller(helpers, seed):
    points, tets = helpers.box((6, 2, 2), (0.3, 0.1, 0.1))
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    marked = np.random.default_rng(seed).choice(len(tets), 10, replace=False)
    new, split, parents = bisected(points, tets, marked)
    assert np.array_equal(new[: len(points)], points) and len(split) > len(tets)
    volumes = tet_volumes(new, split)
    assert (volumes > 0.0).all() and volumes.sum() == pytest.approx(0.3 * 0.1 * 0.1)
    assert np.bincount(parents, volumes) == pytest.approx(tet_volumes(points, tets)), "parts fill what they are part of"
    # hanging nodes would make inner faces count as boundary
    assert surface_area(new, boundary_triangles(split)) == pytest.approx(2 * (2 * 0.3 * 0.1 + 0.1 * 0.1))
    kept = {tuple(sorted(tet)) for tet in split.tolist()}
    assert not any(tuple(sorted(tets[k].tolist())) in kept for k in marked)


def test_repeated_bisection_at_one_place_keeps_angles(helpers):
    points, tets = helpers.box((4, 2, 2), (0.2, 0.1, 0.1))
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    before = min_dihedral_deg(points, tets)
    for _ in range(6):
        near = np.linalg.norm(points[tets].mean(axis=1), axis=1)
        points, tets, _ = bisected(points, tets, np.argsort(near)[:8])
    assert min_dihedral_deg(points, tets) > 0.3 * before


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


SIZE = (0.2, 0.02, 0.02)


@pytest.fixture
def mesh(helpers):
    """A bar, dented by a twentieth of a millimetre along its edges."""
    points, tets = helpers.box((10, 2, 2), SIZE)
    points = np.asarray(points).copy()
    edge = (np.abs(points[:, 1:] - 0.01) > 0.009).all(axis=1)
    points[edge, 1:] += 5e-5 * np.sign(0.01 - points[edge, 1:])
    return FEMesh(0, points, tets, replace(measure_quality(points, tets), source="surface", frequency_error=0.01))


def surface_of(helpers, volume):
    corners, bricks = helpers.box((1, 1, 1), SIZE)
    return Surface(np.asarray(corners), boundary_triangles(bricks), volume, 1e-3)


def test_a_dented_mesh_gets_its_volume_and_its_patch(helpers, mesh, plastic):
    body = Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic, interface_radius=0.016))
    frames = [AttachmentFrame("/Arm/root", helpers.frame(0.01, 0.01, 0.01), "interface")]
    volume = float(np.prod(SIZE))
    found = shaped(mesh, body, surface_of(helpers, volume), frames)
    assert mesh.quality.volume < 0.999 * volume and found.quality.volume_error < 1e-4
    assert found.quality.source == "surface" and found.quality.frequency_error == 0.01
    (patch,) = found.patches
    assert np.array_equal(patch.origin, frames[0].frame.position)
    corners = {tuple(point) for point in found.points}
    assert all(tuple(point) in corners for point in patch.triangles.reshape(-1, 3))


def test_a_surface_whose_volume_is_not_that_of_the_elements_is_not_fitted(helpers, mesh, plastic):
    body = Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))
    found = shaped(mesh, body, surface_of(helpers, 0.9 * float(np.prod(SIZE))), ())
    assert np.array_equal(found.points, mesh.points) and found.patches == ()


def test_a_mesh_that_has_the_volume_by_chance_is_fitted(helpers, mesh, plastic):
    """Dents and bumps may make up for each other: volume alone does not tell that a mesh follows its surface."""
    body = Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))
    found = shaped(mesh, body, surface_of(helpers, 1.001 * mesh.quality.volume), ())
    assert found.quality.volume_error > 3e-3 and not np.array_equal(found.points, mesh.points)
    assert found.quality.volume == pytest.approx(np.prod(SIZE), rel=1e-4)


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
