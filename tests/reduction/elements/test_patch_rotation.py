"""Patches that turn without changing their shape."""

import numpy as np
import pytest
from boxes import box_tets, hollow_shaft
from calmotion.model import FlexibleSettings
from calmotion.reduction.basis.craig_bampton import reduced_basis
from calmotion.reduction.basis.fixed_interface import FixedInterface
from calmotion.reduction.basis.modal_derivatives import Support, extended_basis
from calmotion.reduction.elements import patch_rotation
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.patch_rotation import shape_changes, spring_rows, springs, square_fields, squares
from scipy.spatial.transform import Rotation

ENTRIES = ((0, 1, 2, 1, 0, 0), (0, 1, 2, 2, 2, 1))


def test_squares_are_the_second_order_of_a_rotation():
    rng = np.random.default_rng(0)
    arms, turn = rng.normal(size=(5, 3)), 1e-3 * rng.normal(size=3)
    second = Rotation.from_rotvec(turn).apply(arms) - arms - np.cross(turn, arms)
    expected = 0.5 * square_fields(arms) @ squares(turn[None, :, None])[0, :, 0]
    assert np.allclose(second, expected, rtol=0, atol=2e-3 * np.abs(second).max())


def test_springs_of_a_plane_patch_resist_what_the_nodes_move():
    rng = np.random.default_rng(2)
    nodes = 0.01 * rng.normal(size=(12, 3))
    nodes[:, 2] = 0.0
    patch = np.array([1, 4, 5, 7, 9, 10])
    root = springs(nodes, [patch], 2e9)[0]
    strain = rng.normal(size=(3, 3))
    strain += strain.T
    arms = nodes[patch] - nodes[patch].mean(axis=0)
    squared = np.sum(arms**2, axis=1)
    products = np.einsum("ai,ij,bj->ab", arms, strain, arms)  # X^T E Y of all pairs of points
    expected = patch_rotation.STIFF * 2e9 * squared.max() ** 1.5 * np.sum(products**2) / squared.sum() ** 2
    assert np.sum((root @ strain[ENTRIES]) ** 2) == pytest.approx(expected, rel=1e-10)


def test_where_the_center_of_a_patch_is_does_not_change_its_shape():
    arms = np.random.default_rng(6).normal(size=(40, 3))
    own, moved = shape_changes(arms), shape_changes(arms + [8.0, -3.0, 1.0])
    assert own.shape == moved.shape == (6, 6)
    arms[:, 2] *= 0.01
    own, moved = shape_changes(arms), shape_changes(arms + [8.0, -3.0, 1.0])
    assert own.shape == moved.shape == (6, 3)
    assert np.allclose(own @ own.T, moved @ moved.T, atol=1e-9)


def test_springs_are_stretched_by_the_green_strain_of_a_patch():
    rng = np.random.default_rng(3)
    roots, held, rotation, u = (rng.normal(size=shape) for shape in ((2, 6, 6), (2, 6, 4), (2, 3, 4), 4))
    first, second = np.triu_indices(4)
    z = np.concatenate([u, u[first] * u[second]])
    expected = []
    for root, S, turn in zip(roots, held @ u, rotation @ u, strict=True):
        F = np.eye(3) + square_fields(np.eye(3)).swapaxes(0, 1) @ S + np.cross(turn, np.eye(3)).T
        expected.append(root @ (0.5 * (F.T @ F - np.eye(3)))[ENTRIES])
    assert np.allclose(spring_rows(roots, held, rotation) @ z, np.concatenate(expected), rtol=1e-12)


def test_springs_let_a_patch_rotate_by_any_angle():
    """In coordinates of sin(a) n and of the second order, as `dynamics.finite_rotation` has them."""
    turn = Rotation.from_rotvec([0.5, -0.3, 0.7]).as_matrix()
    axial = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    even = 0.5 * (turn + turn.T) - np.eye(3)
    S = (even - 0.5 * np.trace(even) * np.eye(3))[ENTRIES]
    rows = spring_rows(np.eye(6)[None], np.eye(6, 9)[None], np.eye(3, 9, 6)[None])
    u = np.concatenate([S, axial])
    first, second = np.triu_indices(9)
    assert np.abs(rows @ np.concatenate([u, u[first] * u[second]])).max() < 1e-14


def excess_of(model, support, plastic):
    """By how much a reduction with six derivatives of modes is softer than the mesh with rigid patches, at most."""
    settings = FlexibleSettings(plastic)
    basis = reduced_basis(model, support.root, support.patches, support.centers, settings)
    longer = extended_basis(model, support, basis, 6, plastic, "stvk")
    response = (longer.patch_motion[0] / longer.omega_squared) @ longer.patch_motion[0].T
    constraint = FixedInterface.of(model, support.root, support.patches, support.centers).constraint
    exact = np.linalg.inv(constraint.T @ (model.stiffness @ constraint))
    scale = np.sqrt(np.diag(exact))
    return np.linalg.eigvalsh((response - exact) / np.outer(scale, scale)).max()


def test_a_link_is_not_softer_for_the_derivatives_of_its_modes(plastic):
    """A reduction is never softer than the mesh with rigid patches."""
    points, tets = box_tets((6, 3, 3), (0.12, 0.04, 0.04), (0.0, -0.02, -0.02))
    model = assemble(points, tets, plastic)
    x, tip = model.mesh.nodes[:, 0], np.array([0.12, 0.0, 0.0])
    support = Support(np.flatnonzero(x < 1e-9), [np.flatnonzero(x > 0.12 - 1e-9)], [tip])
    assert excess_of(model, support, plastic) < 2e-3


def on_faces(mesh, held):
    """Nodes of the faces whose corners are all held."""
    return np.unique(mesh.surface[held[mesh.surface[:, :3]].all(axis=1)])


@pytest.mark.parametrize("curvature", [2.0, 12.0, 24.0, -16.0])
def test_a_curved_seat_on_a_casting_is_not_softer_either(plastic, curvature):
    """Its ground is soft beside it: springs that hold it less let it tilt by more than its joint turns.

    The springs of plane patches, which hardly hold the shear of its normal, would make it several times softer.
    """
    points, tets = box_tets((8, 8, 4), (0.16, 0.16, 0.08), (-0.08, -0.08, 0.0))
    seat = (np.hypot(points[:, 0], points[:, 1]) < 0.05) & (points[:, 2] > 0.08 - 1e-9)
    points[seat, 2] -= curvature * (points[seat, 0] ** 2 + points[seat, 1] ** 2 - 8e-4)
    model = assemble(points, tets, plastic)
    patch = on_faces(model.mesh, np.isin(np.arange(len(model.mesh.nodes)), np.flatnonzero(seat)))
    root, center = np.flatnonzero(model.mesh.nodes[:, 2] < 1e-9), model.mesh.nodes[patch].mean(axis=0)
    assert excess_of(model, Support(root, [patch], [center]), plastic) < 0.01


@pytest.mark.parametrize("width", [0.5, 2.0])
def test_a_shaft_that_a_ring_holds_is_not_softer_either(plastic, width):
    """The springs of a plane face would make it 0.8 to 1.8% softer: it twists and bends within the ring."""
    points, tets = hollow_shaft(0.01, 0.1, (1, 8, 20))
    model = assemble(points, tets, plastic)
    x, y, z = model.mesh.nodes.T
    patch = on_faces(model.mesh, (np.hypot(x, y) > 0.9e-2) & (z > 0.1 - 0.01 * width - 1e-9))
    center = model.mesh.nodes[patch].mean(axis=0)
    support = Support(np.flatnonzero(z < 1e-9), [patch], [center])
    assert excess_of(model, support, plastic) < 5e-4
