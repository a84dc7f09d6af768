"""Laws of friction: against the formulas of their authors, their derivatives, and a pendulum's own equations."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.catalogs.motor_types import motor_types
from calmotion.model.motor import Coulomb, DirectCurrent, Directional, Load, Quadratic, Rotor, Stribeck, StribeckLoad
from calmotion.multibody.model.system import FRICTION, FRICTION_SPEED, FRICTION_TERMS, SERVO_COLUMNS
from calmotion.multibody.motors.friction import gear_friction, largest_friction
from motor_runs import INERTIA, LENGTH, MASS, G, pendulum, pitch, run, smooth
from scipy.integrate import solve_ivp

BASE, WIDTH = 0.012, 0.05
LAWS = [
    Stribeck(0.03, 0.9, 1.3),
    Load(0.1),
    StribeckLoad(0.03, 0.9, 0.8, 0.1, 0.2),
    Directional(0.03, 0.9, 1.3, 0.25, 0.02, 0.05, 0.2),
    Quadratic(0.03, 0.9, 1.3, 0.25, 0.02, 0.05, 0.2, 0.01, 0.02),
]


def row(law, friction=BASE):
    found = np.zeros(SERVO_COLUMNS)
    found[FRICTION], found[FRICTION_SPEED], found[FRICTION_TERMS:] = friction, WIDTH, law.terms()
    return found


def authors(law, m, t, w):
    """F of M1 to M6 as arXiv 2410.08650 has it; the external torque is -t."""
    k = law.terms()
    s, size, other = np.exp(-(abs(w / k.speed) ** k.exponent)), abs(m), abs(t)
    found = BASE + s * k.stribeck + abs(k.joint_load * -t - k.motor_load * m)
    found += s * abs(k.stribeck_joint_load * -t - k.stribeck_motor_load * m)
    if np.sign(-t) != np.sign(m):
        found += s * (k.joint_quadratic * t * t * (other < size) + k.motor_quadratic * m * m * (other > size))
    return found


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_laws_are_those_of_their_authors_but_for_rounded_corners(law):
    for m, t in ((3.0, 2.0), (2.0, 3.0), (-3.0, 2.0), (3.0, -2.5), (-2.0, -3.0)):
        for w in (0.0, 0.4, -1.5, 8.0):
            found, corners = largest_friction(row(law), m, t, w)[0], 0.2 * (BASE + 0.03)
            assert found == pytest.approx(authors(law, m, t, w), abs=corners)


@pytest.mark.parametrize("law", [Coulomb(), *LAWS], ids=lambda law: law.name)
def test_derivatives_match_differences_and_friction_brakes(law):
    e, own = 1e-6, row(law)
    for m, y in ((0.3, 0.25), (0.2, 0.4), (-0.3, 0.2), (0.3, -0.25), (0.004, 0.003)):
        for w in (-2.0, -0.03, 0.01, 0.5):
            f, *slopes = gear_friction(own, m, y, w)
            assert f * w > 0.0
            assert f == pytest.approx(np.tanh(w / WIDTH) * largest_friction(own, m, y - f, w)[0], rel=1e-12)
            for k, slope in enumerate(slopes):
                ends = [gear_friction(own, *(np.array([m, y, w]) + s * e * np.eye(3)[k]))[0] for s in (1, -1)]
                assert slope == pytest.approx((ends[0] - ends[1]) / (2 * e), rel=1e-5, abs=1e-7)
    assert gear_friction(own, 0.3, 0.2, 0.0)[0] == 0.0


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_a_pendulum_on_a_servo_with_each_law_moves_as_its_differential_equations_say(law):
    current = DirectCurrent(7.4, 4.0, 2.6, 20.0)
    own, emf = row(replace(law), 0.3), current.back_emf
    own[FRICTION_SPEED] = 0.3
    k, armature, viscous = current.position_gain, 0.03, 0.1

    def motor(t, y):
        return k * (smooth(np.array([t]))[0][0, 0] - y[0]) - emf * y[1]

    def slope(t, y):
        m, gravity = motor(t, y), MASS * G * LENGTH * np.cos(y[0])
        # rotor and link move together: what is left accelerates both
        low, high = -50.0, 50.0
        for _ in range(80):
            f = 0.5 * (low + high)
            acceleration = (m + gravity - viscous * y[1] - f) / (INERTIA + armature)
            passed = INERTIA * acceleration - gravity
            excess = np.tanh(y[1] / 0.3) * largest_friction(own, m, passed, y[1])[0] - f
            low, high = (f, high) if excess > 0.0 else (low, f)
        return [y[1], acceleration]

    theta = 0.0
    for _ in range(100):
        theta = MASS * G * LENGTH * np.cos(theta) / k
    exact = solve_ivp(slope, (0, 0.8), [theta, 0.0], "RK45", rtol=1e-7, atol=1e-9, dense_output=True)
    rotor = Rotor(armature, viscous_friction=viscous, friction=0.3, friction_speed=0.3, law=law, back_emf=emf)
    errors = []
    for h in (2e-3, 1e-3):
        times = np.arange(0.0, 0.8, h)
        found, loads = run(pendulum(k, 0.0, **vars(rotor)), *smooth(times), h)
        errors.append(np.abs(pitch(found.states) - exact.sol(times)[0]).max())
    expected = [motor(t, exact.sol(t)) for t in times]
    assert np.abs(loads.efforts[:, 0] - expected).max() < 1e-2 * np.abs(expected).max()
    assert errors[1] < 1e-3 and errors[0] / errors[1] > 2.5, errors


@pytest.mark.parametrize(
    ("name", "kind", "mass", "length"),
    [("xl330", "xl330-m288", 0.49, 0.1), ("xl320", "", 0.1, 0.1), ("mx64", "mx-64", 1.0, 0.15)],
)
@pytest.mark.parametrize(("variant", "tolerance"), [("m1", 0.02), ("m3", 0.06)])
def test_the_simulator_of_the_authors_moves_a_pendulum_alike(name, kind, mass, length, variant, tolerance):
    """M3 differs by what accelerates the link, which counts as load here and not there."""
    bam = pytest.importorskip("bam.model", reason="better-actuator-models is not installed")
    from bam.simulate import Simulator

    model = bam.load_model(motor_name=name, model=variant)
    model.q_offset.value = 0.0
    actuator, other = model.actuator, Simulator(model)
    volts, gain, step = actuator.vin, 400.0 if name == "xl330" else 32.0, 1e-3
    actuator.load_log({"mass": mass, "arm_mass": 0.0, "length": length, "kp": gain, "vin": volts})
    times = np.arange(0.0, 3.0, step)
    goal = 0.8 * np.sin(2.0 * times) ** 2
    theirs = []
    for target in goal:
        theirs.append(float(other.q))
        control = actuator.compute_control(target, other.q, other.dq, step)
        other.step(control, True, step)
    current = DirectCurrent(volts, model.R.value, model.kt.value, gain * actuator.error_gain, actuator.max_pwm)
    rotor = Rotor(
        model.armature.value, viscous_friction=model.friction_viscous.value, friction=model.friction_base.value,
        friction_speed=np.radians(0.5), back_emf=current.back_emf,
        law=Load(model.load_friction_base.value) if variant == "m3" else Coulomb(),
    )  # fmt: skip
    character = chain(1, driven=(0,), mass=mass, length=length)
    gains = {"model": "servo", "position_gain": current.position_gain, "max_torque": current.largest_torque}
    motors = tuple(replace(m, **gains, rotor=rotor) for m in character.motors)
    # there the angle of a link that hangs down is zero, here that of a level one
    command = (goal + np.pi / 2)[:, None]
    found, _ = run(compiled(replace(character, motors=motors)), command, np.gradient(command, step, axis=0), step)
    ours = pitch(found.states) - np.pi / 2
    assert np.abs(ours - theirs).max() < tolerance * np.ptp(theirs)
    if kind == "mx-64" and variant == "m3":
        values = motor_types()[kind].values
        assert values["torque_constant"] == pytest.approx(model.kt.value, rel=1e-3)
        assert values["load"] == pytest.approx(model.load_friction_base.value, rel=1e-3)
        assert values["armature"] == pytest.approx(model.armature.value, rel=1e-3)
