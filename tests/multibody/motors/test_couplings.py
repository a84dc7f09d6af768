"""Motors that a second joint turns too, against Lagrange's equations of a double pendulum with both rotors."""

from dataclasses import replace

import calmotion as cm
import numpy as np
import pytest
from arms import chain, compiled
from calmotion import ShotError
from calmotion.cli.main import main
from calmotion.model.motor import Follows, Rotor, TurnsWith
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.model.model import rigid_model
from calmotion.multibody.motors.inverse import inverse_commands
from calmotion.multibody.runs import linearize, simulate
from calmotion.simulation.simulator import Simulator
from calmotion.tolerance.motors.motor_effects import with_gains_used
from calmotion.usd.reading import read_shot
from motor_runs import G, smooth, transmitted
from scipy.integrate import solve_ivp
from servo_shots import edited, written

MASS, LENGTH, RATIO = 0.8, 0.5, 0.7
GAIN, DAMPING = 300.0, 6.0
ROTORS = [Rotor(0.05, viscous_friction=0.3, friction=0.4, friction_speed=0.3),
          Rotor(0.02, viscous_friction=0.2, friction=0.5, friction_speed=0.3)]  # fmt: skip
TO_ROTORS = np.array([[1.0, 0.0], [RATIO, 1.0]])


def wrist(model="servo", ratio=RATIO, flipped=(), **changes):
    character = chain(2, driven=(0, 1), mass=MASS, length=LENGTH, flipped=flipped)
    gains = {"position_gain": GAIN, "velocity_gain": DAMPING} if model == "servo" else {}
    first, last = (
        replace(motor, model=model, rotor=replace(rotor, **changes), **gains)
        for motor, rotor in zip(character.motors, ROTORS, strict=True)
    )
    pair = TurnsWith(0, ratio) if ratio else None
    return replace(character, motors=(first, replace(last, turns_with=pair)))


def commands(times):
    first, last = smooth(times, 0.5, 3.0), smooth(times, -0.8, 2.0)
    return tuple(np.concatenate(pair, axis=1) for pair in zip(first, last, strict=True))


def forces(q, dq):
    """Mass matrix of two point masses, and the forces of velocities and weight; angles turn the links down."""
    a, m = LENGTH, MASS
    c2, s2 = np.cos(q[1]), np.sin(q[1])
    off = m * a * a * (1.0 + c2)
    M = np.array([[m * a * a * (3.0 + 2.0 * c2), off], [off, m * a * a]])
    turn = m * a * a * s2
    velocity = np.array([-turn * (2.0 * dq[0] * dq[1] + dq[1] ** 2), turn * dq[0] ** 2])
    weight = m * G * a * np.array([2.0 * np.cos(q[0]) + np.cos(q.sum()), np.cos(q.sum())])
    return M, velocity - weight


def of_rotors(q, dq, motors, t):
    """Torque of each motor less friction, by the angles and speeds of the rotors."""
    wanted, rates = (TO_ROTORS @ part[0] for part in commands(np.array([t])))
    torque = GAIN * (wanted - q) + DAMPING * (rates - dq)
    pairs = zip(motors, dq, strict=True)
    rub = [own.viscous_friction * w + own.friction * np.tanh(w / own.friction_speed) for own, w in pairs]
    return torque, torque - rub


def joint_angles(run):
    """Of both hinges, from the poses of the links."""
    pitch = np.unwrap(2.0 * np.arctan2(run.states.q[:, :, 2], run.states.q[:, :, 0]), axis=0)
    return np.stack([pitch[:, 0], pitch[:, 1] - pitch[:, 0]], axis=1)


@pytest.mark.parametrize("flipped", [(), (1,)], ids=["", "flipped"])
def test_a_rotor_that_two_joints_turn_moves_as_lagrange_s_equations_say(flipped):
    armature = np.diag([own.armature for own in ROTORS])

    def slope(t, y):
        q, dq = y[:2], y[2:]
        M, h = forces(q, dq)
        _, left = of_rotors(TO_ROTORS @ q, TO_ROTORS @ dq, ROTORS, t)
        return np.concatenate([dq, np.linalg.solve(M + TO_ROTORS.T @ armature @ TO_ROTORS, TO_ROTORS.T @ left - h)])

    model = compiled(wrist(flipped=flipped))
    sign = np.array([1.0, -1.0 if flipped else 1.0])
    ends, errors = [], []
    for h in (4e-3, 2e-3):
        times = np.arange(0.0, 1.2, h)
        # seen from the flipped joint, everything turns the other way
        values, rates = (part * sign for part in commands(times))
        turned = compiled(wrist(ratio=RATIO * sign[1], flipped=flipped)) if flipped else model
        run = simulate(turned, values, rates, h)
        start = np.concatenate([joint_angles(run)[0], np.zeros(2)])
        exact = solve_ivp(slope, (0.0, 1.2), start, "RK45", rtol=1e-9, atol=1e-10, dense_output=True)
        found = exact.sol(times).T
        assert np.abs(slope(0.0, start)[2:]).max() < 1e-6
        errors.append(np.abs(joint_angles(run) - found[:, :2]).max())
        pairs = zip(times, found, strict=True)
        torques = [of_rotors(TO_ROTORS @ y[:2], TO_ROTORS @ y[2:], ROTORS, t)[0] for t, y in pairs]
        ends.append(np.abs(run.efforts * sign - torques).max() / np.abs(torques).max())
    assert errors[1] < 1e-4 and errors[0] / errors[1] > 3.5, errors
    assert ends[1] < 2e-3, ends


def test_a_rotor_behind_a_gear_that_gives_does_too():
    stiff, soft = 400.0, 2.0
    inertia = np.array([own.armature for own in ROTORS])

    def slope(t, y):
        q, phi, dq, dphi = y[:2], y[2:4], y[4:6], y[6:]
        M, h = forces(q, dq)
        gear = stiff * (phi - TO_ROTORS @ q) + soft * (dphi - TO_ROTORS @ dq)
        _, left = of_rotors(phi, dphi, ROTORS, t)
        return np.concatenate([dq, dphi, np.linalg.solve(M, TO_ROTORS.T @ gear - h), (left - gear) / inertia])

    h = 1e-3
    times = np.arange(0.0, 1.0, h)
    model = compiled(wrist(gear_stiffness=stiff, gear_damping=soft))
    run = simulate(model, *commands(times), h)
    q = joint_angles(run)[0]
    rest = -forces(q, np.zeros(2))[1]
    phi = TO_ROTORS @ q - np.linalg.solve(TO_ROTORS.T, rest) / stiff
    exact = solve_ivp(slope, (0.0, 1.0), [*q, *phi, *np.zeros(4)], "LSODA", rtol=1e-9, atol=1e-10, t_eval=times)
    assert np.abs(slope(0.0, exact.y[:, 0])).max() < 1e-5
    assert np.abs(joint_angles(run) - exact.y[:2].T).max() < 2e-4


def test_derivatives_are_those_of_differences_and_their_transposes():
    model, h, e = compiled(wrist()), 4e-3, 1e-6
    times = np.arange(0.0, 0.4, h)
    values, rates = commands(times)
    rng = np.random.default_rng(3)
    d_values = np.cumsum(rng.normal(size=values.shape), axis=0) * 1e-2
    d_rates = np.gradient(d_values, h, axis=0)
    linear = linearize(simulate(model, values, rates, h))
    found = linear.jvp(d_values, d_rates)
    ends = [simulate(model, values + s * e * d_values, rates + s * e * d_rates, h).positions for s in (1, -1)]
    assert np.abs(found[..., :3] - (ends[0] - ends[1]) / (2 * e)).max() < 1e-6 * np.abs(found).max()
    weights = rng.normal(size=found.shape)
    by_values, by_rates = linear.vjp(weights)
    assert np.vdot(by_values, d_values) + np.vdot(by_rates, d_rates) == pytest.approx(np.vdot(weights, found), rel=1e-9)


@pytest.mark.parametrize("kind", ["servo", "prescribed"])
def test_derivatives_of_efforts_are_those_of_differences_and_their_transposes(kind):
    model, h, e = compiled(wrist(kind)), 4e-3, 1e-5
    times = np.arange(0.0, 0.4, h)
    values, rates = commands(times)
    by = tuple(scale * part[:, ::-1] for scale, part in zip((1.0, 1.7), commands(1.7 * times), strict=True))
    simulator = Simulator(model, h, np.zeros((len(times), 0, 18)), False)
    linear = simulator.linearize(simulator.run(values, rates))
    motion, found = linear.tangent(*by, True)
    runs = [simulate(model, values + s * e * by[0], rates + s * e * by[1], h) for s in (1, -1)]
    ends = [model.motor_efforts(along_axes(run), through_gears=True) for run in runs]
    assert np.abs(found - (ends[0] - ends[1]) / (2 * e)).max() < 1e-5 * np.abs(found).max()
    rng = np.random.default_rng(2)
    gradient, effort = rng.normal(size=motion.shape), rng.normal(size=found.shape)
    by_values, by_rates = linear.adjoint(gradient, effort)
    forward = np.vdot(motion, gradient) + np.vdot(found, effort)
    backward = np.vdot(by_values, by[0]) + np.vdot(by_rates, by[1])
    assert abs(forward - backward) < 1e-9 * np.linalg.norm(found) * np.linalg.norm(effort)
    some = linear.responses(by[0][20:60, :1], by[1][20:60, :1], 20, np.eye(2), *no_quantities(model), motors=(0,))
    column = np.zeros_like(values)
    column[20:60, 0] = by[0][20:60, 0]
    speeds = np.zeros_like(values)
    speeds[20:60, 0] = by[1][20:60, 0]
    _, expected = linear.tangent(column, speeds, True)
    assert np.abs(some[1][:, 0, 0] - expected[some[0] : 60, 0]).max() < 1e-9 * np.abs(expected).max()


def along_axes(run):
    return transmitted(run.model.system, reactions(run.model.system, run.trajectory, run.joint_values, run.joint_rates))


def no_quantities(model):
    return np.zeros(0, np.int32), np.zeros((100, 0, model.system.size))


def test_efforts_of_ideal_motors_are_those_on_their_own_shafts():
    h = 1e-3
    times = np.arange(0.0, 1.0, h)
    values, rates = commands(times)
    model = compiled(wrist("prescribed"))
    joints = simulate(compiled(wrist("prescribed", ratio=0.0)), values, rates, h).efforts
    own = simulate(model, values, rates, h).efforts
    assert np.abs(own - np.linalg.solve(TO_ROTORS.T, joints.T).T).max() < 1e-9
    # virtual work: the transposes of both maps
    rng = np.random.default_rng(1)
    for one in (model, compiled(wrist())):
        a, b = rng.normal(size=(2, 5, 2))
        assert np.vdot(one.motor_efforts(a, through_gears=True), b) == pytest.approx(np.vdot(a, one.by_efforts(b)))
        assert np.vdot(one.joint_angles(a), b) == pytest.approx(np.vdot(a, one.by_inputs(b)))
        assert np.allclose(one.turned(one.joint_angles(a)), a)


def test_inverse_commands_make_coupled_servos_do_what_ideal_motors_do():
    character, h = wrist(friction=0.0), 1e-3
    times = np.arange(0.0, 1.5, h)
    values, rates = commands(times)
    model = compiled(character)
    efforts = simulate(rigid_model(model), values, rates, h).efforts
    found = inverse_commands(character.motors, times, values, efforts)
    ideal, plain = (simulate(model, part, np.gradient(part, h, axis=0), h) for part in (found, values))
    off, lag = (np.abs(joint_angles(run) - values)[20:].max() for run in (ideal, plain))
    assert off < 0.02 * lag, (off, lag)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({0: {"model": "prescribed"}}, "servos both, or ideal both"),
        ({0: {"model": "drive"}, 1: {"model": "drive"}}, "servos both, or ideal both"),
        ({1: {"follows": Follows(0, 1.0, 0.0)}}, "geared"),
        ({0: {"turns_with": TurnsWith(1, 1.0)}}, "coupled itself"),
        ({1: {"turns_with": None}, 0: {"turns_with": TurnsWith(1, 1.0)}}, "has to carry the body"),
    ],
)
def test_a_coupling_without_a_place_is_refused(changes, words):
    character = wrist()
    motors = [replace(motor, **changes.get(k, {})) for k, motor in enumerate(character.motors)]
    with pytest.raises(ShotError, match=words):
        compiled(replace(character, motors=tuple(motors)))


ROBOT = """def Xform "Robot" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])
{
    def Xform "Upper" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 0.5
        point3f physics:centerOfMass = (0.1, 0, 0)
        float3 physics:diagonalInertia = (0.001, 0.001, 0.001)
    }
    def Xform "Lower" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 0.3
        point3f physics:centerOfMass = (0.1, 0, 0)
        float3 physics:diagonalInertia = (0.001, 0.001, 0.001)
        double3 xformOp:translate = (0.2, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Xform "Tip" (prepend apiSchemas = ["CalmTargetAPI"])
        {
            double3 xformOp:translate = (0.2, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
    def PhysicsRevoluteJoint "Wrist" (prepend apiSchemas = ["PhysicsDriveAPI:angular", "CalmMotorAPI"])
    {
        uniform token physics:axis = "Y"
        rel physics:body1 = </Robot/Upper>
        uniform token calm:motor:model = "servo"
        uniform float calm:motor:positionGain = 0.9
        uniform float calm:motor:velocityGain = 0.02
        uniform float calm:motor:armature = 0.01
        float drive:angular:physics:targetPosition.timeSamples = { 0: 0, 12: 30, 24: 0 }
    }
    def PhysicsRevoluteJoint "Flange" (prepend apiSchemas = ["PhysicsDriveAPI:angular", "CalmMotorAPI"])
    {
        uniform token physics:axis = "Y"
        rel physics:body0 = </Robot/Upper>
        rel physics:body1 = </Robot/Lower>
        point3f physics:localPos0 = (0.2, 0, 0)
        uniform token calm:motor:model = "servo"
        uniform float calm:motor:positionGain = 0.9
        uniform float calm:motor:velocityGain = 0.02
        uniform float calm:motor:armature = 0.004
        rel calm:motor:coupledTo = </Robot/Wrist>
        uniform float calm:motor:coupling = -0.5
        float drive:angular:physics:targetPosition.timeSamples = { 0: 10, 12: -20, 24: 10 }
    }
}
"""


@pytest.fixture
def shot(tmp_path):
    return written(tmp_path, ROBOT)


def test_a_shot_couples_a_motor_and_is_optimised_with_it(shot, capsys):
    character, _, _ = read_shot(str(shot))
    assert [motor.turns_with for motor in character.motors] == [None, TurnsWith(0, -0.5)]
    assert main(["inspect", str(shot)]) == 0
    assert "The motor of /Robot/Flange also turns with /Robot/Wrist, by -0.5 of its angle" in capsys.readouterr().out
    result = cm.optimize(cm.open_shot(shot), step=1 / 240).result
    before, after = (run.position_errors[run.motion.judged].max() for run in (result.before, result.after))
    assert before > 5e-3 and after < 0.02 * before


@pytest.mark.parametrize(
    ("changes", "model"),
    [({}, "servo"), ({0: {"position_gain": 0.0}}, "prescribed"), ({1: {"position_gain": 0.0}}, "prescribed")],
)
def test_gains_of_coupled_ideal_motors_are_used_for_both_or_none(changes, model):
    character = wrist("prescribed")
    gains = [{"position_gain": GAIN, "rotor": Rotor()} | changes.get(k, {}) for k in range(2)]
    motors = tuple(replace(motor, **own) for motor, own in zip(character.motors, gains, strict=True))
    used = with_gains_used(replace(character, motors=motors))
    assert [motor.model for motor in used.motors] == [model, model]
    compiled(used)


@pytest.mark.parametrize(
    ("edit", "found"),
    [
        (lambda prim: prim.GetRelationship("calm:motor:coupledTo").SetTargets(["/Robot/Wirst"]), "/Robot/Wirst"),
        (lambda prim: prim.GetRelationship("calm:motor:coupledTo").ClearTargets(True), None),
    ],
)
def test_a_coupling_to_no_joint_is_refused(shot, edit, found):
    with pytest.raises(ShotError, match="coupled to one other driven joint") as refused:
        read_shot(str(edited(shot, "/Robot/Flange", edit)))
    assert refused.value.attribute == "calm:motor:coupledTo" and refused.value.found == found
    assert found is None or "/Robot/Wrist" in str(refused.value.remedy)
