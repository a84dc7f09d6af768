"""Commands of the rigid robot's inverse: compliant motors then do what ideal ones do."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.model import Motor
from calmotion.model.motor import Quadratic, Rotor
from calmotion.multibody.motors.inverse import inverse_commands, rotor_efforts
from motor_runs import pitch, run

H = 1e-3
TIMES = H * np.arange(700)
WAVE = np.pi * np.clip((TIMES - 0.1) / 0.5, 0.0, 1.0)
CURVE = (0.4 * np.sin(WAVE) ** 4)[:, None]
SERVO = {"model": "servo", "rotor": Rotor(0.05, np.inf, 0.0, 0.5, 0.3), "max_torque": 60.0}
LOADED = {
    "model": "servo",
    "rotor": Rotor(0.05, np.inf, 0.0, 0.3, 0.3, back_emf=0.2, law=Quadratic(0.2, 0.3, 1.2, 0.1, 0.05, 0.02, 0.1, 0.01)),
}
GEAR = {"model": "servo", "rotor": replace(SERVO["rotor"], gear_stiffness=900.0)}


@pytest.mark.parametrize(
    ("kind", "more"),
    [
        ("joint", {"model": "drive"}),
        ("error", {"model": "drive"}),
        ("joint", SERVO),
        ("error", SERVO),
        ("joint", GEAR),
        ("error", LOADED),
    ],
    ids=["damped drive", "drive", "damped servo", "servo", "gear", "friction by load"],
)
def test_motors_on_the_commands_do_what_ideal_ones_do(kind, more):
    character = chain(1, driven=(0,), length=0.4, mass=0.8)
    gains = {"position_gain": 150.0, "velocity_gain": 12.0, "damping_on": kind} | more
    motors = tuple(replace(motor, **gains) for motor in character.motors)

    def performed(character, curve):
        model = compiled(character)
        found, loads = run(model, curve, np.gradient(curve, H, axis=0), H)
        return pitch(found.states), model.motor_values(loads.efforts)

    intended, efforts = performed(character, CURVE)
    giving = replace(character, motors=motors)
    followed, _ = performed(giving, inverse_commands(motors, TIMES, CURVE, efforts))
    lagging, _ = performed(giving, CURVE)
    off = np.abs(followed - intended).max()
    assert off < 2e-3 < 0.1 * np.abs(lagging - intended).max()


@pytest.mark.parametrize("kind", [SERVO, LOADED], ids=["servo", "friction by load"])
def test_efforts_on_the_rotors_of_ideal_motors_are_those_of_servos_that_do_the_same(kind):
    character = chain(1, driven=(0,), length=0.4, mass=0.8)
    motor = replace(character.motors[0], position_gain=150.0, velocity_gain=12.0, damping_on="error", **kind)
    ideal = compiled(character)
    loads = ideal.motor_values(run(ideal, CURVE, np.gradient(CURVE, H, axis=0), H)[1].efforts)
    commands = inverse_commands((motor,), TIMES, CURVE, loads)
    giving = compiled(replace(character, motors=(motor,)))
    done = giving.motor_values(run(giving, commands, np.gradient(commands, H, axis=0), H)[1].efforts)[:, 0]
    found = rotor_efforts(motor.rotor, TIMES, CURVE[:, 0], loads[:, 0])
    off, rubs = (np.abs(done - other)[5:-5].mean() for other in (found, loads[:, 0]))
    assert off < 0.02 * np.abs(done).mean() and off < 0.1 * rubs


def test_late_motors_are_commanded_earlier_ideal_ones_what_they_do_and_no_motor_more_than_it_has():
    late = Motor(0, "", "", model="drive", position_gain=100.0, delay=0.05)
    weak = Motor(1, "", "", model="servo", position_gain=100.0, max_torque=10.0)
    values = np.column_stack([TIMES, TIMES, 0.0 * TIMES])
    efforts = np.column_stack([0.0 * TIMES, TIMES, 40.0 + 0.0 * TIMES])
    found = inverse_commands((late, Motor(2, "", ""), weak), TIMES, values, efforts)
    assert found[:-60, 0] == pytest.approx(TIMES[:-60] + 0.05)
    assert np.array_equal(found[:, 1], TIMES)
    assert found[:, 2] == pytest.approx(0.095)
