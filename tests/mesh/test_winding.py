"""How often surfaces wind around the corners of a grid, against the solid angle."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.grids import wound
from calmotion.mesh.surfaces.closed_surfaces import winding_number

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
