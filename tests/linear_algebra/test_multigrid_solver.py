"""Conjugate gradients with a multigrid cycle against factors."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.linear_algebra.multigrid import WIDTH
from calmotion.linear_algebra.multigrid_solver import MultigridSolver
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.mesh.bisection import bisected
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.nested_meshes import NestedMeshes


@pytest.fixture(scope="module")
def finer(helpers, plastic):
    """The finest of three nested meshes, and its matrix."""
    points, tets = helpers.box((6, 2, 2), (0.3, 0.1, 0.1))
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    meshes = None
    for _ in range(3):
        model = assemble(points, tets, plastic)
        free = model.mesh.nodes[:, 0] > 1e-9
        dofs = np.flatnonzero(np.repeat(free, 3))
        K = model.stiffness[dofs][:, dofs]
        if meshes is None:
            meshes = NestedMeshes(model.mesh, free, SparseSolver(K))
        else:
            found = meshes.finer(model.mesh, free, K)
        points, tets = bisected(points, tets, np.flatnonzero(points[tets, 0].min(axis=1) < 0.11))
    return found, K


def never():
    raise AssertionError("the cycle converges")


@pytest.mark.parametrize("count", [1, WIDTH, 2 * WIDTH + 1])
def test_solutions_are_as_accurate_as_asked_however_many_there_are(finer, count):
    mesh, K = finer
    exact = np.random.default_rng(4).standard_normal((K.shape[0], count)) * 10.0 ** np.arange(count)
    energy = np.einsum("ij,ij->j", exact, K @ exact)
    for accuracy in (1e-4, 1e-8):
        off = MultigridSolver(mesh.order, mesh.stiffness, mesh.cycle, accuracy, never).solve(K @ exact) - exact
        error = np.einsum("ij,ij->j", off, K @ off) / energy
        assert (error < 5.0 * accuracy).all() and (error > 1e-4 * accuracy).any()


def test_a_start_saves_cycles_and_zero_stays_zero(finer):
    mesh, K = finer
    exact = np.random.default_rng(5).standard_normal((K.shape[0], WIDTH))
    exact[:, 0] = 0.0
    cycles = []

    class Counted:
        def solve(self, b):
            cycles.append(len(b))
            return mesh.cycle.solve(b)

    solver = MultigridSolver(mesh.order, mesh.stiffness, Counted(), 1e-8, never)
    counts = []
    for start in (None, exact * (1.0 + 1e-3), exact):
        cycles.clear()
        found = solver.solve(K @ exact, start)
        assert not found[:, 0].any()
        counts.append(len(cycles))
    assert counts[2] == 1 < counts[1] < counts[0]


def test_factors_take_over_where_the_cycle_does_not_converge(finer):
    mesh, K = finer
    exact = np.random.default_rng(6).standard_normal((K.shape[0], WIDTH + 1))

    class Wrong:
        def solve(self, b):
            return np.full_like(b, np.nan)

    solver = MultigridSolver(mesh.order, mesh.stiffness, Wrong(), 1e-8, lambda: SparseSolver(K))
    assert solver.entries == 0
    assert solver.solve(K @ exact) == pytest.approx(exact, abs=1e-8) and solver.entries > 0
