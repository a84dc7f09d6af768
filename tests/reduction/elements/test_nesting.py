"""Displacements on a bisected mesh are those of the mesh before it."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.mesh.bisection import bisected
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.nesting import prolongation
from scipy.sparse import identity


def cut(helpers, seed, rounds=1):
    points, tets = helpers.box((6, 2, 2), (0.3, 0.1, 0.02))  # flat: the nearest centre is often another one's
    points, tets = np.asarray(points, dtype=float), np.asarray(tets)
    coarse, rng = quadratic_mesh(points, tets), np.random.default_rng(seed)
    for _ in range(rounds):
        points, tets = bisected(points, tets, rng.choice(len(tets), len(tets) // 5, replace=False))
    return coarse, quadratic_mesh(points, tets)


@pytest.mark.parametrize(("seed", "rounds"), [(0, 1), (1, 1), (2, 4)])
def test_quadratic_fields_are_the_same(helpers, seed, rounds):
    coarse, fine = cut(helpers, seed, rounds)
    matrix, divided = prolongation(coarse, fine)
    assert 0 < np.count_nonzero(divided) < len(divided) or rounds > 1

    def field(mesh):
        x, y, z = mesh.nodes.T
        return 1.0 + x - 2.0 * y + x * z + y * y - 3.0 * z * z + x * y

    assert np.allclose(matrix @ field(coarse), field(fine), rtol=0.0, atol=1e-12)
    assert np.allclose(matrix.sum(axis=1), 1.0) and (np.diff(matrix.indptr)[: coarse.tets[:, :4].max() + 1] == 1).all()


def test_any_field_has_the_same_energy_and_mass(helpers, plastic):
    coarse, fine = cut(helpers, 3)
    models = [assemble(mesh.basis.mesh.p.T, mesh.basis.mesh.t.T, plastic) for mesh in (coarse, fine)]
    matrix, _ = prolongation(models[0].mesh, models[1].mesh)
    u = np.random.default_rng(4).standard_normal((len(models[0].mesh.nodes), 3))
    v = matrix @ u
    assert v.ravel() @ (models[1].stiffness @ v.ravel()) == pytest.approx(u.ravel() @ (models[0].stiffness @ u.ravel()))
    assert np.einsum("ij,ij->", v, models[1].mass @ v) == pytest.approx(np.einsum("ij,ij->", u, models[0].mass @ u))


def test_undivided_elements_are_told(helpers):
    coarse, fine = cut(helpers, 5)
    _, divided = prolongation(coarse, fine)
    before = {tuple(sorted(tet)) for tet in coarse.tets[:, :4].tolist()}
    assert all((tuple(sorted(t)) in before) != d for t, d in zip(fine.tets[:, :4].tolist(), divided, strict=True))
    matrix, divided = prolongation(coarse, coarse)
    assert not divided.any() and abs(matrix - identity(len(coarse.nodes))).max() < 1e-9


def test_other_meshes_are_refused(helpers):
    coarse, fine = cut(helpers, 6)
    assert prolongation(fine, coarse) is None
    other = helpers.box((3, 2, 2), (0.4, 0.1, 0.02))
    assert prolongation(coarse, quadratic_mesh(np.asarray(other[0], dtype=float), np.asarray(other[1]))) is None
