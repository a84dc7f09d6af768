"""The derivatives of recordings by the parameters of the robot, against extrapolated differences."""

import numpy as np
import pytest
from calmotion_plugins.calibration.identification.problem import DIFFERENCE
from recorded import problem_of


@pytest.fixture(scope="module")
def problem(recorded_shot, recordings):
    return problem_of(recorded_shot, recordings)


def test_differences_are_derivatives(problem):
    count = len(problem.parameters)
    z = np.full(count + len(problem.measurement.parameters), 0.1)
    before = problem.simulations
    residuals, jacobian = problem.linearized(z)
    assert problem.simulations == before + 1 + count
    assert problem.residuals(z) == pytest.approx(residuals, abs=1e-12)
    for k in range(count):

        def difference(h, k=k):
            unit = h * np.eye(len(z))[k]
            return (problem.residuals(z + unit) - problem.residuals(z - unit)) / (2.0 * h)

        wide, narrow = difference(12.0 * DIFFERENCE), difference(6.0 * DIFFERENCE)
        exact = narrow + (narrow - wide) / 3.0  # Richardson: the error is of fourth order
        assert np.linalg.norm(jacobian[:, k] - exact) < 2e-3 * np.linalg.norm(exact)
