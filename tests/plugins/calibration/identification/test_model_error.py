"""What a mesh has wrong, in the standard deviations of estimates."""

import dataclasses

import numpy as np
import pytest
from calmotion_plugins.calibration.identification.least_squares import minimize, weights_of
from calmotion_plugins.calibration.identification.model_error import OWN, covariance_of_model
from recorded import problem_of

ERROR = 0.01  # of the link's stiffness


def covariance(shot, recordings, error):
    """Covariance by the model where all else is known, and the parameters."""
    bodies = [dataclasses.replace(body, mesh_error=error if len(body.stiffness) else None) for body in shot.bodies]
    problem = problem_of(shot.with_bodies(bodies), recordings)
    start = np.zeros(len(problem.parameters) + len(problem.measurement.parameters))
    solution = minimize(problem, start, problem.lower)
    weights = weights_of(solution.residuals) / problem.counts
    return covariance_of_model(problem, solution.z, solution.jacobian, weights), problem.parameters


def test_a_modulus_is_not_known_better_than_the_stiffness_of_the_mesh(recorded_shot, recordings):
    found, parameters = covariance(recorded_shot, recordings, ERROR)
    assert parameters[0].kind == "modulus"
    deviation = parameters[0].spread * np.sqrt(found[0, 0])
    assert ERROR < 1.02 * deviation < 2.0 * ERROR  # the modes' own errors come on top
    assert np.linalg.eigvalsh(found).min() > -1e-9 * found.trace()


def test_errors_of_the_model_add_up_in_proportion_and_vanish_with_it(recorded_shot, recordings):
    small, _ = covariance(recorded_shot, recordings, 0.1 * ERROR)
    large, _ = covariance(recorded_shot, recordings, ERROR)
    assert large[0, 0] == pytest.approx(100.0 * small[0, 0], rel=0.1) and large[0, 0] > 0.0
    assert not np.any(covariance(recorded_shot, recordings, None)[0]) and 0.0 < OWN < 1.0
