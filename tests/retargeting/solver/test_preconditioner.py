"""The rigid robot's banded matrix against the dense one that it stands for."""

import numpy as np
import pytest
from calmotion.multibody.analysis.rigid_response import RigidResponse
from calmotion.retargeting.problem.offset_basis import make_basis
from calmotion.retargeting.solver.preconditioner import BandedGram, RigidPreconditioner
from calmotion.simulation.inputs.time_grid import make_grid

FRAMES = np.arange(37) / 24.0


@pytest.fixture(scope="module", params=[(0.0, False), (0.3, False), (0.6, True)], ids=["rest", "pre-roll", "loop"])
def parts(request):
    grid = make_grid(FRAMES, 1 / 120, *request.param)
    basis = make_basis(grid, 0.1, False)
    rng = np.random.default_rng(0)
    T, motors = len(grid.times), 3
    response = RigidResponse(rng.normal(size=(T, 2, 6, motors)), rng.normal(size=(T, motors, motors)))
    return basis, response, np.abs(rng.normal(size=(T, 2, 6)))


def dense(basis_matrix, metric):
    B, motors = basis_matrix.toarray(), metric.shape[1]
    columns = np.einsum("np,ab->napb", B, np.eye(motors)).reshape(len(B), motors, -1)
    return np.einsum("nax,nab,nby->xy", columns, metric, columns)


def test_bands_contain_the_sum_over_instants(parts):
    basis, response, _ = parts
    metric = np.einsum("nab,ncb->nac", response.inertia, response.inertia)
    gram = BandedGram(basis.count, 3, basis.wraps)
    gram.add(basis.accelerations, metric)
    gram.add_matrix(basis.curvature_gram)
    expected = dense(basis.accelerations, metric) + np.kron(basis.curvature_gram.toarray(), np.eye(3))
    expected = expected[np.ix_(gram.order, gram.order)]
    banded = gram.banded()
    assert len(banded) < len(expected) / 2
    for d in range(len(banded)):
        assert np.allclose(banded[d, : len(expected) - d], np.diagonal(expected, -d), atol=1e-9 * expected.max())
    assert np.abs(np.tril(expected, -len(banded))).max() < 1e-12 * expected.max()


def test_preconditioner_inverts_the_rigid_gauss_newton_matrix(parts):
    basis, response, weights = parts
    penalty = 1e-6 * basis.curvature_gram + 1e-4 * basis.closeness
    pre = RigidPreconditioner(response, weights, basis, penalty)
    J = response.targets * weights[..., None]
    H = dense(basis.values, np.einsum("nkia,nkib->nab", J, J)) + np.kron(penalty.toarray(), np.eye(3))
    more = np.einsum("nab,ncb->nac", response.inertia, response.inertia)
    full = H + dense(basis.accelerations, more)
    full += 1e-9 * np.max(np.diag(H)) * np.eye(len(H))
    fixed = np.zeros(len(H), bool)
    fixed[[3, 7]] = True
    b = np.random.default_rng(3).normal(size=len(H))
    b[fixed] = 0.0
    pre.factor(fixed, [(basis.accelerations, more)])
    free = ~fixed
    expected = np.zeros_like(b)
    expected[free] = np.linalg.solve(full[np.ix_(free, free)], b[free])
    assert np.abs(pre.solve(b) - expected).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.parametrize("limited", [False, True])
def test_motors_that_share_nothing_are_factorised_by_themselves_and_a_limit_joins_them(parts, limited):
    basis, response, weights = parts
    targets = response.targets.copy()
    targets[:, 0, :, 1] = targets[:, 1, :, ::2] = 0.0  # motors 0 and 2 move the first target, motor 1 the second
    apart = RigidResponse(targets, response.inertia)
    penalty = 1e-4 * basis.closeness
    pre = RigidPreconditioner(apart, weights, basis, penalty)
    more = np.einsum("nab,ncb->nac", response.inertia, response.inertia)
    J = targets * weights[..., None]
    H = dense(basis.values, np.einsum("nkia,nkib->nab", J, J)) + np.kron(penalty.toarray(), np.eye(3))
    full = H + 1e-9 * np.max(np.diag(H)) * np.eye(len(H))
    if limited:
        full += dense(basis.accelerations, more)
    fixed = np.zeros(len(H), bool)
    for _ in range(2):  # the second time with the bands of the first
        pre.factor(fixed, [(basis.accelerations, more)] if limited else None)
    assert sorted(len(order) for order, _ in pre._factors) == (
        [3 * basis.count] if limited else [basis.count, 2 * basis.count]
    )
    b = np.random.default_rng(3).normal(size=len(H))
    expected = np.linalg.solve(full, b)
    assert np.abs(pre.solve(b) - expected).max() < 1e-5 * np.abs(expected).max()


def test_a_motor_that_moves_no_target_has_the_penalty_alone(parts):
    basis, response, weights = parts
    targets = response.targets.copy()
    targets[..., 2] = 0.0
    pre = RigidPreconditioner(RigidResponse(targets, response.inertia), weights, basis, 1e-4 * basis.closeness)
    pre.factor(np.zeros(3 * basis.count, bool))
    b = np.zeros(3 * basis.count)
    b[2::3] = 1e-4 * (basis.closeness @ np.ones(basis.count))
    found = pre.solve(b)
    assert np.all(found[0::3] == 0.0) and np.all(found[1::3] == 0.0) and np.any(found[2::3] > 0.0)
