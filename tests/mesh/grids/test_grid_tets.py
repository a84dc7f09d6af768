"""Tetrahedra of a grid fill what a surface winds around, in one piece, with good angles."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.grids import grid_tets as grid_tets_module
from calmotion.mesh.grids.grid_tets import grid_tets
from calmotion.mesh.tetrahedra import boundary_triangles, connected_parts, min_dihedral_deg, tet_volumes


def made(mesh, spacing):
    return grid_tets(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int32), spacing)


def edges(tets):
    """Edges of the boundary, and how many triangles each has."""
    sides = np.sort(boundary_triangles(tets)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.unique(sides, axis=0, return_counts=True)


def tube():
    return trimesh.creation.annulus(r_min=0.02, r_max=0.03, height=0.1, sections=64)


@pytest.mark.parametrize(
    ("mesh", "spacing"),
    [
        (trimesh.creation.icosphere(subdivisions=4, radius=0.05), 0.012),
        (trimesh.creation.box((0.1, 0.04, 0.03)), 0.007),
        (tube(), 0.005),
    ],
    ids=["ball", "box", "tube"],
)
def test_they_fill_the_surface_and_converge_to_it(mesh, spacing):
    errors = []
    for size in (spacing, 0.5 * spacing):
        points, tets = made(mesh, size)
        volume = tet_volumes(points, tets)
        assert volume.min() > 0.0 and min_dihedral_deg(points, tets) > 4.0 and connected_parts(tets) == 1
        errors.append(abs(volume.sum() / mesh.volume - 1.0))
        # a closed surface of triangles with two neighbours at each edge
        assert (edges(tets)[1] % 2 == 0).all()
    assert errors[0] < 0.05 and errors[1] < 0.5 * errors[0] + 1e-4


def test_parts_that_overlap_are_one_and_what_is_separate_is_left_out():
    two = trimesh.util.concatenate(
        [trimesh.creation.box((0.1, 0.03, 0.03)), trimesh.creation.box((0.03, 0.1, 0.03)),
         trimesh.creation.box((0.01, 0.01, 0.01)).apply_translation((0.1, 0.0, 0.0))]
    )  # fmt: skip
    points, tets = made(two, 0.003)
    assert tet_volumes(points, tets).sum() == pytest.approx(2 * 9e-5 - 2.7e-5, rel=0.05)
    assert points[:, 0].max() < 0.06


def test_arms_of_a_fork_do_not_touch_along_edges(monkeypatch):
    """Two millimetres apart, they are as near as the corners of a grid of 6 mm."""
    arm = trimesh.creation.box((0.1, 0.02, 0.02))
    base = trimesh.creation.box((0.02, 0.06, 0.06)).apply_translation([-0.05, 0.01, 0.01])
    fork = trimesh.util.concatenate([arm, arm.copy().apply_translation([0.0, 0.022, 0.022]), base])

    def contacts_beyond_the_base():
        points, tets = made(fork, 0.006)
        ends, count = edges(tets)
        return int((points[ends[count != 2]].mean(axis=1)[:, 0] > -0.035).sum())

    assert contacts_beyond_the_base() == 0
    monkeypatch.setattr(grid_tets_module, "without_contacts", lambda points, tets, *surface: (points, tets))
    assert contacts_beyond_the_base() > 0


def test_a_grid_that_does_not_resolve_the_surface_is_refused():
    with pytest.raises(ValueError, match="no corner inside"):
        made(trimesh.creation.box((1.0, 1.0, 1e-3)).apply_translation((0.0, 0.0, 0.1)), 0.3)
