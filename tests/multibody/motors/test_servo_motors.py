"""Servos: closed-form two-mass frequencies, ordinary differential equations, energy, and their limits."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain, compiled, frame
from calmotion.model import Body, Character, Joint, MassProperties, Motor
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.modes import system_modes
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.motors.servos import motor_effort
from calmotion.multibody.statics.equilibrium import equilibrium
from motor_runs import INERTIA, LENGTH, MASS, G, pendulum, pitch, run, servo, smooth
from scipy.integrate import solve_ivp


def test_two_mass_joint_has_its_closed_form_resonance_and_antiresonance():
    k, inertia = 300.0, 0.04
    free, _ = system_modes(pendulum(1e-7, 0.0, gravity=0.0, armature=inertia, gear_stiffness=k), np.zeros(1))
    held, _ = system_modes(pendulum(1e9, 0.0, gravity=0.0, armature=inertia, gear_stiffness=k), np.zeros(1))
    assert 2 * np.pi * free[-1] == pytest.approx(np.sqrt(k * (1 / INERTIA + 1 / inertia)), rel=1e-6)
    assert free[0] < 1e-2
    assert 2 * np.pi * held[0] == pytest.approx(np.sqrt(k / INERTIA), rel=1e-6)


def test_two_masses_on_a_slider_have_their_closed_form_frequencies_and_sag():
    k, gear, mass, inertia, d = 900.0, 5e3, 2.0, 0.7, 4.0
    up = np.array([1.0, 0.0, 0.0, 0.0])
    bodies = (Body("/C/A", frame(), MassProperties(mass, np.array([0.1, 0.0, 0.0]), 0.01 * np.eye(3))),)
    joints = (Joint("/C/J", "prismatic", -1, 0, frame(rotation=up), frame(rotation=up)),)
    motors = (Motor(0, "/C/J", "linear", linear=True),)
    lift = Character("/C", bodies, joints, motors, (), np.array([0.0, 0.0, -G]))
    model = servo(lift, k, d, armature=inertia, gear_stiffness=gear)
    # M x'' + K x = 0 of the rotor and of the carriage
    matrix = np.array([[k + gear, -gear], [-gear, gear]]) / np.array([[inertia], [mass]])
    frequencies, _ = system_modes(model, np.zeros(1))
    assert 2 * np.pi * frequencies == pytest.approx(np.sqrt(np.sort(np.linalg.eigvals(matrix).real)), rel=1e-3)
    weightless = replace(lift, gravity=np.zeros(3))
    free, _ = system_modes(servo(weightless, 1e-7, 0.0, armature=inertia, gear_stiffness=gear), np.zeros(1))
    assert 2 * np.pi * free[-1] == pytest.approx(np.sqrt(gear * (1 / mass + 1 / inertia)), rel=1e-6)
    still = np.zeros((3, 1))
    found, loads = run(model, still, still, 1e-2)
    assert found.states.c[0, 0, 2] == pytest.approx(-mass * G * (1 / k + 1 / gear), rel=1e-9)
    assert loads.efforts[0] == pytest.approx([mass * G], rel=1e-9)


@pytest.mark.parametrize("rotor", [{}, {"armature": 0.03, "gear_stiffness": 400.0}])
def test_a_pose_far_from_the_last_one_has_its_equilibrium_though_the_motor_is_weak(rotor):
    """The rotor would stand where it was: a hundred times as far as the largest torque reaches."""
    model, command = pendulum(900.0, 1.0, 9.0, gravity=0.0, **rotor), np.array([1.1])
    workspace = Workspace.for_system(model.system)
    last, _ = equilibrium(model.system, rigid_state(model, np.zeros(1)), np.zeros(1), workspace)
    found, _ = equilibrium(model.system, last, command, workspace)
    assert 2 * np.arctan2(found.q[0, 2], found.q[0, 0]) == pytest.approx(1.1, abs=1e-7)


def slope_of(k, d, limit, rotor):
    """The equations of a pendulum on a servo: angle and rate of the link, then of the rotor."""
    motor = np.array([k, d, 0.0, 1.0, limit, 1 / rotor["no_load_speed"], rotor["knee"]])

    def slope(t, y):
        (command,), (rate,) = (part[0] for part in smooth(np.array([t])))
        gear = rotor["gear_stiffness"] * (y[2] - y[0]) + rotor["gear_damping"] * (y[3] - y[1])
        effort = motor_effort(motor, k * (command - y[2]) + d * (rate - y[3]), y[3])[0]
        drag = rotor["viscous_friction"] * y[3] + rotor["friction"] * np.tanh(y[3] / rotor["friction_speed"])
        moved = gear + MASS * G * LENGTH * np.cos(y[0])
        return [y[1], moved / INERTIA, y[3], (effort - drag - gear) / rotor["armature"]]

    return slope


def test_pendulum_on_a_servo_moves_as_its_differential_equations_say():
    k, d, limit = 90.0, 1.0, 9.0
    rotor = {
        "armature": 0.03, "gear_stiffness": 400.0, "gear_damping": 0.5, "viscous_friction": 0.1, "friction": 0.3,
        "friction_speed": 0.3, "no_load_speed": 14.0, "knee": 0.3,
    }  # fmt: skip
    slope = slope_of(k, d, limit, rotor)
    # at rest both springs carry the weight
    theta = 0.0
    for _ in range(100):
        theta = MASS * G * LENGTH * np.cos(theta) * (1 / k + 1 / rotor["gear_stiffness"])
    phi = MASS * G * LENGTH * np.cos(theta) / k
    exact = solve_ivp(slope, (0, 0.8), [theta, 0.0, phi, 0.0], "Radau", rtol=1e-10, atol=1e-12, dense_output=True)
    model, errors = pendulum(k, d, limit, **rotor), []
    for h in (2e-3, 1e-3):
        times = np.arange(0.0, 0.8, h)
        found, loads = run(model, *smooth(times), h)
        expected = exact.sol(times)
        errors.append(np.abs(pitch(found.states) - expected[0]).max())
        assert np.abs(found.states.u[:, 0, 0] - expected[2]).max() < 3 * errors[-1]
        assert np.abs(loads.efforts).max() <= limit
    assert np.abs(loads.efforts).max() > 0.9 * limit, "the motor reaches its limit"
    assert errors[1] < 3e-3 and np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3), errors


def test_a_rotor_without_inertia_between_two_springs_has_the_frequency_of_both():
    """Of `k` and the gear in series: the rotor follows in equilibrium."""
    k, gear = 90.0, 300.0
    frequencies, damping = system_modes(pendulum(k, 1.5, gravity=0.0, gear_stiffness=gear), np.zeros(1))
    both = k * gear / (k + gear)
    assert 2 * np.pi * frequencies == pytest.approx([np.sqrt(both / INERTIA)], rel=1e-6)
    # at low speed the damper has the share of the motion that the rotor makes
    assert damping == pytest.approx([1.5 * (gear / (k + gear)) ** 2 / (2 * np.sqrt(both * INERTIA))], rel=1e-6)


def test_servo_without_rotor_and_gear_is_a_drive():
    character = chain(2, driven=(0, 1), length=0.3)
    times = np.arange(0.0, 0.4, 2e-3)
    curve, rate = (np.hstack([part, -0.5 * part]) for part in smooth(times))
    # the rate of the command is that of the curve here, and the difference of its values there
    drives = tuple(replace(m, model="drive", position_gain=200.0) for m in character.motors)
    one, of_one = run(servo(character, 200.0, 0.0), curve, rate, 2e-3)
    other, of_other = run(compiled(replace(character, motors=drives)), curve, rate, 2e-3)
    assert np.abs(one.states.c - other.states.c).max() < 1e-9
    assert np.abs(of_one.efforts - of_other.efforts).max() < 1e-6 * np.abs(of_other.efforts).max()


def test_stiff_servos_converge_to_ideal_motors_at_first_order():
    character, h = chain(2, driven=(0, 1), length=0.3), 2e-3
    times = np.arange(0.0, 0.4, h)
    curve, rate = (np.hstack([part, -0.5 * part]) for part in smooth(times))
    ideal, _ = run(compiled(character), curve, rate, h)
    gaps = []
    for k in (1e5, 1e6, 1e7):
        model = servo(character, k, 2e-3 * k, armature=0.01, gear_stiffness=3 * k, gear_damping=6e-3 * k)
        found, _ = run(model, curve, rate, h)
        gaps.append(np.abs(found.states.c - ideal.states.c).max())
    assert np.log10(np.array(gaps[:-1]) / gaps[1:]) == pytest.approx(1.0, abs=0.03), gaps


def test_energy_of_link_rotor_and_gear_changes_by_the_work_of_the_motor_at_second_order():
    k, inertia, gear = 80.0, 0.05, 250.0
    model, errors = pendulum(k, 0.5, armature=inertia, gear_stiffness=gear), []
    for h in (2e-3, 1e-3):
        times = np.arange(0.0, 0.8, h)
        found, loads = run(model, *smooth(times), h)
        psi, speed, spin = found.states.u[:, 0, 1], found.states.V[:, 0, 6], found.states.V[:, 0, 4]
        kinetic = 0.5 * INERTIA * spin**2 + 0.5 * inertia * speed**2
        energy = kinetic - MASS * G * LENGTH * np.sin(pitch(found.states)) + 0.5 * gear * psi**2
        power = loads.efforts[:, 0] * speed
        work = np.concatenate([[0.0], np.cumsum(0.5 * h * (power[1:] + power[:-1]))])
        errors.append(np.abs(energy - energy[0] - work).max() / np.ptp(energy))
    assert errors[1] < 1e-2 and np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3), errors
