"""A small arm with known parameters, and what sensors record of it, for the tests of calibrations."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.recordings import ACCELEROMETER, ANGLE, EFFORT, MARKER, Channel, SensorRecording
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion_plugins.calibration.identification.measurement import Measurement
from calmotion_plugins.calibration.identification.parameters import robot_parameters
from calmotion_plugins.calibration.identification.problem import Calibrated
from calmotion_plugins.calibration.identification.recordings.sensors import measurement_parameters, sensors_of
from calmotion_plugins.calibration.identification.robots import robot_with
from calmotion_plugins.calibration.identification.signals import signals_of
from calmotion_plugins.calibration.identification.takes import Take

LOAD, MOTOR, PLASTIC = "/Arm/Load", "/Arm/Joint0", "/Arm/Plastic"
TRUTH = {("modulus", PLASTIC, -1): 2.15e9, ("damping", PLASTIC, -1): 0.014, ("mass", LOAD, -1): 0.188}
CLOCKS = {"camera.csv": 3.217, "accelerometer.csv": -0.4, "motor.csv": 0.05}
PLACE, BIAS = np.array([1e-3, -5e-4, 3e-4]), np.array([0.2, -0.1, 0.15])


def small_shot():
    """One plastic link that is lifted and lowered, with a load; few modes."""
    character, meshes = beam_arm(length=0.35, thickness=0.018, youngs_modulus=1.8e9, elasticity="linear", modes=3)
    away, back = quintic(0.7, 0.25, 0.1), quintic(-0.5, 0.2, 0.6)
    animation = shot_of(lambda t: away(t) + back(t), 1.25)
    return compile_shot(character, animation, reduce_bodies(character, span_tree(character), meshes))


def recordings_of(shot, truth=TRUTH, seed=0):
    """A camera, an accelerometer and the motor record the robot with known parameters, by another integrator."""
    rng = np.random.default_rng(seed)
    signals = signals_of(robot_with(shot, truth), RunSettings(step=1 / 3840, integrator="newmark"), 0.5)

    def recording(file, rate, channels):
        own = np.arange(-0.2, 1.7, 1.0 / rate)
        made = []
        for kind, path, noise in channels:
            values = signals.at(kind, 0, own)
            if kind == MARKER:
                values = values + signals.axes_at(0, own) @ PLACE
            if kind == ACCELEROMETER:
                values = values + BIAS
            values = values + noise * rng.standard_normal(values.shape)
            values[rng.uniform(size=len(own)) < 0.02] = np.nan
            made.append(Channel(kind, path, own + CLOCKS[file], values))
        return SensorRecording(file, file, tuple(made))

    return [
        recording("camera.csv", 120.0, [(MARKER, LOAD, 3e-4)]),
        recording("accelerometer.csv", 800.0, [(ACCELEROMETER, LOAD, 0.1)]),
        recording("motor.csv", 200.0, [(ANGLE, MOTOR, 3e-4), (EFFORT, MOTOR, 0.02)]),
    ]


def only(recordings, *kinds):
    """The recordings with channels of some kinds alone."""
    found = []
    for item in recordings:
        channels = tuple(channel for channel in item.channels if channel.kind in kinds)
        if channels:
            found.append(dataclasses.replace(item, channels=channels))
    return found


def problem_of(shot, recordings, step=1 / 240):
    """The problem of a calibration whose clocks are known."""
    clocks = [CLOCKS[item.file] for item in recordings]
    measurement = Measurement(
        tuple(item.file for item in recordings), sensors_of(shot.character, recordings, clocks, -0.5, 1.75),
        measurement_parameters(recordings, clocks),
    )  # fmt: skip
    options = RunSettings(step=step, integrator="generalized-alpha")
    return Calibrated([Take(shot, robot_parameters(shot), 0.5)], measurement, options)


@pytest.fixture(scope="session")
def recorded_shot():
    return small_shot()


@pytest.fixture(scope="session")
def recordings(recorded_shot):
    return recordings_of(recorded_shot)
