"""A flexible arm that Exudyn simulates is recorded, calibrated, and predicted in another motion."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.model import Animation, Joint, Track
from calmotion.model.curves import curve_of
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.recordings import ACCELEROMETER, MARKER, Channel, SensorRecording
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.testing import beam_arm
from calmotion.testing.beam_arms import IDENTITY
from calmotion_plugins.calibration.identification.calibrate import CalibrationSettings, calibrate_shot
from calmotion_plugins.calibration.identification.robots import robot_with
from calmotion_plugins.calibration.identification.signals import signals_of
from calmotion_plugins.calibration.model.kinds import HIGHER_MODES
from exudyn_arm import ExudynArm as Arm
from scipy.interpolate import make_interp_spline

MESH = (24, 4, (2.0, 1.5))  # of the model: elements of the arm along and across, and their grading
OTHER_MESH = (20, 3, (2.0, 1.5))  # of the arm in Exudyn
SECONDS, AFTER, RATE = 1.5, 0.8, 1920
NOISE = {MARKER: 3e-4, ACCELEROMETER: 0.1}  # [m], [m/s^2]
STIFFER, DAMPED, HEAVIER = 1.25, 1.6, 1.12  # the real arm over that of the shot
TRUTH = {"modulus": STIFFER * Arm.MATERIAL.youngs_modulus, "damping": DAMPED, "mass": HEAVIER * Arm.PAYLOAD}
OPTIONS = RunSettings(step=1 / 480)


def motion(turn, begin, width):
    """The motor goes somewhere and back, fast enough to shake."""
    frames = (
        np.arange(round(SECONDS * 96) + 1) / 96.0
    )  # dense: a spline through few of them would swing before it begins
    track = Track(frames, turn * np.sin(np.pi * np.clip((frames - begin) / width, 0, 1)) ** 4)
    return Animation(frames, (track,), (track,))


FIRST, OTHER = motion(0.8, 0.1, 0.5), motion(-0.6, 0.2, 0.8)


@pytest.fixture(scope="module")
def real():
    pytest.importorskip("exudyn")
    stuff = replace(
        Arm.MATERIAL, youngs_modulus=TRUTH["modulus"], rayleigh=(0.0, DAMPED * Arm.RETARDATION)
    )  # fmt: skip
    return Arm(stuff, TRUTH["mass"], OTHER_MESH)


@pytest.fixture(scope="module")
def model():
    cells, across, grading = MESH
    character, meshes = beam_arm(
        length=Arm.LENGTH, thickness=Arm.THICKNESS, payload=Arm.PAYLOAD, elasticity="linear", gravity=0.0, cells=cells,
        across=across, grading=grading,
    )  # fmt: skip
    link = character.bodies[0]
    hinge = character.joints[0]
    upright: Joint = replace(
        hinge, frame0=replace(hinge.frame0, rotation=IDENTITY), frame1=replace(hinge.frame1, rotation=IDENTITY)
    )
    character = replace(
        character,
        bodies=(replace(link, flexible=replace(link.flexible, material=Arm.MATERIAL)), *character.bodies[1:]),
        joints=(upright, *character.joints[1:]),
    )
    return character, reduce_bodies(character, span_tree(character), meshes)


def performed(real, animation):
    """What the load does in Exudyn, at 1/1920, 2/1920, ... s."""
    (track,) = animation.current
    curve = curve_of(track, SECONDS, False)
    end = SECONDS + AFTER
    return real.performed(
        round(end * 7680), lambda t: float(curve(np.array([min(t, SECONDS)]), 0)[0]), end, round(end * RATE)
    )  # fmt: skip


def recorded(done, path, rng):
    """A marker and an accelerometer on the load, each on its own clock, with bias and noise."""
    # of its positions, as an accelerometer on the load would feel them
    accelerations = make_interp_spline(done.times, done.positions, k=5).derivative(2)(done.times)
    forces = np.einsum("tki,tk->ti", done.rotations, accelerations)  # without gravity
    channels = (
        Channel(MARKER, path, done.times[::16] + 7.0, done.positions[::16]),
        Channel(ACCELEROMETER, path, done.times[::2] - 2.0, forces[::2] + np.array([0.2, -0.1, 0.15])),
    )
    return tuple(
        SensorRecording(
            f"{c.kind}.csv",
            c.kind,
            (replace(c, values=c.values + NOISE[c.kind] * rng.standard_normal(c.values.shape)),),
        )
        for c in channels
    )


@pytest.mark.long
def test_an_arm_of_exudyn_is_calibrated_to_its_noise_and_predicted_in_another_motion(real, model):
    character, bodies = model
    shot = compile_shot(character, FIRST, bodies)
    recordings = recorded(performed(real, FIRST), character.targets[0].path, np.random.default_rng(0))
    found = calibrate_shot(shot, recordings, CalibrationSettings(priors={HIGHER_MODES: 1e-3}), OPTIONS)
    for fit in found.channels:
        noise = NOISE[fit.name.split()[0]]
        assert fit.rms < 1.1 * noise and fit.validation_rms < 1.25 * noise and fit.rms_before > 5.0 * noise
    for item in found.estimates:
        if item.kind in TRUTH:
            assert abs(item.value / TRUTH[item.kind] - 1.0) < 0.05, item.name
            assert abs(item.value - TRUTH[item.kind]) < 3.0 * item.standard_deviation, item.name
    values = {(item.kind, item.path, item.axis): item.value for item in found.estimates if item.of_robot}
    other = compile_shot(character, OTHER, bodies)
    done = performed(real, OTHER)
    rigid = simulate_shot(other, replace(OPTIONS, pre_roll=0.0), lambda fraction, message: None).before

    def off(values):
        signals = signals_of(robot_with(other, values), replace(OPTIONS, step=1 / 1920), AFTER)
        return np.linalg.norm(signals.at(MARKER, 0, done.times) - done.positions, axis=1).max()

    shake = rigid.position_errors.max()
    assert off({}) > 0.15 * shake and off(values) < 0.05 * shake
