"""What simulated sensors measure, against rigid motion and statics."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model import Animation, Track
from calmotion.model.motor import DRIVE, SERVO, Rotor
from calmotion.model.run import RunSettings
from calmotion.recordings import ACCELEROMETER, ANGLE, EFFORT, MARKER
from calmotion.simulation.compiled_shot import compile_shot
from calmotion_plugins.calibration.identification.robots import robot_with
from calmotion_plugins.calibration.identification.signals import ends_at_rest, refuse_cyclic, signals_of

OPTIONS = RunSettings(step=1 / 240, integrator="generalized-alpha")
STIFF = {("modulus", "/Arm/Nylon", -1): 2e12}


@pytest.fixture(scope="module")
def shot(arm, animation, bodies):
    return compile_shot(arm, animation, bodies)


@pytest.fixture(scope="module")
def stiff(shot):
    return signals_of(robot_with(shot, STIFF), OPTIONS, after=0.5)


def test_an_accelerometer_at_rest_shows_gravity_upwards(stiff):
    times = np.array([-0.2, 0.0, 2.0])
    expected = np.einsum("nij,i->nj", stiff.axes_at(1, times), [0.0, 0.0, 9.81])
    assert np.allclose(expected[0], [0.0, 0.0, 9.81], atol=1e-3)
    assert np.abs(stiff.at(ACCELEROMETER, 1, times) - expected).max() < 0.05


def test_an_accelerometer_on_a_stiff_arm_shows_what_its_marker_does(stiff, arm):
    times = np.linspace(0.3, 1.4, 200)
    h = 1e-3
    a = (stiff.at(MARKER, 1, times + h) - 2.0 * stiff.at(MARKER, 1, times) + stiff.at(MARKER, 1, times - h)) / h**2
    expected = np.einsum("nij,ni->nj", stiff.axes_at(1, times), a - arm.gravity)
    found = stiff.at(ACCELEROMETER, 1, times)
    assert np.abs(found - expected).max() < 0.02 * np.abs(expected).max()


def test_encoders_read_commands_where_motors_are_ideal_and_hold_after_the_shot(stiff, animation):
    frames = animation.frame_times
    assert stiff.at(ANGLE, 0, frames)[:, 0] == pytest.approx(animation.tracks[0].values, abs=1e-9)
    assert stiff.times[-1] >= frames[-1] + 0.5 - 1e-9
    late = np.array([frames[-1] + 0.4])
    assert stiff.at(ANGLE, 0, late) == pytest.approx(animation.tracks[0].values[-1])
    assert stiff.at(ANGLE, 0, late, 1) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("rotor", [None, Rotor(armature=0.01), Rotor(armature=0.01, gear_stiffness=300.0)])
def test_the_angle_of_a_motor_that_gives_is_that_of_its_links(shot, rotor):
    first, second = shot.character.motors
    values = dict(model=DRIVE if rotor is None else SERVO, position_gain=60.0, velocity_gain=1.0)
    motors = (first, dataclasses.replace(second, **values, rotor=rotor or Rotor()))
    other = compile_shot(dataclasses.replace(shot.character, motors=motors), shot.animation, shot.bodies)
    found = signals_of(robot_with(other, STIFF), OPTIONS)
    times = np.linspace(0.0, 1.5, 50)
    # the elbow lifts the stiff forearm: its slope is the angle
    slope = found.axes_at(1, times)[:, :, 0]
    lifted = np.arcsin(slope[:, 2])
    angle = found.at(ANGLE, 1, times)[:, 0]
    command = np.interp(times, shot.animation.frame_times, shot.animation.tracks[1].values)
    assert np.abs(np.abs(lifted) - np.abs(angle)).max() < 2e-3
    assert np.abs(angle - command).max() > 0.02  # it gives


def test_an_encoder_with_an_offset_reads_the_command_while_the_joint_is_off(shot):
    offset = {**STIFF, ("encoder_offset", "/Arm/Shoulder", -1): 0.05}
    found, exact = (signals_of(robot_with(shot, values), OPTIONS) for values in (offset, STIFF))
    times = np.array([0.0, 1.0])
    assert found.at(ANGLE, 0, times) == pytest.approx(exact.at(ANGLE, 0, times), abs=1e-9)
    turned = np.linalg.norm(found.at(MARKER, 1, times) - exact.at(MARKER, 1, times), axis=1)
    assert turned == pytest.approx(0.05 * np.linalg.norm(exact.at(MARKER, 1, times)[:, :2], axis=1), rel=2e-2)


def test_the_torque_at_rest_carries_the_arm(stiff, arm, shot):
    weights = [body.invariants.mass * 9.81 for body in shot.bodies]
    levers = 0.16, 0.35  # of the forearm and of the hand about the elbow
    moment = weights[1] * levers[0] + weights[2] * levers[1]
    assert abs(stiff.at(EFFORT, 1, np.zeros(1))[0, 0]) == pytest.approx(moment, rel=2e-2)


def test_shots_that_loop_are_refused_and_those_that_end_in_motion_are_known(animation):
    with pytest.raises(ShotError, match="calm:retarget:cyclic"):
        refuse_cyclic(True, "/Arm")
    refuse_cyclic(False, "/Arm")
    assert ends_at_rest(animation)
    moving = Track(animation.frame_times, np.sin(animation.frame_times))
    assert not ends_at_rest(Animation(animation.frame_times, (moving,), (moving,)))
