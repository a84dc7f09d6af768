"""A body with every patch held, against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.model import FlexibleSettings
from calmotion.reduction.basis.fixed_interface import FixedInterface, ritz_modes
from calmotion.reduction.basis.static_loads import unit_accelerations
from calmotion.reduction.elements.assembly import assemble


@pytest.fixture(scope="module")
def held(helpers, plastic):
    model = assemble(*helpers.box((6, 2, 2), (0.3, 0.06, 0.05)), plastic)
    x = model.mesh.nodes[:, 0]
    tip = np.flatnonzero(x > 0.3 - 1e-9)
    return FixedInterface.of(model, np.flatnonzero(x < 1e-9), [tip], [np.array([0.3, 0.03, 0.025])])


def test_constraint_modes_leave_the_interior_without_force(held):
    force = held.model.stiffness @ held.constraint
    assert np.abs(force[held.interior]).max() < 1e-9 * np.abs(force).max()


def test_columns_are_orthogonal_in_stiffness_and_span_all_loads(held):
    peaks = np.linspace(1.0, 4.0, 12)
    columns = held.all_needed(1e3, peaks)
    K = columns.T @ (held.model.stiffness @ columns)
    scale = np.sqrt(np.diag(K))
    assert np.abs(K[6:, :6] / np.outer(scale[6:], scale[:6])).max() < 1e-8
    inner = columns[held.interior, 6:]
    weight = (held.mass @ unit_accelerations(held.model.mesh.nodes).reshape(-1, 12))[held.interior]
    exact = np.linalg.solve(held.K.toarray(), weight)
    found = inner @ np.linalg.solve(inner.T @ (held.K @ inner), inner.T @ weight)
    assert np.abs(found - exact).max() < 1e-9 * np.abs(exact).max()


def test_accelerations_that_do_not_occur_need_no_vectors(held):
    one = np.zeros(12)
    one[2] = 9.81
    assert held.all_needed(0.0, one).shape[1] == 6 + 8 + 1


def test_the_usual_basis_contains_all_but_a_thousandth_of_the_work_of_a_uniform_acceleration(held, plastic):
    columns, residual = held.usual(FlexibleSettings(plastic))
    assert columns.shape[1] <= 6 + 8 + 6 and residual <= 6
    weight = held.mass @ unit_accelerations(held.model.mesh.nodes)[:, :, :6].reshape(-1, 6)
    free = np.union1d(held.interior, np.flatnonzero(np.abs(held.constraint).max(axis=1)))
    # the patch moves as a rigid one: unknowns of the interior, and six of the patch
    T = np.zeros((len(held.constraint), len(held.interior) + 6))
    T[held.interior, np.arange(len(held.interior))] = 1.0
    outer = np.setdiff1d(free, held.interior)
    T[outer, -6:] = held.constraint[outer]
    K = T.T @ (held.model.stiffness @ T)
    exact = np.einsum("ij,ij->j", T.T @ weight, np.linalg.solve(K, T.T @ weight))
    omega_squared, U = ritz_modes(held.model, columns)
    found = (((columns @ U).T @ weight) ** 2 / omega_squared[:, None]).sum(axis=0)
    for group in (slice(0, 3), slice(3, 6)):
        assert (found <= exact * (1 + 1e-9))[group].all()
        assert (exact - found)[group].max() <= 2e-3 * exact[group].max()


def test_a_body_in_balance_does_no_work_on_any_motion(held):
    """The equilibrium by parts against the virtual work of the whole: every motion it may make is orthogonal."""
    n = len(held.model.mesh.nodes)
    rng = np.random.default_rng(6)
    force, bent = rng.normal(size=(3 * n, 2)), np.zeros((3 * n, 2))
    on_patch = (3 * held.patches[0][:, None] + np.arange(3)).ravel()
    bent[on_patch] = 1e-6 * rng.normal(size=(len(on_patch), 2))
    found, motion = held.balance(force, bent)
    K = held.model.stiffness
    left = force - K @ found
    size = np.abs(force).sum()
    assert np.abs(left[held.interior]).max() < 1e-9 * size
    assert np.abs(held.constraint.T @ left).max() < 1e-9 * size
    # on the patch it is what was imposed and a rigid motion, as told
    np.testing.assert_allclose(
        found[on_patch], (bent + held.constraint @ motion.reshape(-1, 2))[on_patch], atol=1e-12 * np.abs(found).max()
    )
