"""The lumped model in MuJoCo: servos with all that both programs have, sliders and fixed joints; what has no place."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain, frame
from calmotion import ShotError
from calmotion.model import Animation, Body, Character, Joint, MassProperties, Motor, Target, Track
from calmotion.model.motor import Rotor
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion_plugins.benchmarks.motors.lumped_robot import lumped_mjcf, simulate_lumped

FRAMES = np.arange(25) / 24.0
ROTOR = Rotor(0.05, np.inf, 0.0, 0.4, 0.3, 0.5)


def servos(character, **changes):
    changes = {"model": "servo", "position_gain": 400.0, "velocity_gain": 8.0, "rotor": ROTOR} | changes
    return replace(character, motors=tuple(replace(motor, **changes) for motor in character.motors))


def both(character, step=1 / 960):
    wave = np.sin(2 * np.pi * FRAMES) ** 3
    tracks = tuple(Track(FRAMES, 0.5 * (-0.7) ** k * wave) for k in range(len(character.motors)))
    shot = compile_shot(character, Animation(FRAMES, tracks, tracks))
    ours = simulate_shot(shot, RunSettings(step=step), lambda fraction, message: None).before.motion
    return ours, simulate_lumped(character, ours.times, ours.motor_values)


def apart(ours, theirs):
    off = np.linalg.norm(ours.target_positions - theirs.target_positions, axis=2).max()
    return off / np.ptp(theirs.target_positions, axis=0).max()


def gantry():
    """A carriage on a slider across, a plate welded to it off its axes, and a pendulum on that."""
    turned = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])  # z along the world's x
    masses = [MassProperties(m, np.array([0.02, 0.03, -0.05]), np.diag([0.01, 0.02, 0.015])) for m in (2.0, 1.0, 0.5)]
    bodies = tuple(Body(f"/G/{k}", frame(), mass) for k, mass in enumerate(masses))
    joints = (
        Joint("/G/Slide", "prismatic", -1, 0, frame(z=1.0, rotation=turned), frame(0.1, rotation=turned)),
        Joint("/G/Weld", "fixed", 0, 1, frame(0.1, 0.2, -0.1, turned), frame(0.05)),
        Joint("/G/Swing", "revolute", 1, 2, frame(0.0, 0.1), frame(0.0, 0.0, 0.2)),
    )
    motors = (Motor(0, "/G/Slide", "linear", linear=True), Motor(2, "/G/Swing", "angular"))
    return Character("/G", bodies, joints, motors, (Target("/G/2/T", 2, frame(0.1, 0.2)),), np.array([0.0, 0.0, -9.81]))


@pytest.mark.parametrize(
    "character",
    [
        servos(chain(2, driven=(0, 1), length=0.3)),
        servos(chain(2, driven=(0, 1), length=0.3), model="drive", rotor=Rotor(), delay=0.02),
        servos(chain(2, driven=(0, 1), length=0.3), model="drive", rotor=Rotor(), damping_on="joint"),
        servos(gantry(), position_gain=900.0, damping_on="joint"),
    ],
    ids=["servos", "late drives", "drives damped on the joint", "slider and weld"],
)
def test_both_programs_move_the_targets_alike(character):
    pytest.importorskip("mujoco")
    ours, theirs = both(character)
    assert apart(ours, theirs) < 5e-4


@pytest.mark.parametrize(
    ("change", "path"),
    [
        (lambda c: replace(c, joints=(c.joints[0], replace(c.joints[1], closes_chain=True))), "/C/J1"),
        (lambda c: replace(c, bodies=(replace(c.bodies[0], mass=None), c.bodies[1])), "/C/L0"),
        (lambda c: servos(c, model="prescribed"), "/C/J0"),
        (lambda c: servos(c, rotor=replace(ROTOR, gear_stiffness=9.0)), "/C/J0"),
    ],
    ids=["chain", "mass", "ideal", "gear"],
)
def test_what_has_no_place_in_it_is_refused(change, path):
    with pytest.raises(ShotError, match="no place in the lumped model") as caught:
        lumped_mjcf(change(servos(chain(2, driven=(0, 1)))))
    assert caught.value.path == path
