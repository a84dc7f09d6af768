"""Test motions: they keep all limits, tell more than a chirp, and what they promise is what a calibration finds."""

import dataclasses

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.run import RunSettings
from calmotion.recordings import ACCELEROMETER, EFFORT
from calmotion_plugins.calibration.identification.excitation.design import ExcitationSettings, excite_shot
from calmotion_plugins.calibration.identification.excitation.waveforms import bounds_of, family_of
from calmotion_plugins.calibration.model.excitation import PlannedSensor
from recorded import LOAD, MOTOR

SENSORS = (PlannedSensor(ACCELEROMETER, LOAD, 0.1, 200.0), PlannedSensor(EFFORT, MOTOR, 0.02, 100.0))
SETTINGS = ExcitationSettings(SENSORS, duration=2.0, tries=300)


@pytest.fixture(scope="module")
def limited(recorded_shot):
    character = recorded_shot.character
    motors = tuple(dataclasses.replace(m, max_velocity=2.0, max_torque=3.0) for m in character.motors)
    joints = tuple(dataclasses.replace(j, lower=-0.05, upper=0.5) for j in character.joints)
    return recorded_shot.with_character(dataclasses.replace(character, motors=motors, joints=joints))


@pytest.fixture(scope="module")
def found(limited):
    return excite_shot(limited, SETTINGS, RunSettings())


def test_motion_goes_from_rest_to_rest_within_all_limits(limited, found):
    q = found.values[:, 0] - found.values[0, 0]
    h = found.times[1]
    assert q[0] == q[-1] == 0.0 and np.abs(np.diff(q)[[0, 1, -2, -1]]).max() / h < 0.05
    assert -0.05 <= q.min() and q.max() <= np.radians(10.0)
    (use,) = found.motors
    assert np.abs(np.gradient(q, h)).max() <= 2.0 and use.effort <= 3.0
    bounds = bounds_of(limited.character, limited.animation, np.radians(10.0), 0.05)
    assert use.velocity <= bounds.velocity[0] == 2.0 and use.acceleration <= bounds.acceleration[0]
    shares = (use.range_share, use.velocity_share, use.acceleration_share, use.effort_share)
    assert 0.7 < max(shares) <= 1.0, "the motion should use what is allowed"


def test_it_tells_more_than_a_chirp_of_the_same_length(found):
    assert found.information > 0.3
    for row in found.predicted:
        assert row.identifiable and row.excited < row.prior and row.chirp < row.prior


@pytest.mark.long
def test_a_calibration_has_the_promised_standard_deviations(recorded_shot, found):
    from calmotion.model import Animation, Track
    from calmotion.recordings import Channel, SensorRecording
    from calmotion_plugins.calibration.identification.calibrate import CalibrationSettings, calibrate_shot
    from calmotion_plugins.calibration.identification.robots import robot_with
    from calmotion_plugins.calibration.identification.signals import signals_of

    tracks = (Track(found.times, found.values[:, 0]),)
    shot = dataclasses.replace(recorded_shot, animation=Animation(found.times, tracks, tracks))
    signals = signals_of(robot_with(shot, {}), RunSettings(step=1 / 960), 1.0)
    random, recordings = np.random.default_rng(3), []
    for sensor in SENSORS:
        times = np.arange(0.0, 3.0, 1.0 / sensor.rate)
        values = signals.at(sensor.kind, 0, times)
        values = values + sensor.sigma * random.standard_normal(values.shape)
        recordings.append(SensorRecording(sensor.kind, "", (Channel(sensor.kind, sensor.path, times, values),)))
    made = calibrate_shot(shot, recordings, CalibrationSettings(validate=False, halvings=0), RunSettings(step=1 / 480))
    for row in found.predicted:
        item = made.estimate(row.name)
        assert item.standard_deviation == pytest.approx(row.excited, rel=0.3), row.name
        assert abs(item.value - row.nominal) < 5.0 * item.standard_deviation


def test_a_pose_beyond_the_range_and_a_short_motion_are_refused(limited):
    character = limited.character
    joints = tuple(dataclasses.replace(j, lower=0.2, upper=0.5) for j in character.joints)
    with pytest.raises(ShotError, match="outside the range"):
        bounds_of(dataclasses.replace(character, joints=joints), limited.animation, 0.1, 0.05)
    bounds = bounds_of(character, limited.animation, 0.1, 0.05)
    with pytest.raises(ShotError, match="too few frames"):
        family_of(character, limited.animation, np.array([5.0]), bounds, 0.3)


def test_a_torque_that_even_small_motions_exceed_is_refused(limited):
    motors = tuple(dataclasses.replace(m, max_torque=0.3) for m in limited.character.motors)
    shot = limited.with_character(dataclasses.replace(limited.character, motors=motors))
    with pytest.raises(ShotError, match="no test motion keeps all limits"):
        excite_shot(shot, dataclasses.replace(SETTINGS, tries=3), RunSettings())
