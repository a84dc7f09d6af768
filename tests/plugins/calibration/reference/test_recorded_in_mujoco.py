"""A robot that MuJoCo simulates on position actuators is recorded, calibrated, and predicted in another motion."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain, frame
from calmotion.model import Animation, Target, Track
from calmotion.model.curves import curve_of
from calmotion.model.motor import Rotor
from calmotion.model.run import RunSettings
from calmotion.recordings import ANGLE, MARKER, Channel, SensorRecording
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion_plugins.calibration.identification.calibrate import CalibrationSettings, calibrate_shot
from calmotion_plugins.calibration.identification.robots import robot_with
from calmotion_plugins.calibration.identification.signals import signals_of

simulate_lumped = pytest.importorskip("calmotion_plugins.benchmarks.motors.lumped_robot").simulate_lumped
SECONDS, AFTER, LENGTH = 1.5, 0.8, 0.3
NOISE = {ANGLE: 3e-4, MARKER: 3e-4}  # [rad], [m]
GAINS, DAMPING, LOAD = (1.3, 0.75, 1.2), (0.6, 1.5, 1.3), 1.15  # of the real robot over those of the shot
OPTIONS = RunSettings(step=1 / 480)
TIMES = np.arange(round((SECONDS + AFTER) * 960) + 1) / 960.0


def robot(gains=(1.0, 1.0, 1.0), damping=(1.0, 1.0, 1.0), load=1.0):
    character = chain(3, driven=(0, 1, 2), length=LENGTH, mass=0.4)
    motors = tuple(
        replace(
            motor, model="servo", position_gain=k * gain, velocity_gain=0.6 * d, rotor=Rotor(armature=0.005)
        )  # fmt: skip
        for motor, k, gain, d in zip(character.motors, (120.0, 60.0, 30.0), gains, damping, strict=True)
    )
    last = character.bodies[-1]
    heavier = replace(last.mass, mass=load * last.mass.mass)
    tip = Target(f"{last.path}/tip", len(character.bodies) - 1, frame(LENGTH))
    bodies = (*character.bodies[:-1], replace(last, mass=heavier))
    return replace(character, bodies=bodies, motors=motors, targets=(tip,))


def animation(turns, begins, width):
    """Each motor goes somewhere and back, fast enough to shake."""
    frames = np.arange(round(SECONDS * 24) + 1) / 24.0
    waves = [
        turn * np.sin(np.pi * np.clip((frames - t) / width, 0, 1)) ** 4 for turn, t in zip(turns, begins, strict=True)
    ]
    tracks = tuple(Track(frames, wave) for wave in waves)
    return Animation(frames, tracks, tracks)


FIRST = animation((0.5, -0.7, 0.6), (0.1, 0.25, 0.4), 0.7)
OTHER = animation((-0.4, 0.5, 0.8), (0.3, 0.1, 0.2), 0.6)


def performed(character, motion):
    """What the robot does in MuJoCo, at `TIMES`."""
    at = np.minimum(TIMES, SECONDS)
    commands = np.stack([curve_of(track, SECONDS, False)(at, 0) for track in motion.current], axis=1)
    return simulate_lumped(character, TIMES, commands, 1e-4)


def recorded(character, motion, rng):
    """The encoders and a marker at the tip, on clocks of their own, with noise."""
    done = performed(character, motion)
    channels = [
        Channel(ANGLE, motor.path, TIMES[::5] + 7.0, done.motor_values[::5, [k]])
        for k, motor in enumerate(character.motors)
    ]
    marker = Channel(MARKER, character.targets[0].path, TIMES[::8] - 2.0, done.target_positions[::8, 0])

    def noisy(channel):
        return replace(channel, values=channel.values + NOISE[channel.kind] * rng.standard_normal(channel.values.shape))

    return (
        SensorRecording("angles.csv", "a", tuple(noisy(channel) for channel in channels)),
        SensorRecording("markers.csv", "m", (noisy(marker),)),
    )


@pytest.mark.long
def test_a_robot_of_mujoco_is_calibrated_to_its_noise_and_predicted_in_another_motion():
    pytest.importorskip("mujoco")
    real, model = robot(GAINS, DAMPING, LOAD), robot()
    recordings = recorded(real, FIRST, np.random.default_rng(0))
    found = calibrate_shot(compile_shot(model, FIRST), recordings, CalibrationSettings(), OPTIONS)
    for fit in found.channels:
        noise = NOISE[fit.name.split()[0]]
        assert fit.rms < 1.1 * noise and fit.validation_rms < 1.25 * noise and fit.rms_before > 5.0 * noise
    truth = {"position_gain": (156.0, 45.0, 36.0), "velocity_gain": (0.36, 0.9, 0.78), "mass": (0.46,)}
    for kind, wanted in truth.items():
        items = [item for item in found.estimates if item.kind == kind]
        for item, value in zip(items, wanted, strict=True):
            assert abs(item.value - value) < 4.0 * item.standard_deviation < 0.02 * value, item.name
    values = {(item.kind, item.path, item.axis): item.value for item in found.estimates if item.of_robot}
    shot = compile_shot(model, OTHER)
    theirs = performed(real, OTHER).target_positions[:, 0]
    rigid = simulate_shot(shot, replace(OPTIONS, pre_roll=0.0), lambda fraction, message: None).before

    def prediction(values):
        signals = signals_of(robot_with(shot, values), replace(OPTIONS, step=1 / 1920), AFTER)
        return signals.at(MARKER, 0, TIMES)

    shake = rigid.position_errors.max()
    before, after = (np.linalg.norm(prediction(v) - theirs, axis=1).max() for v in ({}, values))
    assert before > 0.15 * shake and after < 0.05 * shake
