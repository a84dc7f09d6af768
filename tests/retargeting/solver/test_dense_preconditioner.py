"""The dense preconditioner against the matrix that it stands for."""

import numpy as np
import pytest
from calmotion.retargeting.problem.offset_basis import make_basis
from calmotion.retargeting.solver.dense_preconditioner import DensePreconditioner
from calmotion.simulation.inputs.time_grid import make_grid

MOTORS = 3


@pytest.mark.parametrize("cyclic", [False, True], ids=["once", "cyclic"])
def test_it_inverts_the_sum_of_residuals_penalty_and_limits_over_the_free_unknowns(cyclic):
    basis = make_basis(make_grid(np.arange(25) / 24.0, 1 / 120, 0.0, cyclic), 0.1, False)
    rng, n = np.random.default_rng(0), basis.count * MOTORS
    J = rng.normal(size=(2 * n, n))
    penalty = 1e-3 * basis.curvature_gram + 1e-2 * basis.closeness
    rows, metric = basis.accelerations, rng.normal(size=(basis.accelerations.shape[0], MOTORS, MOTORS))
    metric = 1e-4 * np.einsum("nab,ncb->nac", metric, metric)
    columns = np.einsum("np,ab->napb", rows.toarray(), np.eye(MOTORS)).reshape(rows.shape[0], MOTORS, -1)
    limits = np.einsum("nax,nab,nby->xy", columns, metric, columns)
    whole = J.T @ J + np.kron(penalty.toarray(), np.eye(MOTORS)) + limits
    fixed = np.zeros(n, bool)
    fixed[[1, 8]] = True
    preconditioner = DensePreconditioner(J.T @ J, penalty, basis.wraps)
    preconditioner.factor(fixed, [(rows, metric)])
    b = rng.normal(size=n)
    b[fixed] = 0.0
    expected = np.zeros(n)
    expected[~fixed] = np.linalg.solve(whole[np.ix_(~fixed, ~fixed)], b[~fixed])
    assert np.abs(preconditioner.solve(b) - expected).max() < 1e-7 * np.abs(expected).max()


def test_unknowns_that_move_no_target_do_not_break_the_factor():
    basis = make_basis(make_grid(np.arange(25) / 24.0, 1 / 120, 0.0, False), 0.1, False)
    gram = np.zeros((basis.count * MOTORS,) * 2)
    gram[0, 0] = 1.0
    preconditioner = DensePreconditioner(gram, 0.0 * basis.closeness, basis.wraps)
    preconditioner.factor(np.zeros(len(gram), bool))
    assert np.all(np.isfinite(preconditioner.solve(np.ones(len(gram)))))
