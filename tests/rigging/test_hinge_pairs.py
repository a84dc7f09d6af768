"""The axes of two hinges: found where two perform the rotations, by derivatives that are those of the residuals."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.rigging.hinge_rows import derivatives, follow, hinge_pair, residuals
from scipy.spatial.transform import Rotation

TIMES = np.linspace(0.0, 2.0, 60)


def turned(pair, count=60):
    """Rotations about two axes that begin at the identity, and their principal directions."""
    first, second = 0.9 * np.sin(TIMES[:count]), 0.4 * (np.sin(2.0 * TIMES[:count] + 1.0) - np.sin(1.0))
    turn = Rotation.from_rotvec(first[:, None] * pair[0]) * Rotation.from_rotvec(second[:, None] * pair[1])
    return turn.as_matrix(), np.linalg.svd(turn.as_rotvec())[2]


@pytest.mark.parametrize("count", [5, 60])
@pytest.mark.parametrize("oblique", [0.0, 0.3, 1.0])
def test_axes_of_two_hinges_are_found(oblique, count):
    pair = np.array([[0.0, 0.6, 0.8], [0.0, 0.8 * np.cos(oblique), -0.6 * np.cos(oblique)]])
    pair[1, 0] = np.sin(oblique)
    D, principal = turned(pair, count)
    found = hinge_pair(principal, D)
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-14)
    assert follow(found, D)[1].max() < 1e-6
    if count == 60:  # of few rotations that hardly differ the axes are not determined
        assert np.abs(np.sum(found * pair, axis=1)) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_are_those_of_the_residuals(seed):
    W = Rotation.random(20, random_state=seed).as_matrix() - np.eye(3)
    x = np.random.default_rng(seed).normal(size=6)
    differences = [(residuals(x + 1e-6 * e, W) - residuals(x - 1e-6 * e, W)) / 2e-6 for e in np.eye(6)]
    assert derivatives(x, W) == pytest.approx(np.stack(differences, axis=1), abs=1e-8)
