"""Pieces of recordings that have parameters of their own."""

from types import SimpleNamespace

import numpy as np
from calmotion_plugins.calibration.identification.disagreement import Scattered


def test_residuals_have_unit_variance_where_each_piece_has_parameters_of_its_own():
    """T (N + J B J^T) T^T = N, for counts of two sensors as variances N."""
    random = np.random.default_rng(0)
    jacobian, variances = random.normal(size=(12, 3)), np.array([0.5, 0.0, 2.0])
    counts = np.where(np.arange(12) % 2 == 0, 4.0, 1.0)
    basis, values, _ = np.linalg.svd(jacobian / np.sqrt(counts)[:, None] * np.sqrt(variances), full_matrices=False)
    piece = (np.ones(12, bool), basis, 1.0 - 1.0 / np.sqrt(1.0 + values**2))
    scattered = Scattered(SimpleNamespace(counts=counts), np.zeros(3), variances, (piece,))
    transform = np.stack([scattered.of(column) for column in np.eye(12)], axis=1)
    covariance = np.diag(counts) + jacobian @ np.diag(variances) @ jacobian.T
    assert np.allclose(transform @ covariance @ transform.T, np.diag(counts))
    assert np.allclose(scattered.of(jacobian), transform @ jacobian), "derivatives alike"
