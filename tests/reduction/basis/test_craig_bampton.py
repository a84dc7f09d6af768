"""The reduced basis."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.model import FlexibleSettings
from calmotion.reduction.basis.craig_bampton import mode_signs, reduced_basis, rigid_patch
from calmotion.reduction.basis.natural_modes import SparseSolver, clamped_modes, vector_mass
from calmotion.reduction.elements.assembly import assemble
from scipy.sparse import bmat, csr_matrix, identity

TIP = np.array([0.6, 0.0, 0.0])


@pytest.fixture(scope="module")
def model(helpers, plastic):
    return assemble(*helpers.box((20, 1, 2), (0.6, 0.02, 0.03), origin=(0, -0.01, -0.015)), plastic)


@pytest.fixture(scope="module")
def settings(plastic):
    return FlexibleSettings(plastic)


def ends(model):
    x = model.mesh.nodes[:, 0]
    return np.flatnonzero(x < 1e-9), np.flatnonzero(x > 0.6 - 1e-9)


def test_a_body_clamped_at_its_root_keeps_its_lowest_modes(model, settings):
    root, _ = ends(model)
    basis = reduced_basis(model, root, [], [], settings)
    full = clamped_modes(model, len(basis.omega_squared), root)[0]
    assert 4 <= len(full) <= 8
    assert np.allclose(np.sqrt(basis.omega_squared) / (2 * np.pi), full, rtol=1e-9)
    assert np.abs(basis.modes[root]).max() == 0.0


@pytest.mark.parametrize("tips", [0, 1])
def test_the_basis_is_orthonormal_in_mass_and_diagonal_in_stiffness(model, settings, tips):
    root, tip = ends(model)
    basis = reduced_basis(model, root, [tip] * tips, [TIP] * tips, settings)
    U = basis.modes.reshape(3 * len(model.mesh.nodes), -1)
    assert np.abs(U.T @ (vector_mass(model.mass) @ U) - np.eye(U.shape[1])).max() < 1e-10
    K = U.T @ (model.stiffness @ U)
    assert np.abs(K - np.diag(basis.omega_squared)).max() < 1e-9 * basis.omega_squared.max()
    assert (np.diff(basis.omega_squared) >= 0.0).all() and basis.omega_squared[0] > 0.0


def test_a_patch_moves_as_a_rigid_one(model, settings):
    root, tip = ends(model)
    basis = reduced_basis(model, root, [tip], [TIP], settings)
    expected = rigid_patch(model.mesh.nodes[tip], TIP) @ basis.patch_motion[0]
    assert np.abs(basis.modes[tip] - expected).max() < 1e-12 * np.abs(expected).max()


def test_a_force_at_a_patch_deflects_the_reduced_body_exactly_as_the_full_one(model, settings):
    """Constraint modes are the static responses to what the patch can do: no error whatever the number of modes."""
    root, tip = ends(model)
    basis = reduced_basis(model, root, [tip], [TIP], settings)
    n = len(model.mesh.nodes)
    load = np.array([3.0, -1.0, 2.0, 0.1, 0.2, -0.3])
    reduced = basis.patch_motion[0] @ ((basis.patch_motion[0].T @ load) / basis.omega_squared)
    # the full model: nodes of the patch eliminated onto its six coordinates
    inner = np.setdiff1d(np.arange(n), np.concatenate([root, tip]))
    dofs = (3 * inner[:, None] + np.arange(3)).ravel()
    T = np.zeros((n, 3, 6))
    T[tip] = rigid_patch(model.mesh.nodes[tip], TIP)
    select = identity(3 * n, format="csr")[:, dofs]
    transform = bmat([[select, csr_matrix(T.reshape(3 * n, 6))]], format="csr")
    K = (transform.T @ model.stiffness @ transform).tocsr()
    full = SparseSolver(K).solve(np.concatenate([np.zeros(len(dofs)), load]))[-6:]
    assert np.allclose(reduced, full, rtol=1e-6, atol=1e-9 * np.abs(full).max())


def test_lowest_frequencies_with_a_free_patch_are_close_to_the_full_ones_and_never_below(model, settings):
    root, tip = ends(model)
    basis = reduced_basis(model, root, [tip], [TIP], settings)
    f, full = np.sqrt(basis.omega_squared[:4]) / (2 * np.pi), clamped_modes(model, 4, root)[0]
    assert len(basis.omega_squared) == 10
    assert (f >= full * (1 - 1e-9)).all() and np.allclose(f, full, rtol=4e-3)


def test_a_mode_count_gives_that_many_of_the_lowest(model, settings):
    root, tip = ends(model)
    for count in (0, 1, 3, 9):
        basis = reduced_basis(model, root, [tip], [TIP], replace(settings, mode_count=count))
        assert basis.modes.shape == (len(model.mesh.nodes), 3, count) and basis.patch_motion.shape == (1, 6, count)
    assert np.allclose(np.sqrt(basis.omega_squared[:2]) / (2 * np.pi), clamped_modes(model, 2, root)[0], rtol=1e-4)


def test_a_highest_frequency_keeps_the_modes_below_it_and_residual_vectors_for_the_rest(model, settings):
    root, _ = ends(model)
    full = clamped_modes(model, 12, root)[0]
    for limit in (0.5 * full[0], 0.5 * (full[1] + full[2]), 0.5 * (full[8] + full[9])):
        basis = reduced_basis(model, root, [], [], replace(settings, max_frequency=float(limit)))
        count = np.count_nonzero(full <= limit)
        f = np.sqrt(basis.omega_squared) / (2 * np.pi)
        assert len(f) == count + basis.residual
        assert np.allclose(f[:count], full[:count], rtol=1e-8) and (f[count:] > limit).all()
    # nine modes hold all but 0.1% of the work of a uniform acceleration, save along the bar
    assert basis.residual <= 1


def test_its_own_weight_deflects_the_automatic_basis_by_the_right_amount(model, settings):
    root, _ = ends(model)
    basis = reduced_basis(model, root, [], [], settings)
    n = len(model.mesh.nodes)
    free = np.setdiff1d(np.arange(n), root)
    dofs = (3 * free[:, None] + np.arange(3)).ravel()
    load = (vector_mass(model.mass) @ np.tile([0.0, 0.0, -9.81], n))[dofs]
    full = np.zeros(3 * n)
    full[dofs] = SparseSolver(model.stiffness[dofs][:, dofs]).solve(load)
    U = basis.modes.reshape(3 * n, -1)
    reduced = U @ ((U[dofs].T @ load) / basis.omega_squared)
    tip = 3 * int(np.linalg.norm(model.mesh.nodes - TIP, axis=1).argmin()) + 2
    assert reduced[tip] == pytest.approx(full[tip], rel=3e-3)


def test_signs_do_not_depend_on_rounding():
    modes = np.array([[1.0, -0.2], [-1.0, -0.9], [0.5, 0.9]])
    signs = mode_signs(modes)
    assert signs.tolist() == [1.0, -1.0]
    assert np.array_equal(mode_signs(modes * (1 + 1e-12 * np.array([[-1.0, 1], [1, -1], [1, 1]]))), signs)
    assert np.array_equal(mode_signs(-modes), -signs)
