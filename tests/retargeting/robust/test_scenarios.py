"""Robots that differ from the model."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.motor import DRIVE
from calmotion.model.uncertainty import KnownFactors, Scenario, Uncertainty
from calmotion.reduction.damping import damped
from calmotion.retargeting.robust.scenarios import (
    payload_bodies,
    random_scenarios,
    scaled_body,
    scenario_at,
    shot_of,
    uncertain_parameters,
)
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.preparation import pose_modes


@pytest.fixture(scope="module")
def shot(arm, animation, bodies):
    return compile_shot(arm, animation, bodies)


def uncertain(shot, **values):
    retarget = dataclasses.replace(shot.character.retarget, uncertainty=Uncertainty(**values))
    return shot.with_character(dataclasses.replace(shot.character, retarget=retarget))


def all_at(shot, kind, factor):
    """The shot with all parameters of a kind multiplied by a factor."""
    names = [p.name for p in uncertain_parameters(shot) if p.name.startswith(kind)]
    assert names
    return shot_of(shot, Scenario(dict.fromkeys(names, factor)))


def test_parameters_are_those_of_the_materials_and_of_the_payload(shot):
    names = [p.name for p in uncertain_parameters(shot)]
    assert [name.split()[0] for name in names] == ["modulus", "damping", "payload"]
    assert uncertain_parameters(shot)[0].spread == pytest.approx(np.log(1.1))
    assert [p.name for p in uncertain_parameters(uncertain(shot, modulus=0.0, damping=0.0))] == ["payload"]
    assert uncertain_parameters(uncertain(shot, modulus=0.0, damping=0.0, payload=0.0)) == ()


def test_frequencies_follow_the_square_root_of_the_modulus_and_damping_ratios_stay(shot):
    # in the pose of least gravity, which adds a stiffness that no modulus scales
    weightless = dataclasses.replace(shot.character, gravity=np.zeros(3))
    shot = compile_shot(weightless, shot.animation, shot.bodies)
    (omega, ratio), (scaled, scaled_ratio) = pose_modes(shot), pose_modes(all_at(shot, "modulus", 1.21))
    assert scaled == pytest.approx(1.1 * omega, rel=1e-6)
    assert scaled_ratio == pytest.approx(ratio, rel=1e-6)


def test_damping_ratios_follow_the_damping(shot):
    (omega, ratio), (same, scaled) = pose_modes(shot), pose_modes(all_at(shot, "damping", 1.5))
    assert same[:3] == pytest.approx(omega[:3], rel=1e-3)  # damped modes couple
    assert scaled[:3] == pytest.approx(1.5 * ratio[:3], rel=1e-3)


def test_a_heavier_payload_has_more_mass_and_inertia_and_nothing_else(shot):
    ends = payload_bodies(shot)
    heavier = all_at(shot, "payload", 2.0)
    for k, (body, other) in enumerate(zip(shot.bodies, heavier.bodies, strict=True)):
        factor = 2.0 if k in ends else 1.0
        assert other.invariants.mass == factor * body.invariants.mass
        assert np.array_equal(other.invariants.Z, factor * body.invariants.Z)
    assert ends and all(not shot.character.bodies[k].simulated_flexible for k in ends)


@pytest.mark.parametrize("rayleigh", [None, (0.4, 2e-4)])
def test_a_scaled_body_is_damped_as_one_of_that_material(shot, bodies, arm, rayleigh):
    index = next(k for k, body in enumerate(arm.bodies) if body.simulated_flexible)
    material = dataclasses.replace(arm.bodies[index].flexible.material, rayleigh=rayleigh)
    body = damped(bodies[index], material)
    stiffer = dataclasses.replace(body, stiffness=1.44 * body.stiffness)
    scaled = scaled_body(body, material, 1.44, 1.0)
    assert np.allclose(scaled.damping, damped(stiffer, material).damping, rtol=1e-12)
    assert np.allclose(scaled_body(body, material, 1.0, 2.0).damping, 2.0 * body.damping)


def test_the_nominal_robot_is_the_shot_itself(shot):
    parameters = uncertain_parameters(shot)
    assert shot_of(shot, scenario_at(parameters, np.zeros(len(parameters)))) is shot


def test_random_robots_have_the_given_spread_and_are_the_same_in_every_run(shot):
    parameters = uncertain_parameters(shot)
    drawn, again = random_scenarios(parameters, 2000), random_scenarios(parameters, 2000)
    assert [s.factors for s in drawn] == [s.factors for s in again]
    for p in parameters:
        logarithms = np.log([s.factors[p.name] for s in drawn])
        assert abs(logarithms.mean()) < 0.1 * p.spread and logarithms.std() == pytest.approx(p.spread, rel=0.05)


def calibrated(shot, names, covariance):
    known = KnownFactors(names, tuple(map(tuple, covariance)))
    given = dataclasses.replace(shot.character.retarget.uncertainty, calibrated=known)
    retarget = dataclasses.replace(shot.character.retarget, uncertainty=given)
    return shot.with_character(dataclasses.replace(shot.character, retarget=retarget))


def test_robots_of_a_calibrated_shot_have_its_covariance(shot):
    names = ("modulus /Arm/Nylon", "mass /Arm/Hand", "modulus /Arm/Other")
    covariance = np.array([[4e-4, 3e-4, 0.0], [3e-4, 2.5e-4, 0.0], [0.0, 0.0, 1.0]])
    parameters = uncertain_parameters(calibrated(shot, names, covariance.tolist()))
    # what the calibration does not tell is as the shot says; the mass of the hand is no longer a payload's
    assert [p.name for p in parameters] == ["damping /Arm/Nylon", "modulus /Arm/Nylon", "mass /Arm/Hand"]
    drawn = random_scenarios(parameters, 4000)
    logs = np.array([[np.log(s.factors[name]) for name in names[:2]] for s in drawn])
    assert np.cov(logs.T) == pytest.approx(covariance[:2, :2], rel=0.1)


def test_the_gains_of_a_motor_that_gives_have_a_common_factor_unless_they_are_known(shot):
    first, second = shot.character.motors
    driven = dataclasses.replace(first, model=DRIVE, position_gain=100.0, velocity_gain=2.0)
    gives = shot.with_character(dataclasses.replace(shot.character, motors=(driven, second)))
    (gains,) = [p for p in uncertain_parameters(gives) if p.name.startswith("position_gain")]
    assert gains.name.endswith(first.path) and gains.spread == pytest.approx(np.log(1.2))
    motor = shot_of(gives, scenario_at((gains,), np.array([2.0]))).character.motors[0]
    assert (motor.position_gain, motor.velocity_gain) == (pytest.approx(144.0), pytest.approx(2.88))
    known = calibrated(gives, (f"position_gain {first.path}",), [[1e-4]])
    told = {p.name: p.spread for p in uncertain_parameters(known)}
    assert told[f"position_gain {first.path}"] == pytest.approx(0.01)
    assert told[f"velocity_gain {first.path}"] == pytest.approx(np.log(1.2))
    assert not any("gain" in p.name for p in uncertain_parameters(uncertain(gives, gains=0.0)))


def test_a_robot_of_a_calibrated_shot_has_other_masses_and_gains(shot):
    first, second = shot.character.motors
    driven = dataclasses.replace(first, model=DRIVE, position_gain=100.0, velocity_gain=2.0, delay=0.01)
    character = dataclasses.replace(shot.character, motors=(driven, second))
    gives = compile_shot(character, shot.animation, shot.bodies)
    factors = {f"position_gain {first.path}": 0.9, f"delay {first.path}": 1.5, "mass /Arm/Hand": 1.2, "payload": 3.0}
    other = shot_of(gives, Scenario(factors))
    motor = other.character.motors[0]
    assert (motor.position_gain, motor.velocity_gain) == (pytest.approx(90.0), 2.0)
    assert other.model.delays[0] == pytest.approx(0.015)
    hand = next(k for k, body in enumerate(shot.character.bodies) if body.path == "/Arm/Hand")
    assert other.bodies[hand].invariants.mass == pytest.approx(1.2 * shot.bodies[hand].invariants.mass)
