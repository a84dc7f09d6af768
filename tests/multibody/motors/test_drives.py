"""Drives: closed-form pendulums and carriages, the ideal motor as their limit, energy, turns, generalised-alpha."""

from dataclasses import replace

import numpy as np
import pytest
from arms import Z_TO_Y, chain, compiled, frame
from calmotion.errors import ShotError
from calmotion.model import Body, Character, Joint, MassProperties, Motor
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.modes import system_modes
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import rigid_model
from calmotion.multibody.model.system import STVK
from calmotion.multibody.motors.drives import GivingMotor, add_motors, giving_motors
from calmotion.multibody.runs import simulate
from calmotion.multibody.statics.equilibrium import equilibrium
from motor_runs import pitch, run, smooth, transmitted
from particles import particle_system
from scipy.integrate import solve_ivp

G = 9.81


def driven(character, k, d=0.0, on="error", **changes):
    """The character with all motors as drives of these gains."""
    motors = tuple(replace(m, model="drive", position_gain=k, velocity_gain=d, damping_on=on) for m in character.motors)
    return compiled(replace(character, motors=motors, **changes))


@pytest.mark.parametrize("flipped", [(), (0,)], ids=["", "flipped"])
@pytest.mark.parametrize("angle", [0.4, 1.9])
def test_pendulum_on_a_drive_has_its_closed_form_frequency_droop_and_damping(flipped, angle):
    k, d = 40.0, 0.3
    model = driven(chain(1, driven=(0,), mass=1.5, length=0.8, flipped=flipped), k, d)
    command = model.joint_angles(np.array([-angle if flipped else angle]))
    workspace = Workspace.for_system(model.system)
    state, _ = equilibrium(model.system, rigid_state(model, command), command, workspace)
    # the angle turns x towards -z: the pendulum hangs at pi / 2
    found = angle + float(state.u[0, 0]) * (1 if flipped else -1) * (-1 if flipped else 1)
    theta = float(np.arctan2(2 * state.q[0, 0] * state.q[0, 2], 1 - 2 * state.q[0, 2] ** 2))
    assert theta == pytest.approx(found, abs=1e-10)
    inertia, weight = 1.5 * 0.8**2, 1.5 * G * 0.8
    assert k * (angle - theta) + weight * np.cos(theta) == pytest.approx(0.0, abs=1e-9)
    frequencies, ratios = system_modes(model, command)
    omega = np.sqrt((k + weight * np.sin(theta)) / inertia)
    assert frequencies == pytest.approx([omega / (2 * np.pi)], rel=1e-8)
    assert ratios == pytest.approx([d / (2 * inertia * omega)], rel=1e-8)


def test_pendulum_follows_its_command_as_the_ordinary_differential_equation_says_through_turns():
    k, d, mass, length, turns = 60.0, 2.0, 0.5, 0.4, 3.0
    model = driven(chain(1, driven=(0,), mass=mass, length=length), k, d)
    inertia, end = mass * length**2, 1.0

    def command(t):
        s = np.clip(t / 0.8, 0.0, 1.0)
        return 2 * np.pi * turns * (10 * s**3 - 15 * s**4 + 6 * s**5), 2 * np.pi * turns * 30 / 0.8 * (s * (1 - s)) ** 2

    def slope(t, y):
        angle, rate = command(t)
        return [y[1], (k * (angle - y[0]) + d * (rate - y[1]) + mass * G * length * np.cos(y[0])) / inertia]

    # at rest first: k (0 - theta) + m g l cos theta = 0
    theta = float(np.linalg.norm(solve_ivp(lambda t, y: (-k * y + mass * G * length * np.cos(y)), (0, 9), [0.0],
                                           rtol=1e-12, atol=1e-14).y[:, -1]))  # fmt: skip
    exact = solve_ivp(slope, (0, end), [theta, 0.0], rtol=1e-11, atol=1e-12, dense_output=True)
    errors = []
    for h in (4e-3, 2e-3):
        times = np.arange(0.0, end + h / 2, h)
        angle, rate = command(times)
        found, loads = run(model, angle[:, None], rate[:, None], h)
        expected = exact.sol(times)[0]
        errors.append(np.abs(pitch(found.states) - expected).max())
        torque = k * (angle - expected) + d * (rate - exact.sol(times)[1])
        assert np.abs(loads.efforts[:, 0] - torque).max() < 40 * errors[-1] * k
        assert angle[-1] - found.states.u[-1, 0, 0] == pytest.approx(expected[-1], abs=5 * errors[-1])
    assert errors[1] < 2e-2 and np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.25), errors


@pytest.mark.parametrize(("integrator", "allowed"), [("bdf2", 2e-4), ("rk4", 1e-8)])
def test_drive_that_damps_the_joint_lags_behind_a_command_in_motion(integrator, allowed):
    """A mass on a spring to the command and a damper to the ground, whatever an integrator does between instants."""
    k, d, mass, length = 60.0, 2.0, 0.5, 0.4
    model = driven(chain(1, driven=(0,), mass=mass, length=length), k, d, "joint", gravity=np.zeros(3))

    def slope(t, y):
        return [y[1], (k * (smooth(np.array([t]))[0][0, 0] - y[0]) - d * y[1]) / (mass * length**2)]

    exact = solve_ivp(slope, (0, 0.8), [0.0, 0.0], rtol=1e-12, atol=1e-13, dense_output=True)
    times = np.arange(0.0, 0.8, 1e-3)
    curve, rate = smooth(times)
    found = simulate(model, curve, rate, 1e-3, integrator)
    angle, speed = exact.sol(times)
    assert np.abs(pitch(found.states) - angle).max() < allowed
    assert np.abs(found.efforts[:, 0] - k * (curve[:, 0] - angle) + d * speed).max() < 200 * k * allowed
    assert np.abs(curve[:, 0] - angle).max() > 0.05
    # limits of effort are kept by the derivatives of what the joint transmits
    through = transmitted(
        model.system, reactions(model.system, found.trajectory, found.joint_values, found.joint_rates)
    )
    assert np.abs(found.efforts - through).max() < 1e-6 * np.ptp(found.efforts)


def test_drives_of_growing_gain_converge_to_ideal_motors_at_first_order():
    character, h = chain(2, driven=(0, 1), length=0.3), 2e-3
    times = np.arange(0.0, 0.5, h)
    curve, rate = (np.hstack([part, -0.5 * part]) for part in smooth(times))
    ideal, _ = run(compiled(character), curve, rate, h)
    gaps = []
    for k in (1e5, 1e6, 1e7):
        found, _ = run(driven(character, k, 2e-3 * k), curve, rate, h)
        gaps.append(np.abs(found.states.c - ideal.states.c).max())
    assert np.log10(np.array(gaps[:-1]) / gaps[1:]) == pytest.approx(1.0, abs=0.02), gaps


def test_energy_changes_by_the_work_of_the_command_and_the_loss_of_the_damper_at_second_order():
    k, d, mass, length = 30.0, 0.2, 1.0, 0.5
    model = driven(chain(1, driven=(0,), mass=mass, length=length), k, d)
    errors = []
    for h in (2e-3, 1e-3):
        times = np.arange(0.0, 0.8, h)
        curve, rate = smooth(times)
        found, loads = run(model, curve, rate, h)
        psi, psid, spin = found.states.u[:, 0, 0], found.states.V[:, 0, 6], found.states.V[:, 0, 4]
        energy = 0.5 * mass * (length * spin) ** 2 - mass * G * length * np.sin(pitch(found.states)) + 0.5 * k * psi**2
        power = loads.efforts[:, 0] * rate[:, 0] - d * psid**2
        work = np.concatenate([[0.0], np.cumsum(0.5 * h * (power[1:] + power[:-1]))])
        errors.append(np.abs(energy - energy[0] - work).max() / np.ptp(energy))
    assert errors[1] < 1e-3 and np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.25), errors


def lift(k, d, mass=2.0):
    """A carriage that a drive moves up and down on a slider; the angle of a second motor is ideal."""
    up = np.array([1.0, 0.0, 0.0, 0.0])
    bodies = (Body("/C/A", frame(), MassProperties(mass, np.array([0.1, 0.0, 0.0]), 0.01 * np.eye(3))),)
    joints = (Joint("/C/J", "prismatic", -1, 0, frame(rotation=up), frame(rotation=up)),)
    motors = (Motor(0, "/C/J", "linear", linear=True),)
    return driven(Character("/C", bodies, joints, motors, (), np.array([0.0, 0.0, -G])), k, d)


@pytest.mark.parametrize("integrator", ["bdf2", "generalized-alpha"])
def test_carriage_on_a_drive_moves_as_a_mass_on_spring_and_damper(integrator):
    k, d, mass, h = 900.0, 12.0, 2.0, 1e-3
    model = lift(k, d, mass)
    times = np.arange(0.0, 0.6, h)
    curve, rate = smooth(times, 0.2)
    found, loads = run(model, curve, rate, h, integrator)

    def slope(t, y):
        (angle,), (speed,) = (part[0] for part in smooth(np.array([t]), 0.2))
        return [y[1], (k * (angle - y[0]) + d * (speed - y[1])) / mass - G]

    exact = solve_ivp(slope, (0, times[-1]), [-mass * G / k, 0.0], t_eval=times, rtol=1e-11, atol=1e-13).y
    assert np.abs(found.states.c[:, 0, 2] - exact[0]).max() < 2e-5
    force = k * (curve[:, 0] - exact[0]) + d * (rate[:, 0] - exact[1])
    assert np.abs(loads.efforts[:, 0] - force).max() < 5e-3 * np.abs(force).max()


def test_slider_transmits_the_moment_of_what_hangs_beside_it_wherever_the_drive_lags():
    """An arm turns on a carriage that sags on its slider: the base feels the weight at its real place."""
    bodies = tuple(Body(f"/C/{n}", frame(), MassProperties(1.0, np.zeros(3), 1e-3 * np.eye(3))) for n in "AB")
    x = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])
    joints = (
        Joint("/C/Turn", "revolute", -1, 0, frame(rotation=Z_TO_Y), frame(rotation=Z_TO_Y)),
        Joint("/C/Slide", "prismatic", 0, 1, frame(rotation=x), frame(rotation=x)),
    )
    motors = (Motor(0, "/C/Turn", "angular"), Motor(1, "/C/Slide", "linear", linear=True))
    character = Character("/C", bodies, joints, motors, (), np.array([0.0, 0.0, -G]))
    model = compiled(replace(character, motors=(motors[0], replace(motors[1], model="drive", position_gain=50.0))))
    angle, length = np.pi / 4, 0.3
    still = np.tile([angle, length], (3, 1))
    found, loads = run(model, still, np.zeros_like(still), 1e-2)
    out = length + G * np.sin(angle) / 50.0  # the angle turns x towards -z
    assert np.linalg.norm(found.states.c[0, 1]) == pytest.approx(out, rel=1e-9)
    assert loads.efforts[0] == pytest.approx([-G * out * np.cos(angle), -G * np.sin(angle)], rel=1e-8)


def test_ideal_motors_leave_the_system_as_it_is():
    character = chain(2, driven=(0, 1))
    model = driven(character, 100.0)
    assert list(model.system.elastic) == [1, 1] and list(model.system.modes) == [0, 0]
    assert compiled(character).system.size == rigid_model(model).system.size == 6


def test_drive_that_closes_a_chain_on_a_body_of_large_deflection_is_refused():
    system, _ = particle_system(np.random.default_rng(0), [-1, 0], [2, 2], loops=((-1, 1, 6),))
    motors, number = [Motor(2, "/C/Loop", "angular", model="drive", position_gain=1.0)], np.array([-1, -1, 0])
    assert giving_motors(system, number, motors) == [GivingMotor(2, motors[0])]
    wide = add_motors(system, giving_motors(system, number, motors))
    assert list(wide.elastic) == [2, 3] and wide.size == 9 and not wide.inertia[1, 2]
    with pytest.raises(ShotError, match="/C/Loop"):
        giving_motors(system._replace(law=np.full(2, STVK, np.int32)), number, motors)
