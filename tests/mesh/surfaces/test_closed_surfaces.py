"""Surfaces as chains of triangles."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.surfaces.closed_surfaces import (
    boundary_walks,
    close,
    enclosed_volume,
    winding_number,
    winding_numbers,
)
from calmotion.mesh.surfaces.orientation import closing_signs, patch_boundaries, patches_of
from calmotion.mesh.surfaces.slits import slit_fillings
from calmotion.mesh.tetrahedra import boundary_triangles, surface_volume


@pytest.fixture
def box(helpers):
    points, tets = helpers.box((4, 4, 4), (1.0, 1.0, 1.0))
    return points, boundary_triangles(tets)


def test_a_closed_surface_has_no_boundary(box):
    assert boundary_walks(box[1]) == []
    assert len(close(*box).areas) == 0


@pytest.mark.parametrize("missing", [1, 2, 5, 32])
def test_holes_are_closed_and_the_volume_comes_back(box, missing):
    points, triangles = box
    top = np.flatnonzero((points[triangles][:, :, 2] > 1 - 1e-9).all(axis=1))
    order = np.argsort(points[triangles[top]].mean(axis=1) @ [1.0, 10.0, 0.0])
    closure = close(points, np.delete(triangles, top[order[:missing]], axis=0))
    assert boundary_walks(closure.triangles) == []
    # the holes are flat, so their caps lie in them
    assert surface_volume(closure.points, closure.triangles) == pytest.approx(1.0, rel=1e-12)
    assert closure.areas.sum() == pytest.approx(missing / 32.0, rel=0.5)
    assert len(closure.sides) == len(closure.areas) and (missing > 1 or closure.sides.tolist() == [3])


def test_two_holes_that_touch_at_a_corner_are_closed_apart(box):
    points, triangles = box
    corner = int(np.flatnonzero(np.linalg.norm(points - [0.5, 0.5, 1.0], axis=1) < 1e-9)[0])
    touching = np.flatnonzero((triangles == corner).any(axis=1))
    first = touching[0]
    apart = [t for t in touching if len(np.intersect1d(triangles[t], triangles[first])) == 1]
    closure = close(points, np.delete(triangles, [first, apart[0]], axis=0))
    assert len(closure.areas) == 2
    assert surface_volume(closure.points, closure.triangles) == pytest.approx(1.0, rel=1e-12)


def test_the_winding_number_distinguishes_inside_outside_and_twice_inside(box):
    points, triangles = box
    assert winding_number(np.array([0.4, 0.5, 0.6]), points, triangles) == pytest.approx(1.0)
    assert winding_number(np.array([1.4, 0.5, 0.6]), points, triangles) == pytest.approx(0.0, abs=1e-12)
    double = np.vstack([triangles, triangles + len(points)])
    assert winding_number(np.array([0.4, 0.5, 0.6]), np.vstack([points, points + 0.1]), double) == pytest.approx(2.0)


@pytest.mark.parametrize("bent", [0.0, 0.3])
def test_many_winding_numbers_of_a_large_surface_are_those_of_each_place(bent):
    """A torus with ripples, at places just below and above its surface, far from it and in its hole."""
    u, v = np.meshgrid(np.arange(300) * 2 * np.pi / 300, np.arange(100) * 2 * np.pi / 100, indexing="ij")

    def places_at(radius, u, v):
        around = 1.0 + radius * (1.0 + bent * np.sin(20 * u) * np.cos(3 * v)) * np.cos(v)
        return np.stack([around * np.cos(u), around * np.sin(u), radius * np.sin(v)], axis=-1).reshape(-1, 3)

    k = np.arange(30_000).reshape(300, 100)
    right, up = np.roll(k, -1, 0), np.roll(k, -1, 1)
    both = np.roll(right, -1, 1)
    triangles = np.concatenate([np.stack([k, right, up], -1), np.stack([up, right, both], -1)]).reshape(-1, 3)
    points = places_at(0.2, u, v)
    chosen = np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, (2, 30))
    places = np.vstack(
        [places_at(radius, *chosen) for radius in (0.05, 0.199, 0.201, 0.5)] + [np.eye(3), np.zeros((1, 3))]
    )
    found = winding_numbers(places, points, triangles)
    assert len(triangles) == 60_000
    assert np.abs(found - [winding_number(place, points, triangles) for place in places]).max() < 0.02
    assert found[:60] == pytest.approx(1.0, abs=0.03) and found[60:90] == pytest.approx(0.0, abs=0.03)


def test_the_volume_of_a_surface_through_itself_is_what_it_winds_around(box):
    """Two boxes that overlap."""
    points, triangles = box
    both = np.vstack([points, points + [0.75, 0.5, 0.5]])
    faces = np.vstack([triangles, triangles + len(points)])
    side = np.ptp(points, axis=0)
    expected = 2.0 * np.prod(side) - np.prod(np.maximum(side - [0.75, 0.5, 0.5], 0.0))
    assert enclosed_volume(both, faces) == pytest.approx(expected, rel=5e-3)


@pytest.fixture
def cube(helpers):
    points, tets = helpers.box((3, 3, 3), (1.0, 1.0, 1.0))
    return points, boundary_triangles(tets)


def ones(triangles):
    return np.ones(len(triangles))


@pytest.mark.parametrize("share", [3, 4, 10])
def test_flipped_triangles_are_found_and_the_majority_keeps_its_orientation(cube, share):
    points, triangles = cube
    mixed = triangles.copy()
    mixed[::share] = mixed[::share][:, ::-1]
    patches = patches_of(mixed, ones(mixed))
    assert patches.count == 1 and len(patches.one_sided) == 0
    assert np.array_equal(np.flatnonzero(patches.flip), np.arange(0, len(mixed), share))


def test_patches_end_at_edges_of_more_than_two_triangles_and_are_reoriented_as_a_whole(cube):
    points, triangles = cube
    # two cubes that share the wall between them; the second is inside out
    beside = triangles[:, ::-1] + len(points)
    number = np.arange(2 * len(points))
    for k, point in enumerate(points):
        same = np.flatnonzero(np.linalg.norm(points + [1.0, 0, 0] - point, axis=1) < 1e-9)
        number[len(points) + same] = k
    both = number[np.vstack([triangles, beside])]
    single = np.unique(np.sort(both, axis=1), axis=0, return_index=True)[1]
    both = both[np.sort(single)]
    places = np.vstack([points, points + [1.0, 0, 0]])
    patches = patches_of(both, ones(both))
    assert patches.count == 3
    boundaries = patch_boundaries(both, patches.label, patches.count)
    signs = closing_signs(boundaries)
    # whatever the wall does, no turning of whole patches makes fewer edges open than its own
    assert np.count_nonzero((boundaries * signs).sum(axis=1)) == 12
    rows = np.abs(boundaries[:, 0]) > 0.0
    assert np.array_equal(rows, np.abs(boundaries[:, 1]) > 0.0) and rows.all()
    wall = (np.abs(places[both][:, :, 0] - 1.0) < 1e-9).all(axis=1)
    # without the wall the other two close, one of them turned
    (label,) = np.unique(patches.label[wall])
    outer = [k for k in range(3) if k != label]
    pair = closing_signs(boundaries[:, outer])
    turned = np.where(
        pair[np.searchsorted(outer, patches.label[~wall])][:, None] < 0, both[~wall][:, ::-1], both[~wall]
    )
    assert abs(surface_volume(places, turned)) == pytest.approx(2.0, rel=1e-12)


def blocks(gap, tilt=0.0, side=1.0):
    """Two cubes, one above the other, with divided faces."""
    low, high = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((side, side, 1))
    high.apply_transform(trimesh.transformations.rotation_matrix(tilt, (0, 1, 0)))
    high.apply_translation((0.0, 0.0, 0.5 - high.bounds[0, 2] + gap))
    return trimesh.util.concatenate([low, high]).subdivide().subdivide().subdivide()


def fillings(mesh, widest=0.01, sink=1e-3, beside=0.0, least=0.0):
    made = slit_fillings(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64), widest, sink, beside, least)
    return [(trimesh.Trimesh(f.points, f.triangles, process=False), f.width) for f in made]


@pytest.mark.parametrize("gap", [0.0, 1e-9, 5e-3])
def test_both_sides_of_a_slit_get_a_closed_body_that_reaches_into_both(gap):
    made = fillings(blocks(gap))
    assert len(made) == 2
    for body, width in made:
        assert body.is_watertight and width == pytest.approx(gap, abs=1e-12)
        assert body.volume == pytest.approx(gap + 2e-3, rel=1e-9)
        assert body.bounds == pytest.approx(np.array([[-0.5, -0.5, 0.499], [0.5, 0.5, 0.501 + gap]]), abs=1e-12)


def test_a_filling_reaches_beyond_its_side_on_all_edges():
    for body, _ in fillings(blocks(5e-3), beside=0.02):
        assert body.is_watertight
        assert body.bounds[1, :2] == pytest.approx([0.5 + 0.02, 0.5 + 0.02], abs=0.3 * 0.02)
        assert body.volume == pytest.approx((1.0 + 4 * 0.02) * 7e-3, rel=1e-2)
