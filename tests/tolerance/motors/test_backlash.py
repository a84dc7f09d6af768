"""Backlash: reversals of torques, and the way that play moves targets, in closed form and in closed chains."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain
from calmotion.model import Animation, MassProperties, Track
from calmotion.model.motor import Rotor
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.tolerance.motors.backlash import sides, transmitted_efforts, with_lost_motion
from calmotion.tolerance.motors.friction_band import with_friction_band
from calmotion.workflow.report import lost_motion
from linkage_arm import FORE, linkage_arm, performance

FRAMES = np.arange(61) / 30.0
OPTIONS = RunSettings(step=1 / 240)
PLAY, LENGTH = np.radians(0.5), 0.6


def quiet(fraction, message):
    pass


def simulated(character, *angles, cyclic=False):
    tracks = tuple(Track(FRAMES, np.asarray(part, float)) for part in angles)
    shot = compile_shot(character, Animation(FRAMES, tracks, tracks))
    return shot, simulate_shot(shot, OPTIONS, quiet)


def pendulum(backlash=PLAY, **motor):
    character = chain(1, driven=(0,), length=LENGTH)
    motors = tuple(replace(m, backlash=backlash, **motor) for m in character.motors)
    return replace(character, motors=motors)


def slow(first, last):
    """From one angle to the other and no faster than gravity alone decides the torque."""
    s = FRAMES / FRAMES[-1]
    return first + (last - first) * (10 * s**3 - 15 * s**4 + 6 * s**5)


@pytest.mark.parametrize("model", ["prescribed", "drive", "servo"])
def test_pendulum_that_passes_below_its_pivot_crosses_its_play_once(model):
    # the angle turns x towards -z: it hangs straight down at 90 degrees
    gains = {"model": model, "position_gain": 4e3, "velocity_gain": 20.0, "rotor": Rotor(0.3, 5e4, 10.0)}
    shot, result = simulated(pendulum(**gains), slow(1.2, 2.0))
    (lost,) = with_lost_motion(shot, result, OPTIONS).lost_motion
    motion = result.before.motion
    below = motion.times[np.argmin(np.abs(motion.motor_values[:, 0] - np.pi / 2))]
    assert [len(times) for times in lost.reversals] == [1]
    assert lost.reversals[0][0] == pytest.approx(below, abs=0.08)
    tip = np.linalg.norm(motion.target_positions[0, 0])
    assert lost.largest_m == pytest.approx([2 * tip * np.sin(PLAY / 2)], rel=1e-6)
    assert lost.time_s[0] >= lost.reversals[0][0] - 1e-9


def test_what_a_gear_transmits_is_the_weight_and_the_inertia_of_the_link():
    shot, result = simulated(
        pendulum(model="servo", position_gain=4e3, velocity_gain=20.0, rotor=Rotor(0.3)), slow(1.2, 2.0)
    )
    motion, h = result.before.motion, result.step_s
    spin = np.gradient(np.unwrap(2 * np.arctan2(motion.rotations[:, 0, 2], motion.rotations[:, 0, 0])), h)
    turn = np.gradient(spin, h)
    mass = shot.character.bodies[0].mass
    arm = mass.mass * 9.81 * np.linalg.norm(shot.character.joints[0].frame1.position - mass.center)
    angle = np.unwrap(2 * np.arctan2(motion.rotations[:, 0, 2], motion.rotations[:, 0, 0]))
    inertia = mass.inertia[1, 1] + mass.mass * np.sum((shot.character.joints[0].frame1.position - mass.center) ** 2)
    expected = inertia * turn - arm * np.cos(angle)
    found = transmitted_efforts(shot.character, motion)[:, 0]
    assert found[5:-5] == pytest.approx(expected[5:-5], abs=0.02 * np.abs(expected).max())
    assert np.abs(found - motion.motor_efforts[:, 0]).max() > 0.05 * np.abs(expected).max(), "the rotor takes a part"


def test_torque_that_keeps_its_sign_costs_nothing_and_without_play_nothing_is_told():
    shot, result = simulated(pendulum(), slow(0.2, 0.9))
    (lost,) = with_lost_motion(shot, result, OPTIONS).lost_motion
    assert not len(lost.reversals[0]) and lost.largest_m == pytest.approx([0.0], abs=1e-12)
    shot, result = simulated(pendulum(0.0), slow(0.2, 0.9))
    assert with_lost_motion(shot, result, OPTIONS) is result


def test_a_gear_stays_on_its_side_while_hardly_anything_pushes_it():
    push = np.array([0.0, 0.01, 1.0, 0.01, -0.015, 0.01, -0.5, -0.01, 0.01, 0.3])
    assert list(sides(push)) == [1, 1, 1, 1, 1, 1, -1, -1, -1, 1]
    assert list(sides(np.zeros(3))) == [0, 0, 0]


def test_play_of_a_crank_moves_the_hand_through_its_linkage():
    character, _ = linkage_arm()
    rod = MassProperties(0.3, np.array([0.15, 0.0, 0.0]), np.diag([1e-4, 2e-3, 2e-3]))
    bodies = tuple(replace(body, mass=body.mass or rod, flexible=None) for body in character.bodies)
    motors = tuple(replace(motor, backlash=PLAY if k == 2 else 0.0) for k, motor in enumerate(character.motors))
    animation = performance(3.0)
    shot = compile_shot(replace(character, bodies=bodies, motors=motors), animation)
    result = simulate_shot(shot, OPTIONS, quiet)
    (lost,) = with_lost_motion(shot, result, OPTIONS).lost_motion
    assert lost.motors == (2,) and lost.unknown == () and len(lost.reversals[0]) >= 1
    # crank and lever are alike: the forearm turns by the play
    assert lost.largest_m[1] == pytest.approx(FORE * PLAY, rel=0.02) and lost.largest_m[0] < 1e-6


def test_report_has_reversals_and_the_way_of_each_target():
    shot, result = simulated(pendulum(), slow(1.2, 2.0))
    result = with_lost_motion(shot, result, OPTIONS)
    told = lost_motion(shot.character, result)
    assert told["motors"][0]["reversals"] == 1 and told["motors"][0]["backlash_rad"] == PLAY
    assert told["targets"][0]["max_error_m"] == result.lost_motion[0].largest_m[0]
    told = lost_motion(shot.character, replace(result, after=result.before, lost_motion=2 * result.lost_motion))
    assert told["motors"][0]["reversals_before"] == told["motors"][0]["reversals_after"] == 1


def test_friction_may_hold_a_pendulum_within_itself_over_the_gain():
    """0.3 N m over 150 N m/rad, at the end of the link; nothing by a drive."""
    servo = pendulum(0.0, model="servo", position_gain=150.0, velocity_gain=5.0, rotor=Rotor(friction=0.3))
    shot, result = simulated(servo, slow(0.2, 0.4))
    found = with_friction_band(shot, result, OPTIONS).friction_band_m
    assert found == pytest.approx([LENGTH * 0.3 / 150.0], rel=1e-4)
    drive = pendulum(0.0, model="drive", position_gain=150.0, velocity_gain=5.0)
    shot, result = simulated(drive, slow(0.2, 0.4))
    assert with_friction_band(shot, result, OPTIONS) is result
