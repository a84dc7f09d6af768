"""Eigenpairs of the full model."""

import numpy as np
import pytest
from boxes import box_tets
from calmotion.model import ElasticMaterial
from calmotion.reduction.basis.natural_modes import clamped_modes, lowest_modes, vector_mass
from calmotion.reduction.elements.assembly import assemble
from scipy.linalg import eigh


@pytest.fixture(scope="module")
def model(helpers, steel):
    return assemble(*helpers.box((8, 1, 2), (0.4, 0.02, 0.04)), steel)


def held(model):
    return np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9)


def reduced_matrices(model):
    dofs = np.setdiff1d(np.arange(3 * len(model.mesh.nodes)), (3 * held(model)[:, None] + np.arange(3)).ravel())
    return model.stiffness[dofs][:, dofs], vector_mass(model.mass)[dofs][:, dofs]


def test_the_sparse_modes_are_those_of_the_dense_solver(model):
    K, M = reduced_matrices(model)
    values, vectors = lowest_modes(K, M, 8)
    dense = eigh(K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=(0, 7))
    assert np.allclose(values, dense, rtol=1e-6)  # the dense solver loses digits to the highest modes
    assert np.abs(vectors.T @ (M @ vectors) - np.eye(8)).max() < 1e-9


def test_the_same_modes_come_back_to_the_last_bit(model):
    K, M = reduced_matrices(model)
    first, second = lowest_modes(K, M, 5), lowest_modes(K, M, 5)
    assert np.array_equal(first[0], second[0]) and np.array_equal(first[1], second[1])


@pytest.mark.parametrize("thinness", [1.0, 1e-4, 1e-8])
def test_a_flat_element_does_not_change_the_frequencies_of_a_free_body(thinness):
    points, tets = box_tets((12, 3, 3), (0.3, 0.03, 0.03))
    inner = np.flatnonzero(np.all((points > 1e-9) & (points < np.array([0.3, 0.03, 0.03]) - 1e-9), axis=1))
    points[inner[len(inner) // 2], 1] *= thinness  # nearly onto the face
    model = assemble(points, tets, ElasticMaterial("/Looks/Plastic", 2e9, 0.35, 1200.0))
    assert clamped_modes(model, 3)[0] == pytest.approx([427.6, 427.7, 1114.5], rel=1e-3)


def test_more_modes_than_there_are_is_all_of_them(helpers, steel):
    tiny = assemble(*helpers.box((1, 1, 1), (0.1, 0.1, 0.1)), steel)
    clamped = held(tiny)
    assert len(clamped_modes(tiny, 1000, clamped)[0]) == 3 * (len(tiny.mesh.nodes) - len(clamped))
