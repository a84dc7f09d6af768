"""Mass and stiffness of quadratic tetrahedra."""

from dataclasses import replace

import numpy as np
import pytest
from boxes import quadratic_shapes
from calmotion.mesh.quadratic import quadratic_nodes
from calmotion.reduction.elements.assembly import assemble


@pytest.fixture(scope="module")
def block(helpers, steel):
    points, tets = helpers.box((3, 2, 2), (0.4, 0.1, 0.2), origin=(0.3, -0.2, 0.1))
    # crooked, so that no symmetry of bricks hides a mistake
    points = points + 0.01 * np.random.default_rng(1).standard_normal(points.shape)
    return points, tets, assemble(points, tets, steel)


def test_nodes_are_corners_then_midpoints_of_edges(block):
    points, tets, model = block
    nodes, ten = model.mesh.nodes, model.mesh.tets
    assert np.array_equal(nodes[: len(points)], points)
    assert np.array_equal(ten[:, :4], tets)
    for middle, (i, j) in zip(range(4, 10), ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)), strict=True):
        assert np.allclose(nodes[ten[:, middle]], 0.5 * (nodes[ten[:, i]] + nodes[ten[:, j]]), atol=1e-15)


def test_nodes_are_counted_without_making_them(block):
    points, tets, model = block
    assert quadratic_nodes(points, tets) == len(model.mesh.nodes)


def test_the_mass_matrix_equals_independent_quadrature(block, helpers, steel):
    points, tets, model = block
    bary, weights = helpers.quadrature(points, tets, order=5)
    N = quadratic_shapes(bary)
    n = len(model.mesh.nodes)
    expected = np.zeros((n, n))
    for element, w in zip(model.mesh.tets, weights, strict=True):
        expected[np.ix_(element, element)] += steel.density * np.einsum("qa,qb,q->ab", N, N, w)
    assert np.abs(model.mass.toarray() - expected).max() < 1e-13 * np.abs(expected).max()


def test_rigid_motions_store_no_energy(block):
    _, _, model = block
    nodes, K = model.mesh.nodes, model.stiffness
    for axis in np.eye(3):
        for field in (np.tile(axis, (len(nodes), 1)), np.cross(axis, nodes)):
            assert np.abs(K @ field.ravel()).max() < 1e-12 * abs(K).max() * np.abs(field).max()


@pytest.mark.parametrize("component", range(3))
def test_a_uniform_strain_stores_the_energy_of_the_text_book(block, steel, component):
    points, tets, model = block
    E, nu = steel.youngs_modulus, steel.poissons_ratio
    volume = model.mass.sum() / steel.density
    mu, lame = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    u = np.zeros_like(model.mesh.nodes)
    u[:, component] = 1e-3 * model.mesh.nodes[:, component]
    energy = 0.5 * u.ravel() @ (model.stiffness @ u.ravel())
    assert energy == pytest.approx(0.5 * (lame + 2 * mu) * 1e-6 * volume, rel=1e-12)
    u = np.zeros_like(model.mesh.nodes)
    u[:, component] = 1e-3 * model.mesh.nodes[:, (component + 1) % 3]
    energy = 0.5 * u.ravel() @ (model.stiffness @ u.ravel())
    assert energy == pytest.approx(0.5 * mu * 1e-6 * volume, rel=1e-12)


def test_a_given_mass_scales_the_density(helpers, steel):
    points, tets = helpers.box((2, 1, 1), (0.4, 0.1, 0.2))
    given, own = assemble(points, tets, steel, mass=3.0), assemble(points, tets, replace(steel, density=1.0))
    assert given.mass.sum() == pytest.approx(3.0, rel=1e-13)
    assert abs(given.mass - own.mass * (3.0 / 0.008)).max() < 1e-12
    assert abs(given.stiffness - own.stiffness).max() == 0.0
