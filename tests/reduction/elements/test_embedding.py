"""Points tied to a mesh."""

import numpy as np
import pytest
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.reduction.elements import embedding


@pytest.fixture(scope="module")
def mesh(helpers):
    points, tets = helpers.box((4, 3, 2), (0.4, 0.3, 0.2), origin=(-0.1, 0.2, 0))
    moved = points + 0.01 * np.random.default_rng(2).standard_normal(points.shape)
    return quadratic_mesh(moved, tets)


def inside(mesh, count=300, seed=3):
    rng = np.random.default_rng(seed)
    tets = mesh.tets[rng.integers(len(mesh.tets), size=count), :4]
    return np.einsum("kc,kci->ki", rng.dirichlet(np.ones(4), count), mesh.nodes[tets])


def quadratic(x):
    """A field that quadratic elements hold exactly, and half its curl."""
    X, Y, Z = x.T
    u = np.stack([X * Y + Z**2, X**2 - 3 * Y * Z, X * Z + 2 * Y**2 - X], axis=1)
    curl = np.stack([4 * Y + 3 * Y, 2 * Z - (Z - 1), 2 * X - X], axis=1)
    return u[:, :, None], 0.5 * curl[:, :, None]


@pytest.mark.parametrize("count", [300, 20_000])  # many points look for their elements in a tree
def test_a_quadratic_field_and_its_rotation_are_exact_inside(mesh, count):
    points = inside(mesh, count)
    tied = embedding.embed(mesh, points)
    u, rotation = quadratic(points)
    modes = quadratic(mesh.nodes)[0]
    assert np.abs(tied.displacements(modes) - u).max() < 1e-12
    assert np.abs(tied.rotations(modes) - rotation).max() < 1e-11
    assert np.abs(tied.arms).max() == 0.0


def test_a_rigid_motion_is_exact_everywhere_also_far_outside(mesh):
    points = np.random.default_rng(1).uniform(-2, 2, (400, 3))
    axis, shift = np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, 3.0])
    modes = (np.cross(axis, mesh.nodes) + shift)[:, :, None]
    tied = embedding.embed(mesh, points)
    assert np.abs(tied.displacements(modes)[:, :, 0] - (np.cross(axis, points) + shift)).max() < 1e-11
    assert np.abs(tied.rotations(modes)[:, :, 0] - axis).max() < 1e-11


def test_points_just_outside_move_like_the_surface_beside_them(mesh):
    surface = mesh.nodes[mesh.surface[:, :3]].mean(axis=1)
    a, b, c = (mesh.nodes[mesh.surface[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    modes = quadratic(mesh.nodes)[0]
    on = embedding.embed(mesh, surface - 1e-6 * normal).displacements(modes)
    off = embedding.embed(mesh, surface + 1e-6 * normal).displacements(modes)
    assert np.abs(on - off).max() < 1e-4
