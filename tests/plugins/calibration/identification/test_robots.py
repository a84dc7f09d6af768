"""Robots with other parameters, against robots that are reduced anew."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.motor import DRIVE
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.preparation import pose_modes
from calmotion_plugins.calibration.identification.robots import robot_with
from calmotion_plugins.calibration.model.kinds import CENTRE, DAMPING, DELAY, DENSITY, ENCODER_OFFSET, MASS, MODULUS

NYLON, HAND = "/Arm/Nylon", "/Arm/Hand"


@pytest.fixture(scope="module")
def shot(arm, animation, bodies):
    return compile_shot(arm, animation, bodies)


def reduced_anew(arm, animation, meshes, mass=None, **material):
    """The shot of an arm with another material, from its meshes."""
    given = arm.bodies[0].flexible
    own = dataclasses.replace(given, material=dataclasses.replace(given.material, **material))
    changed = [dataclasses.replace(body, flexible=own) if body.flexible else body for body in arm.bodies]
    if mass is not None:
        given = changed[2].mass
        factor = mass / given.mass
        changed[2] = dataclasses.replace(
            changed[2], mass=dataclasses.replace(given, mass=mass, inertia=factor * given.inertia)
        )
    character = dataclasses.replace(arm, bodies=tuple(changed))
    return compile_shot(character, animation, reduce_bodies(character, span_tree(character), meshes))


def test_modulus_damping_density_and_mass_are_those_of_a_robot_that_is_reduced_anew(shot, arm, animation, meshes):
    other = reduced_anew(arm, animation, meshes, mass=0.6, youngs_modulus=2.4e9, damping_ratio=0.03, density=1210.0)
    values = {
        (MODULUS, NYLON, -1): 2.4e9, (DAMPING, NYLON, -1): 0.03, (DENSITY, NYLON, -1): 1210.0, (MASS, HAND, -1): 0.6,
    }  # fmt: skip
    frequencies, ratios = pose_modes(robot_with(shot, values).shot)
    expected, expected_ratios = pose_modes(other)
    low = expected < 300.0  # higher modes depend on which ones a reduction keeps
    assert low.sum() >= 4
    assert frequencies[: low.sum()] == pytest.approx(expected[low], rel=2e-3)
    assert ratios[: low.sum()] == pytest.approx(expected_ratios[low], rel=2e-2)


def test_the_damping_is_that_of_the_new_masses(shot):
    frequencies, ratios = pose_modes(robot_with(shot, {(MASS, HAND, -1): 1.0}).shot)
    nominal, nominal_ratios = pose_modes(shot)
    assert frequencies[0] < 0.9 * nominal[0]
    assert ratios[:2] == pytest.approx(nominal_ratios[:2], rel=0.05)


def test_a_denser_material_has_more_of_every_mass_and_the_same_static_deflection(shot):
    denser = robot_with(shot, {(DENSITY, NYLON, -1): 2200.0}).shot
    for own, other in zip(shot.bodies[:2], denser.bodies[:2], strict=True):
        assert other.invariants.mass == pytest.approx(2.0 * own.invariants.mass)
        assert np.allclose(other.invariants.M, own.invariants.M, atol=1e-9)
        for marker, same in zip(own.markers, other.markers, strict=True):
            compliance = (marker.Phi / own.stiffness) @ marker.Phi.T
            assert np.allclose((same.Phi / other.stiffness) @ same.Phi.T, compliance, rtol=1e-9)


def test_a_centre_moves_the_inertia_with_it(shot, arm):
    values = {(CENTRE, HAND, 0): 0.05, (CENTRE, HAND, 1): 0.01, (MASS, HAND, -1): 0.5}
    found = robot_with(shot, values).shot.bodies[2].invariants
    given = arm.bodies[2].mass
    center = np.array([0.05, 0.01, given.center[2]])
    about = 0.5 * np.trace(given.inertia) * np.eye(3) - given.inertia
    assert np.allclose(found.s, 0.5 * center)
    assert np.allclose(found.Z, about + 0.5 * np.outer(center, center))


def test_motors_have_other_gains_and_encoders_offsets(shot):
    first, second = shot.character.motors
    driven = dataclasses.replace(first, model=DRIVE, position_gain=100.0)
    character = dataclasses.replace(shot.character, motors=(driven, second))
    first_path, second_path = first.path, second.path
    values = {
        ("position_gain", first_path, -1): 80.0, (DELAY, first_path, -1): 0.01, (ENCODER_OFFSET, second_path, -1): 0.02,
    }  # fmt: skip
    robot = robot_with(compile_shot(character, shot.animation, shot.bodies), values)
    assert robot.shot.character.motors[0].position_gain == 80.0 and robot.shot.model.delays == (0.01, 0.0)
    assert robot.offsets.tolist() == [0.0, 0.02]
