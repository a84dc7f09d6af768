"""Which further sensor tells what the recordings do not tell, against a calibration that has it."""

import numpy as np
from calmotion.recordings import ANGLE, MARKER
from calmotion_plugins.calibration.identification.advice import IDENTIFIABLE, advised
from recorded import only, problem_of


def information(problem):
    z = np.zeros(len(problem.parameters) + len(problem.measurement.parameters))
    _, J = problem.linearized(z)
    return J.T @ J + np.eye(len(z)), z


def test_encoders_of_ideal_motors_tell_nothing_and_another_sensor_would(recorded_shot, recordings):
    problem = problem_of(recorded_shot, only(recordings, ANGLE))
    found = advised(problem, *information(problem))
    assert sorted(found) == [0, 1, 2]
    # the predicted deviation is that with such a sensor, up to its rate and noise
    assert found[0].kind in ("marker", "accelerometer", "effort") and found[0].sigma < IDENTIFIABLE
    assert found[0].path in found[0].sentence and "on the clock of the commands" in found[0].sentence


def test_what_is_told_needs_no_advice(recorded_shot, recordings):
    problem = problem_of(recorded_shot, only(recordings, MARKER))
    H, z = information(problem)
    told = np.sqrt(np.diag(np.linalg.inv(H)))[:3] < IDENTIFIABLE
    assert set(advised(problem, H, z)).isdisjoint(np.flatnonzero(told)) and told.any()
