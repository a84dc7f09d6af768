"""Known parameters recovered from disturbed recordings."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model.run import RunSettings
from calmotion.recordings import ACCELEROMETER, ANGLE, EFFORT, MARKER
from calmotion_plugins.calibration.identification.calibrate import CalibrationSettings, calibrate_shot
from recorded import BIAS, CLOCKS, LOAD, PLACE, PLASTIC, TRUTH, only

OPTIONS = RunSettings(step=1 / 480)


@pytest.fixture(scope="module")
def shot(recorded_shot):
    return recorded_shot


@pytest.fixture(scope="module")
def found(shot, recordings):
    return calibrate_shot(shot, recordings, CalibrationSettings(), OPTIONS)


def named(truth):
    return {f"{kind} {path}": value for (kind, path, _), value in truth.items()}


def test_intervals_cover_the_truth(found):
    assert found.converged
    for name, value in named(TRUTH).items():
        item = found.estimate(name)
        assert item.identifiable and abs(item.value - value) < 3.0 * item.standard_deviation, name
        assert not item.advice
    modulus, damping = found.estimate(f"modulus {PLASTIC}"), found.estimate(f"damping {PLASTIC}")
    assert modulus.value == pytest.approx(2.15e9, rel=0.01) and damping.value == pytest.approx(0.014, rel=0.1)


def test_clocks_places_and_biases_come_with_them(found):
    for file, clock in CLOCKS.items():
        item = found.estimate(f"clock_offset {file}")
        assert abs(item.value - clock) < 4.0 * item.standard_deviation and item.standard_deviation < 1e-3
    for axis, name in enumerate("xyz"):
        for kind, values in (("place", PLACE), ("bias", BIAS)):
            item = found.estimate(f"{kind} {LOAD}.{name}")
            assert abs(item.value - values[axis]) < 4.0 * item.standard_deviation


def test_residuals_are_the_noise_also_where_they_were_held_out(found):
    noise = {"marker": 3e-4, "accelerometer": 0.1, "angle": 3e-4, "effort": 0.02}
    for fit in found.channels:
        expected = noise[fit.name.split()[0]]
        assert fit.rms == pytest.approx(expected, rel=0.1) and fit.sigma == pytest.approx(expected, rel=0.2)
        assert fit.validation_rms == pytest.approx(expected, rel=0.25) and fit.held_out > 0
    shaking = [fit for fit in found.channels if fit.name.split()[0] in ("marker", "accelerometer")]
    assert all(fit.rms_before > 2.0 * fit.rms for fit in shaking)


def test_the_step_does_not_matter_in_the_end(found):
    assert found.step_shift < 0.5 and found.step_s < 1 / 480


def test_what_encoders_cannot_tell_is_named_with_what_would_tell_it(shot, recordings):
    found = calibrate_shot(shot, only(recordings, ANGLE), CalibrationSettings(halvings=0), OPTIONS)
    for name in named(TRUTH):
        item = found.estimate(name)
        assert not item.identifiable and item.standard_deviation == pytest.approx(item.prior, rel=0.3)
    assert any(word in found.estimate(f"modulus {PLASTIC}").advice for word in ("marker", "accelerometer", "torque"))


@pytest.mark.long
def test_frequencies_alone_leave_a_combination_of_modulus_and_mass(shot, recordings):
    found = calibrate_shot(shot, only(recordings, ACCELEROMETER), CalibrationSettings(halvings=0), OPTIONS)
    assert any("hard to tell apart" in note for note in found.notes)
    names = [item.name for item in found.estimates]
    pair = [names.index(f"modulus {PLASTIC}"), names.index(f"mass {LOAD}")]
    assert found.correlations[pair[0], pair[1]] > 0.9


def test_what_does_not_fit_is_refused(shot, recordings):
    with pytest.raises(ShotError, match="no recordings"):
        calibrate_shot(shot, [], CalibrationSettings(), OPTIONS)
    loop = dataclasses.replace(shot.character, retarget=dataclasses.replace(shot.character.retarget, cyclic=True))
    with pytest.raises(ShotError, match="cyclic"):
        calibrate_shot(shot.with_character(loop), only(recordings, ANGLE), CalibrationSettings(), OPTIONS)


@pytest.mark.long
def test_torques_and_markers_do_without_an_accelerometer(shot, recordings):
    found = calibrate_shot(shot, only(recordings, MARKER, EFFORT), CalibrationSettings(halvings=1), OPTIONS)
    mass = found.estimate(f"mass {LOAD}")
    assert mass.identifiable and abs(np.log(mass.value / 0.188)) < 0.05
