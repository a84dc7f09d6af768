"""Classic identification of arms: efforts by a regression, and what it finds of motors."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain
from calmotion.model import Animation, RunSettings, Track
from calmotion.model.character import WORLD, Body, Joint, MassProperties
from calmotion.model.motor import SERVO, Rotor, TurnsWith
from calmotion.recordings import EFFORT, Channel, SensorRecording
from calmotion.simulation.compiled_shot import compile_shot
from calmotion_plugins.benchmarks.accuracy.inverse_dynamics import OF_ROTOR, identified, moved, nominal, serves
from calmotion_plugins.calibration import robot_with, signals_of

TIMES = np.arange(0.05, 1.95, 1 / 250)
ROTORS = (Rotor(0.02, friction=0.4, viscous_friction=0.15), Rotor(0.005, friction=0.1, viscous_friction=0.02))


def shot(signs=(1.0, 1.0), pair=None):
    """An arm of two hinges about axes that are not parallel, on a body that is fixed to the world."""
    arm = chain(2, driven=(0, 1), length=0.3, mass=0.6)
    heavy = MassProperties(0.5, np.array([0.1, 0.02, 0.03]), np.diag([2e-3, 5e-3, 4e-3]))
    tilted = replace(arm.joints[1].frame0, rotation=np.array([0.6, 0.8, 0.0, 0.0]))
    joints = [arm.joints[0], replace(arm.joints[1], frame0=tilted)]
    joints = [replace(joint, body0=joint.body0 + 1, body1=joint.body1 + 1) for joint in joints]
    base = Body("/C/Base", arm.bodies[0].rest, heavy)
    fixed = Joint("/C/Weld", "fixed", WORLD, 0, arm.joints[0].frame0, arm.joints[0].frame0)
    motors = [replace(motor, joint=k + 1, rotor=ROTORS[k]) for k, motor in enumerate(arm.motors)]
    motors[1] = replace(motors[1], turns_with=pair)
    arm = replace(
        arm, bodies=(base, arm.bodies[0], replace(arm.bodies[1], mass=heavy)), joints=(fixed, *joints),
        motors=tuple(motors), targets=(replace(arm.targets[0], body=2),),
    )  # fmt: skip

    frames = np.arange(97) / 48.0
    swings = [size * np.sin(np.pi * frames / 2.0) ** 4 * np.cos(w * frames) for size, w in ((0.9, 3.0), (1.4, 7.0))]
    tracks = tuple(Track(frames, sign * swing) for sign, swing in zip(signs, swings, strict=True))
    return compile_shot(arm, Animation(frames, tracks, tracks), None)


def recorded(own):
    signals = signals_of(robot_with(own, {}), RunSettings(step=5e-4, integrator="bdf2"))
    channels = [
        Channel(EFFORT, m.path, TIMES, signals.at(EFFORT, k, TIMES)) for k, m in enumerate(own.character.motors)
    ]
    return [SensorRecording("a.csv", "", tuple(channels))]


@pytest.mark.parametrize("pair", [None, TurnsWith(0, -0.8)], ids=["", "coupled"])
def test_the_regression_has_the_efforts_of_the_simulation(pair):
    own = shot(pair=pair)
    assert serves(own.character)
    motion, x = moved(own, recorded(own)), nominal(own.character)
    for k, rotor in enumerate(ROTORS):
        at = len(x) - OF_ROTOR * (2 - k)
        x[at : at + 3] = rotor.armature, rotor.viscous_friction, rotor.friction
    for off, (_, channel) in zip(motion.off(x), motion.efforts, strict=True):
        assert np.abs(off).mean() < 2e-3 * np.abs(channel.values).mean()


def test_it_finds_rotors_and_with_them_masses_and_predicts_another_motion():
    own, other = shot(), shot((-1.0, 0.6))
    motion, unseen = moved(own, recorded(own)), moved(other, recorded(other))
    x = identified(own.character, [motion], False)
    for k, rotor in enumerate(ROTORS):
        at = len(x) - OF_ROTOR * (2 - k)
        assert x[at : at + 3] == pytest.approx(
            [rotor.armature, rotor.viscous_friction, rotor.friction], rel=0.05, abs=2e-3
        )
    for bodies in (False, True):
        x = identified(own.character, [motion], bodies)
        for off, (_, channel) in zip(unseen.off(x), unseen.efforts, strict=True):
            assert np.abs(off).max() < 0.03 * np.abs(channel.values).max()


def test_arms_of_other_kinds_have_none():
    character = shot().character
    assert not serves(replace(character, motors=(replace(character.motors[0], model=SERVO), character.motors[1])))
    assert not serves(replace(character, motors=character.motors[:1]))
