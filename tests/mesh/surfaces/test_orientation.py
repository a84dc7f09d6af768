"""Which side of a surface is out."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.mesh.surfaces.orientation import closing_signs, patch_boundaries, patches_of
from calmotion.mesh.tetrahedra import boundary_triangles, surface_volume


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
