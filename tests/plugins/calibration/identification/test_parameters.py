"""Which parameters are estimated, and their priors."""

import dataclasses

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model.motor import DRIVE, SERVO, Rotor
from calmotion.simulation.compiled_shot import compile_shot
from calmotion_plugins.calibration.identification.parameters import robot_parameters
from calmotion_plugins.calibration.model.kinds import ROBOT_KINDS


@pytest.fixture(scope="module")
def shot(arm, animation, bodies):
    return compile_shot(arm, animation, bodies)


def with_motor(shot, **values):
    first, second = shot.character.motors
    motors = (dataclasses.replace(first, **values), second)
    return compile_shot(dataclasses.replace(shot.character, motors=motors), shot.animation, shot.bodies)


def test_parameters_are_those_of_the_materials_and_the_payload(shot):
    found = robot_parameters(shot)
    assert [p.name for p in found] == [
        "modulus /Arm/Nylon",
        "damping /Arm/Nylon",
        "mass /Arm/Hand",
        "higher_modes /Arm/Nylon",
    ]
    assert [p.nominal for p in found] == [2e9, 0.015, 0.5, 0.0]


def test_motors_that_give_have_gains_and_a_delay_and_servos_what_the_shot_guesses(shot):
    driven = with_motor(shot, model=DRIVE, position_gain=100.0, velocity_gain=2.0)
    names = [p.name for p in robot_parameters(driven) if p.path == "/Arm/Shoulder"]
    assert names == ["position_gain /Arm/Shoulder", "velocity_gain /Arm/Shoulder", "delay /Arm/Shoulder"]
    rotor = Rotor(armature=0.01, gear_stiffness=500.0)
    servo = with_motor(shot, model=SERVO, position_gain=100.0, rotor=rotor)
    kinds = {p.kind for p in robot_parameters(servo) if p.path == "/Arm/Shoulder"}
    assert kinds == {"position_gain", "gear_stiffness", "armature", "delay"}


def test_patterns_choose_paths_and_priors_replace_the_usual_ones(shot):
    found, graded = robot_parameters(shot, ("modulus:*Nylon",), {"modulus": 0.1})
    assert graded.name == "higher_modes /Arm/Nylon" and graded.kind not in ROBOT_KINDS
    assert found.spread == pytest.approx(np.log(1.1))
    centre = robot_parameters(shot, ("centre",))
    assert [p.name for p in centre] == [f"centre /Arm/Hand.{axis}" for axis in "xyz"] and centre[0].nominal == 0.03
    offsets = robot_parameters(shot, ("encoder_offset:/Arm/Elbow",))
    assert [p.name for p in offsets] == ["encoder_offset /Arm/Elbow"]


@pytest.mark.parametrize(
    ("wanted", "priors", "match"),
    [
        (("modulus:/Arm/Nylom",), {}, "/Arm/Nylon"), (("modulos",), {}, "modulus"),
        (("modulus",), {"modulus": 0.0}, "positive"),
        (("armature",), {}, "no parameter of these kinds"), (("modulus",), {"stiffness": 0.1}, "no such kind"),
    ],
)  # fmt: skip
def test_what_the_robot_does_not_have_is_refused(shot, wanted, priors, match):
    with pytest.raises(ShotError, match=match):
        robot_parameters(shot, wanted, priors)


def test_a_link_whose_mass_is_authored_has_no_density(shot):
    assert [p.name for p in robot_parameters(shot, ("density",))] == ["density /Arm/Nylon"]
    heavy = [
        dataclasses.replace(body, mass=shot.character.bodies[2].mass) if body.flexible else body
        for body in shot.character.bodies
    ]
    character = dataclasses.replace(shot.character, bodies=tuple(heavy))
    with pytest.raises(ShotError, match="no parameter of these kinds"):
        robot_parameters(compile_shot(character, shot.animation, shot.bodies), ("density",))
