"""The rigid robot's banded matrix against the dense one that it stands for."""

import numpy as np
import pytest
from calmotion.multibody.analysis.rigid_response import RigidResponse
from calmotion.retargeting.problem.offset_basis import make_basis
from calmotion.retargeting.solver.preconditioner import BandedGram, rigid_preconditioner
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
    pre = rigid_preconditioner(response, weights, basis, penalty)
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
