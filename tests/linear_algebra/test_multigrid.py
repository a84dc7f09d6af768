"""Multigrid cycles on bisected meshes against factors of the finest one."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.linear_algebra.multigrid import WIDTH, Blocks, Level, Multigrid, near_order
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.mesh.bisection import bisected
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.nesting import prolongation


@pytest.fixture(scope="module")
def meshes(helpers, plastic):
    """Stiffness of three meshes, ever finer at the clamp, without its nodes, and the levels of a cycle."""
    points, tets = helpers.box((6, 2, 2), (0.3, 0.1, 0.1))
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    matrices, levels, last = [], [], None
    for _ in range(3):
        model = assemble(points, tets, plastic)
        free = model.mesh.nodes[:, 0] > 1e-9
        dofs = np.flatnonzero(np.repeat(free, 3))
        matrices.append(model.stiffness[dofs][:, dofs])
        if last is not None:
            matrix, divided = prolongation(last[0], model.mesh)
            touched = np.zeros(len(free), dtype=bool)
            touched[model.mesh.tets[divided]] = True
            nodes = np.flatnonzero(touched[free]).astype(np.int32)
            levels.append(Level(Blocks(matrices[-1]), matrix[free][:, last[1]], nodes))
        last = model.mesh, free
        near = np.flatnonzero(points[tets, 0].min(axis=1) < 0.11)
        points, tets = bisected(points, tets, near)
    assert matrices[2].shape[0] > 1.25 * matrices[1].shape[0] > 1.25**2 * matrices[0].shape[0]
    return matrices, levels


def test_products_with_blocks_of_vectors(meshes):
    K = meshes[0][1]
    x = np.random.default_rng(0).standard_normal((K.shape[0], WIDTH))
    assert np.allclose(Blocks(K) @ x, K @ x, rtol=0.0, atol=1e-12 * np.abs(K @ x).max())


def test_blocks_in_another_order(meshes):
    K = meshes[0][1]
    n = K.shape[0] // 3
    x = np.random.default_rng(7).standard_normal((n, 3, WIDTH))
    for order in (near_order(K), np.random.default_rng(8).permutation(n)):
        assert np.array_equal(np.sort(order), np.arange(n))
        product = Blocks(K, order) @ x[order].reshape(-1, WIDTH)
        expected = (K @ x.reshape(-1, WIDTH)).reshape(x.shape)[order]
        assert np.allclose(product.reshape(x.shape), expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


def test_nodes_that_are_coupled_are_near_each_other_in_the_order(meshes):
    K = meshes[0][2].tocoo()
    place = np.argsort(near_order(K.tocsr()))
    far = np.abs(place[K.row // 3] - place[K.col // 3])
    assert (
        far.max() < 0.6 * np.abs(K.row // 3 - K.col // 3).max() and far.mean() < 0.6 * np.abs(K.row - K.col).mean() / 3
    )


def test_the_cycle_is_symmetric_and_positive(meshes):
    matrices, levels = meshes
    cycle = Multigrid(SparseSolver(matrices[0]), levels)
    b = np.random.default_rng(1).standard_normal((matrices[-1].shape[0], WIDTH)) * [1.0, 1e-30, 1e30, 1.0]
    form = (b.T @ cycle.solve(b)) / np.outer(*[[1.0, 1e-30, 1e30, 1.0]] * 2)
    assert np.abs(form - form.T).max() < 1e-4 * np.diag(form).max()
    assert np.linalg.eigvalsh(0.5 * (form + form.T)).min() > 0.0
    assert not cycle.solve(np.zeros_like(b)).any()


def test_each_cycle_leaves_less_of_the_error_however_many_meshes_there_are(meshes):
    matrices, levels = meshes
    coarsest = SparseSolver(matrices[0])
    for count in (1, 2):
        K, cycle = matrices[count], Multigrid(coarsest, levels[:count])
        error = np.random.default_rng(2).standard_normal((K.shape[0], WIDTH))
        sizes = []
        for _ in range(8):
            sizes.append(np.einsum("ij,ij->j", error, K @ error))
            error = error - cycle.solve(K @ error)
        sizes = np.array(sizes)
        assert (sizes[1:] < 0.9 * sizes[:-1]).all() and (sizes[-1] < 1e-4 * sizes[0]).all()


def test_a_single_mesh_is_solved_by_its_factors(meshes):
    K = meshes[0][0]
    b = np.random.default_rng(3).standard_normal((K.shape[0], WIDTH))
    assert np.allclose(K @ Multigrid(SparseSolver(K), []).solve(b), b, rtol=0.0, atol=1e-3)
