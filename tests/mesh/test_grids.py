"""How often surfaces wind around the corners of a grid, against the solid angle."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.grids import CLOSED, closed_slits, wound
from calmotion.mesh.surfaces.closed_surfaces import boundary_walks, winding_number
from calmotion.mesh.tetrahedra import surface_volume

BALL = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
CAVITY = trimesh.creation.icosphere(subdivisions=2, radius=0.02)
CAVITY.invert()
SHELL = trimesh.util.concatenate([BALL, CAVITY])
TWICE = trimesh.util.concatenate([BALL, BALL.copy().apply_translation([0.03, 0.01, 0.0])])


def corners(low, counts, spacing):
    return low + spacing * np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("mesh", [BALL, SHELL, TWICE], ids=["ball", "shell", "twice"])
@pytest.mark.parametrize("low", [(-0.071, -0.069, -0.068), (-0.013, -0.012, 0.011)], ids=["around", "within"])
def test_it_is_that_of_the_solid_angle_wherever_the_grid_is(mesh, low):
    points, triangles = np.array(mesh.vertices), np.array(mesh.faces, np.int32)
    counts, spacing = (14, 12, 11), 0.0101 if low[0] < -0.05 else 0.004
    found = wound(points, triangles, np.array(low), np.array(counts), spacing)
    assert found.shape == counts
    exact = np.array([winding_number(at, points, triangles) for at in corners(np.array(low), counts, spacing)])
    exact = exact.reshape(counts)
    kept = slice(None, -1)  # the last corners along x take what is behind the grid
    assert np.array_equal(found[kept], np.rint(exact[kept]).astype(int)) and len(np.unique(found[kept])) > 1


H = 0.01
SIDE = 0.3


def closed(mesh, spacing=H):
    points, triangles = closed_slits(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64), spacing)
    assert boundary_walks(triangles) == []
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert len(np.unique(edges, axis=0)) == len(edges)  # each side of a triangle once, the other way in another one
    return points, triangles


def turned(mesh, angle=0.4):
    return mesh.apply_transform(trimesh.transformations.rotation_matrix(angle, (1.0, 2.0, -0.5)))


def cube_with(width):
    """A cube with a slit through its middle, four fifths of its height deep."""
    slit = trimesh.creation.box((width, 2.0 * SIDE, SIDE))
    slit.apply_translation((0.0, 0.0, SIDE / 5.0))
    return trimesh.creation.box((SIDE, SIDE, SIDE)).difference(slit)


def test_a_ball_keeps_its_surface():
    points, triangles = closed(trimesh.creation.icosphere(4, 0.1))
    radius = np.linalg.norm(points, axis=1)
    assert radius == pytest.approx(np.full(len(points), 0.1), abs=0.15 * H)
    # tetrahedra cut a depth that is curved between corners: by some H^2 / 8 R
    assert surface_volume(points, triangles) == pytest.approx(4.0 / 3.0 * np.pi * 0.1**3, rel=3.0 * H**2 / 0.1**2)


@pytest.mark.parametrize("angle", [0.0, 0.4])
@pytest.mark.parametrize("width", [1e-4, 0.5, 1.5, CLOSED - 0.05])
def test_slits_narrower_than_the_ball_are_closed(width, angle):
    points, triangles = closed(turned(cube_with(width * H), angle))
    assert surface_volume(points, triangles) == pytest.approx(SIDE**3, abs=12.0 * SIDE * H**2)


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_wider_ones_stay(angle):
    width = (CLOSED + 2.0) * H
    mesh = turned(cube_with(width), angle)
    points, triangles = closed(mesh)
    assert surface_volume(points, triangles) == pytest.approx(mesh.volume, abs=30.0 * SIDE * H**2)
    assert SIDE**3 - mesh.volume > 90.0 * SIDE * H**2


def test_flat_walls_stay_where_they_are_and_edges_lose_no_more_than_a_spacing():
    sides, at = np.array([0.3, 0.2, 0.1]), np.array([0.0123, -0.0456, 0.0789])
    box = trimesh.creation.box(sides)
    box.apply_translation(at)
    points, triangles = closed(box)
    out = np.sort(np.abs(points - at) - sides / 2, axis=1)  # of the farthest side last
    assert np.abs(out[:, 2]).max() < H
    away = out[:, 1] < -2.0 * H
    assert away.sum() > 5000 and out[away, 2] == pytest.approx(np.zeros(away.sum()), abs=1e-12)
    assert 0.0 < box.volume - surface_volume(points, triangles) < 0.2 * H**2 * 4.0 * sides.sum()


def test_parts_in_each_other_become_one():
    inner, outer = trimesh.creation.icosphere(4, 0.1), trimesh.creation.icosphere(4, 0.16)
    hole = trimesh.creation.icosphere(4, 0.1 + H)
    hole.invert()
    points, triangles = closed(trimesh.util.concatenate([inner, outer, hole]))
    assert surface_volume(points, triangles) == pytest.approx(outer.volume, rel=0.01)
    assert np.linalg.norm(points, axis=1).min() > 0.15
