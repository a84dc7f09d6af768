"""The model of a servo by other authors: many simulations at once are those of its simulator; a fit finds it again."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion_plugins.benchmarks.accuracy import servo_model
from calmotion_plugins.benchmarks.accuracy.servo_model import Bench, FittedServo, Played, fitted_servo

BENCH = Bench("xl330", "m6", 0.49, 0.0, 0.1, 7.4, 0.0022144)
TIMES = np.arange(0.0, 2.0, 0.01)
GOAL = 0.8 * np.sin(2.0 * TIMES) ** 2


def published():
    bam = pytest.importorskip("bam.model", reason="better-actuator-models is not installed")
    model = bam.load_model(motor_name="xl330", model="m6")
    return {name: parameter.value for name, parameter in model.get_parameters().items()}


def alone(parameters, gain, step):
    """By the package's own loop, one servo."""
    from bam.model import load_model
    from bam.simulate import Simulator

    model = load_model(motor_name="xl330", model="m6")
    for name, value in parameters.items():
        getattr(model, name).value = value
    model.actuator.load_log({"mass": 0.49, "arm_mass": 0.0, "length": 0.1, "kp": gain, "vin": 7.4})
    run, times, angles = Simulator(model), np.arange(0.0, TIMES[-1] + 2 * step, step), []
    for goal in np.interp(times, TIMES, GOAL):
        angles.append(float(run.q))
        run.step(model.actuator.compute_control(goal, run.q, run.dq, step), True, step)
    return np.interp(TIMES, times, angles)


def test_many_servos_at_once_move_as_each_alone():
    known = published()
    plays = [Played(gain, TIMES, GOAL, TIMES, TIMES) for gain in (100.0, 400.0)]
    both = {name: np.array([value, 1.05 * value]) for name, value in known.items()}
    found = servo_model._angles(BENCH, both, plays, 2e-3, np.zeros(2))
    for column, factor in enumerate((1.0, 1.05)):
        for row, play in enumerate(plays):
            expected = alone({name: factor * value for name, value in known.items()}, play.gain, 2e-3)
            assert np.abs(found[row][:, column] - expected).max() < 1e-12


def test_a_fit_explains_recordings_of_another_servo_and_its_replay_is_that_servo():
    known = published()
    real = known | {"kt": 0.8 * known["kt"], "friction_viscous": 2.0 * known["friction_viscous"]}
    plays = [Played(gain, TIMES, GOAL, TIMES, alone(real, gain, 2e-3)) for gain in (100.0, 400.0)]
    found = fitted_servo(BENCH, plays)
    assert found.error < 0.1 * found.published_error and found.error < 2e-3
    exact = 2e3 * 0.1 * np.abs(np.sin(0.5 * (alone(real, 400.0, 1e-3) - GOAL))).max()
    assert found.largest_error_mm(400.0, TIMES, GOAL, GOAL) == pytest.approx(exact, rel=0.03)


def test_without_the_package_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "bam.model", None)
    with pytest.raises(ShotError, match="not installed") as refused:
        FittedServo({"kt": 1.0}, 0.0, 0.0, BENCH).largest_error_mm(400.0, TIMES, GOAL, GOAL)
    assert "pip install better-actuator-models" in refused.value.remedy
