"""Servos that are switched off and on: their differential equations, derivatives, and what a shot says of them."""

from dataclasses import replace

import calmotion as cm
import numpy as np
import pytest
from arms import chain
from calmotion.errors import IntegrationError, ShotError
from calmotion.model.animation import Schedule
from calmotion.model.curves import with_schedules_at
from calmotion.model.tempo import TimeMap
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.integrate import integrate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.moving_markers import pack
from calmotion.simulation.simulator import Simulator
from calmotion.usd.reading import read_shot
from motor_runs import INERTIA, LENGTH, MASS, G, pendulum, pitch, servo, smooth
from scipy.integrate import solve_ivp
from servo_shots import edited, written

SWITCHED = Schedule(np.array([0.0, 0.32, 0.56]), np.array([True, False, True]))
OFF, ON, END = 0.32, 0.56, 0.8


def switched(links=1, **rotor):
    character = replace(chain(links, driven=range(links), mass=MASS, length=LENGTH), gravity=np.array([0.0, 0.0, -G]))
    first = replace(character.motors[0], powered=SWITCHED)
    return servo(replace(character, motors=(first, *character.motors[1:])), 90.0, 1.0, 9.0, **rotor)


def world_of(times):
    """The marker of the motor: row n says whether it is on in the step to instant n."""
    on = SWITCHED.held(np.maximum(np.concatenate([times[:1], times[:-1]]) + 0.5 * (times[1] - times[0]), 0.0))
    return np.where(on[:, None, None], pack(np.zeros(3), np.zeros(3), np.zeros(3), np.eye(3)), 0.0)


def moved(model, h, world=None, integrator="bdf2"):
    times = np.arange(0.0, END, h)
    angles, rates = (model.joint_angles(part) for part in smooth(times))
    world, workspace = world_of(times) if world is None else world, Workspace.for_system(model.system)
    start = rigid_state(model, angles[0])
    found = integrate(model.system, start, angles, rates, h, workspace, integrator=integrator, world=world)
    return times, found, reactions(model.system, found, angles, rates)


def test_a_pendulum_that_is_dropped_and_caught_moves_as_its_differential_equations_say():
    rotor = {"armature": 0.03, "viscous_friction": 0.05, "friction": 0.3, "friction_speed": 0.3, "back_emf": 0.4}

    def slope(t, y):
        (command,), (rate,) = (part[0] for part in smooth(np.array([t])))
        wanted = 90.0 * (command - y[0]) + 1.0 * (rate - y[1])
        # the smooth limit of the largest torque, then the torque by the induced voltage
        motor = wanted / (1.0 + (wanted / 9.0) ** 16) ** (1 / 16) - 0.4 * y[1]
        drag = 0.05 * y[1] + 0.3 * np.tanh(y[1] / 0.3)
        weight = MASS * G * LENGTH * np.cos(y[0])
        return [y[1], (motor * (not OFF <= t < ON) - drag + weight) / (INERTIA + 0.03)]

    theta = 0.0
    for _ in range(100):
        theta = MASS * G * LENGTH * np.cos(theta) / 90.0
    y, exact = [theta, 0.0], []
    for begin, end in ((0.0, OFF - 1e-12), (OFF, ON - 1e-12), (ON, END)):
        part = solve_ivp(slope, (begin, end), y, "Radau", rtol=1e-10, atol=1e-12, dense_output=True)
        y, exact = part.y[:, -1], [*exact, part.sol]
    model, errors = switched(**rotor), []
    for h in (2e-3, 1e-3, 5e-4):
        times, found, loads = moved(model, h)
        parts = np.searchsorted([OFF - 1e-9, ON - 1e-9], times, "right")
        expected = np.array([exact[part](t)[0] for part, t in zip(parts, times, strict=True)])
        errors.append(np.abs(pitch(found.states) - expected).max())
        off = (times > OFF + 1e-9) & (times < ON + 1e-9)
        assert np.all(loads.efforts[off] == 0.0) and np.abs(loads.efforts[~off]).min() > 0.0
    assert np.abs(pitch(found.states)[off] - smooth(times)[0][off, 0]).max() > 0.5, "it falls"
    assert errors[2] < 1e-3 and np.all(np.log2(np.array(errors[:-1]) / errors[1:]) > 1.6), errors


def test_a_motor_that_is_always_on_moves_as_one_without_a_switch():
    times = np.arange(0.0, END, 2e-3)
    on = np.broadcast_to(world_of(times)[0], (len(times), 1, 18)).copy()
    _, found, loads = moved(switched(armature=0.03), 2e-3, on)
    _, plain, expected = moved(pendulum(90.0, 1.0, 9.0, armature=0.03), 2e-3, np.zeros((len(times), 0, 18)))
    assert np.array_equal(found.states.c, plain.states.c) and np.array_equal(loads.efforts, expected.efforts)


@pytest.mark.parametrize("integrator", ["rk4", "newmark"])
def test_other_integrators_refuse_it(integrator):
    with pytest.raises(IntegrationError, match="motors that are switched off"):
        moved(switched(armature=0.03), 2e-3, integrator=integrator)


def test_derivatives_over_switches_match_differences_and_are_transposes():
    model, h = switched(2, armature=0.05, viscous_friction=0.1, friction=0.2), 1 / 200
    times = h * np.arange(160)
    simulator = Simulator(model, h, world_of(times), False)
    w = np.array([[9.0, 14.0]])
    values, rates = 0.3 * np.sin(w * times[:, None]) ** 2, 0.3 * w * np.sin(2 * w * times[:, None])
    by = np.cos(w * times[:, None]), -w * np.sin(w * times[:, None])
    linear = simulator.linearize(simulator.run(values, rates))
    motion, efforts = linear.tangent(*by, True)

    def at(e):
        return simulator.run(values + e * by[0], rates + e * by[1]).trajectory.states.u

    found, e = motion[..., 6:], 1e-4
    expected = (8.0 * (at(e) - at(-e)) - (at(2 * e) - at(-2 * e))) / (12 * e)
    assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()
    rng = np.random.default_rng(0)
    gradient, effort = rng.normal(size=motion.shape), rng.normal(size=efforts.shape)
    by_value, by_rate = linear.adjoint(gradient, effort)
    forward = np.sum(motion * gradient) + np.sum(efforts * effort)
    backward = np.sum(by_value * by[0]) + np.sum(by_rate * by[1])
    assert abs(forward - backward) < 1e-10 * np.linalg.norm(efforts) * np.linalg.norm(effort)
    while_off = slice(round(OFF / h) + 1, round(ON / h) + 1)
    assert np.all(by_value[while_off, 0] == 0.0) and np.any(by_value[while_off, 1] != 0.0)


ROBOT = """def Xform "Robot" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])
{
    def Xform "Arm" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 0.5
        point3f physics:centerOfMass = (0.1, 0, 0)
        float3 physics:diagonalInertia = (0.001, 0.001, 0.001)
        def Xform "Tip" (prepend apiSchemas = ["CalmTargetAPI"])
        {
            double3 xformOp:translate = (0.2, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
    def PhysicsRevoluteJoint "Hinge" (prepend apiSchemas = ["PhysicsDriveAPI:angular", "CalmMotorAPI"])
    {
        uniform token physics:axis = "Y"
        rel physics:body1 = </Robot/Arm>
        uniform token calm:motor:model = "servo"
        uniform float calm:motor:positionGain = 0.5
        uniform float calm:motor:velocityGain = 0.02
        uniform float calm:motor:armature = 0.01
        float drive:angular:physics:targetPosition.timeSamples = { 0: 0, 24: 20 }
        bool calm:motor:powered.timeSamples = { 0: true, 12: false }
    }
}
"""


@pytest.fixture
def shot(tmp_path):
    return written(tmp_path, ROBOT)


def test_a_shot_switches_its_motor_off(shot):
    result = cm.simulate(cm.open_shot(shot), step=1 / 480)
    effort = result.motors["/Robot/Hinge"].effort
    assert np.all(effort[result.times > 0.5 + 1e-6] == 0.0) and np.all(np.abs(effort[result.times < 0.5 - 1e-6]) > 0.1)
    assert result.motors["/Robot/Hinge"].effort.shape == result.times.shape


def test_its_times_follow_the_tempo(shot):
    character, _, _ = read_shot(str(shot))
    slower = with_schedules_at(character, TimeMap(np.array([0.0, 1.0]), np.array([0.0, 2.0])))
    assert slower.motors[0].powered.times.tolist() == [0.0, 1.0]
    assert slower.joints[0].contact is None


def test_a_shaper_would_not_delay_its_times(shot):
    with pytest.raises(ShotError, match="/Robot/Hinge.*would not be"):
        cm.simulate(cm.open_shot(shot), shaper="zv")


def never_on(prim):
    prim.GetAttribute("calm:motor:powered").Clear()
    prim.GetAttribute("calm:motor:powered").Set(False)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda prim: prim.GetAttribute("calm:motor:model").Set("prescribed"), "only a servo can be switched off"),
        (lambda prim: prim.GetAttribute("calm:motor:powered").Set(False, 0.0), "off at the first frame"),
        (never_on, "off at the first frame"),
    ],
)
def test_what_cannot_be_switched_is_refused(shot, edit, message):
    with pytest.raises(ShotError, match=message) as refused:
        read_shot(str(edited(shot, "/Robot/Hinge", edit)))
    assert refused.value.path == "/Robot/Hinge" and refused.value.attribute == "calm:motor:powered"


def test_a_motor_that_stays_on_has_no_switch(shot):
    character, _, _ = read_shot(
        str(edited(shot, "/Robot/Hinge", lambda prim: prim.GetAttribute("calm:motor:powered").Set(True, 12.0)))
    )
    assert character.motors[0].powered is None


def test_a_loop_is_refused(shot):
    def loop(prim):
        robot = prim.GetParent()
        robot.AddAppliedSchema("CalmRetargetAPI")
        robot.GetAttribute("calm:retarget:cyclic").Set(True)
        prim.GetAttribute("drive:angular:physics:targetPosition").Set(0.0, 24.0)

    with pytest.raises(ShotError, match="motors that are switched cannot loop"):
        cm.simulate(cm.open_shot(edited(shot, "/Robot/Hinge", loop)))
