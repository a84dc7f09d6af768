"""Modes begun from those of a coarser mesh against those by factors."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.linear_algebra import multigrid
from calmotion.mesh.bisection import bisected
from calmotion.reduction.discretization_error import clamped_modes, element_errors
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.full_order import nested_modes
from calmotion.reduction.full_order.nested_modes import NestedModes


def held(mesh, within=1e-9):
    return np.flatnonzero(mesh.nodes[:, 0] < within)


@pytest.fixture
def solvers(monkeypatch):
    """Sizes of the matrices that are factorised."""
    made, solver = [], nested_modes.SparseSolver

    def counted(matrix, points):
        made.append(matrix.shape[0])
        return solver(matrix, points)

    monkeypatch.setattr(nested_modes, "SparseSolver", counted)
    return made


@pytest.mark.parametrize("size", [(0.3, 0.05, 0.05), (0.2, 0.2, 0.008)], ids=["square rod", "thin plate"])
def test_bisected_meshes_have_the_modes_that_factors_give_and_are_not_factorised(helpers, plastic, solvers, size):
    points, tets = helpers.box((10, 4, 1), size)
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    nested = NestedModes()
    for _ in range(4):
        model = assemble(points, tets, plastic)
        found, modes = nested.lowest(model, 3, held(model.mesh), 1e-6)
        exact, expected = clamped_modes(model, 3, held(model.mesh))
        assert found == pytest.approx(exact, rel=2e-5)
        mass = np.einsum("nik,nil->kl", modes, np.einsum("nm,mil->nil", model.mass.toarray(), modes))
        assert np.abs(mass - np.eye(3)).max() < 1e-6 and not modes[held(model.mesh)].any()
        errors = [element_errors(model.mesh, plastic, u)[:, 2] for u in (modes, expected)]  # the third is single
        assert errors[0].sum() == pytest.approx(errors[1].sum(), rel=0.01)
        points, tets = bisected(points, tets, np.argsort(-errors[0])[: len(tets) // 4])
    assert len(solvers) == 1 and 3 * len(model.mesh.nodes) > 2 * solvers[0]


def test_clamps_that_hold_other_nodes_of_the_finer_mesh(helpers, plastic, solvers):
    points, tets = helpers.box((12, 4, 2), (0.3, 0.05, 0.02))
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    nested = NestedModes()
    for within in (0.03, 0.01, 0.04):
        model = assemble(points, tets, plastic)
        found, _ = nested.lowest(model, 3, held(model.mesh, within), 1e-6)
        assert found == pytest.approx(clamped_modes(model, 3, held(model.mesh, within))[0], rel=2e-5)
        points, tets = bisected(points, tets, np.flatnonzero(points[tets, 0].min(axis=1) < 0.05))
    assert len(solvers) == 1


def test_other_meshes_and_small_ones_are_factorised(helpers, plastic, solvers):
    nested = NestedModes()
    for counts in ((10, 4, 2), (12, 4, 2), (3, 1, 1), (10, 4, 2)):
        model = assemble(*helpers.box(counts, (0.3, 0.05, 0.02)), plastic)
        found, modes = nested.lowest(model, 3, held(model.mesh), 1e-3)
        assert found == pytest.approx(clamped_modes(model, 3, held(model.mesh))[0], rel=1e-8)
        assert modes.shape == (len(model.mesh.nodes), 3, 3)
    assert len(solvers) == 3


def test_where_a_cycle_does_not_converge_factors_do(helpers, plastic, solvers, monkeypatch):
    points, tets = helpers.box((10, 4, 2), (0.3, 0.05, 0.02))
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    nested = NestedModes()
    nested.lowest(model := assemble(points, tets, plastic), 3, held(model.mesh), 1e-6)
    model = assemble(*bisected(points, tets, np.arange(20)), plastic)
    monkeypatch.setattr(multigrid.Multigrid, "solve", lambda self, b: np.full_like(b, np.nan))
    found, _ = nested.lowest(model, 3, held(model.mesh), 1e-6)
    assert found == pytest.approx(clamped_modes(model, 3, held(model.mesh))[0], rel=1e-8) and len(solvers) == 2
