"""Contacts that come and go: impacts, phases, and derivatives over changes of contacts."""

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import IntegrationError
from calmotion.model import Body, Character, Frame, Joint, MassProperties
from calmotion.model.animation import Contact
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.kinematics import rigid_state, target_jacobians
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.integrate import integrate
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import body_anchors, compile_model, rigid_body, span_tree
from calmotion.multibody.model.moving_markers import pack
from calmotion.multibody.model.phases import RESTARTED, changes, held_contacts, phases_of, without_contacts
from calmotion.multibody.sensitivity.linearization import linearize
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.forward import run_forward
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulator import Simulator
from pxr import Gf, UsdPhysics
from steppers import FRAMES, LEGS, ROBOT, TORSO, giving, walk, write_stepper

LENGTH, MASS, SPEED = 0.8, 2.0, 1.5  # of the rod [m], [kg], [m/s]
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def rod(kind, gravity=0.0):
    """A thin rod along x that nothing holds but a contact at its end."""
    inertia = MASS * LENGTH**2 / 12.0 * np.diag([1e-3, 1.0, 1.0])
    body = Body("/Rod", Frame(np.zeros(3), UPRIGHT), MassProperties(MASS, np.zeros(3), inertia))
    end, here = Frame(np.array([0.5 * LENGTH, 0.0, 0.0]), UPRIGHT), Frame(np.zeros(3), UPRIGHT)
    contact = Contact(np.array([0.0]), np.array([False]))
    joints = (
        Joint("/Rod", "floating", -1, 0, here, here),
        Joint("/Rod/End", kind, -1, 0, end, end, closes_chain=True, contact=contact),
    )
    character = Character("/Rod", (body,), joints, (), (), np.array([0.0, 0.0, -gravity]))
    tree = span_tree(character)
    anchors = body_anchors(character, tree)
    return compile_model(character, tree, [rigid_body(body, anchors[0])])


def thrown(model, h, steps, catch):
    """The rod thrown along y and caught in the step to instant `catch`; the trajectory."""
    world = np.zeros((steps, 1, 18))
    world[catch:, 0] = pack(np.zeros(3), np.zeros(3), np.zeros(3), np.eye(3))
    start = rigid_state(model, np.zeros(2), world[0])
    start.V[0, 1] = SPEED
    angles = np.zeros((steps, 2))
    ws = Workspace.for_system(model.system)
    return simulate(model.system, start, angles, angles, h, ws, from_equilibrium=False, world=world), world


def energy(V):
    """Kinetic energy [J] of the rod."""
    return 0.5 * MASS * V[..., :3] @ V[..., :3] + 0.5 * MASS * LENGTH**2 / 12.0 * V[..., 5] ** 2


def test_a_thrown_rod_that_is_caught_at_its_end_turns_about_it():
    model, errors, losses = rod("spherical"), [], []
    for steps in (64, 128):
        h = 0.5 / steps
        run, world = thrown(model, h, steps, steps // 2)
        V = run.states.V[:, 0]
        before, after = V[steps // 2 - 1], V[steps // 2]
        assert before[1] == pytest.approx(SPEED, rel=1e-12)
        # momentum about the end is kept: omega = 3 v / 2 l, and a quarter of the energy is lost
        errors.append(abs(abs(after[5]) - 1.5 * SPEED / LENGTH))
        losses.append(energy(after) / energy(before))
        assert all(energy(b) <= energy(a) * (1.0 + 1e-9) for a, b in zip(V[:-1], V[1:], strict=True))
        # the end stays where it was caught
        turn = 2.0 * np.arctan2(run.states.q[:, 0, 3], run.states.q[:, 0, 0])
        end = run.states.c[:, 0, :2] + 0.5 * LENGTH * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        assert np.linalg.norm(end[steps // 2 :] - end[steps // 2 - 1], axis=1).max() < 0.02 / steps
    assert errors[1] < 0.6 * errors[0] and losses[1] == pytest.approx(0.75, abs=2e-3)


def test_a_rod_that_is_caught_as_a_weld_stops():
    run, world = thrown(rod("fixed"), 1e-3, 20, 10)
    assert np.abs(run.states.V[10:]).max() < 1e-9 and np.abs(run.states.V[9]).max() == pytest.approx(SPEED)
    # the impulse is that of the momentum, h times the force of the one step
    np.testing.assert_allclose(1e-3 * run.states.lam[10, 1, :3], [0.0, -MASS * SPEED, 0.0], atol=1e-9)
    assert np.abs(run.states.lam[12:]).max() < 1e-6


def test_phases_are_stretches_of_instants_in_which_the_same_contacts_hold():
    model = rod("fixed")
    _, world = thrown(model, 1e-3, 20, 10)
    system = model.system
    np.testing.assert_array_equal(changes(system, world), [10])
    np.testing.assert_array_equal(held_contacts(system, world)[:, 0], np.arange(20) >= 10)
    found = phases_of(system, world, 0, 20)
    bounds = [(phase.first, phase.last, phase.restarts, int(phase.system.rows[1])) for phase in found]
    assert bounds == [(0, 10, 0, 0), (10, 10 + RESTARTED, 1, 6), (10 + RESTARTED, 20, 0, 6)]
    assert [(p.first, p.last, p.restarts) for p in phases_of(system, world, 11, 20)] == [(11, 12, 1), (12, 20, 0)]
    assert phases_of(system, world, 5, 5) == [] and without_contacts(system).rows[1] == 0


def test_other_integrators_refuse_contacts():
    model = rod("fixed")
    with pytest.raises(IntegrationError, match="only bdf2 simulates contacts"):
        integrate(
            model.system, rigid_state(model, np.zeros(2)), np.zeros((3, 2)), np.zeros((3, 2)), 0.01,
            Workspace.for_system(model.system), integrator="newmark", world=np.zeros((3, 1, 18)),
        )  # fmt: skip


def prepared(path, step=1 / 96):
    """A shot on its grid, and its motors' curves."""
    shot = cm.open_shot(path)
    found = prepare(compile_shot(shot.character, shot.animation), RunSettings(step=step, pre_roll=0.0))
    return found, *sample_tracks(shot.animation.tracks, found.grid)


def forward(path, step=1 / 96):
    """Its simulation."""
    found, angles, rates = prepared(path, step)
    model = found.model
    run = run_forward(model, Workspace.for_system(model.system), angles, rates, found.grid.h, found.world)
    return found, run


def component(found, path):
    """Number of a body in the system."""
    return [found.character.bodies[b].path for b in found.model.tree.body].index(path)


def test_a_robot_walks_on_its_feet_as_kinematics_has_it(tmp_path):
    found, run = forward(write_stepper(tmp_path / "stepper.usda"))
    torso, feet = walk(np.arange(FRAMES))
    frames, c = found.grid.frames, run.trajectory.states.c
    np.testing.assert_allclose(c[frames, component(found, TORSO), 0], torso, atol=2e-8)
    for side in LEGS:
        np.testing.assert_allclose(c[frames, component(found, f"{ROBOT}/{side}/Foot"), 0], feet[side][0], atol=2e-8)
    # each foot carries the weight at rest
    weight = 9.81 * found.model.system.mass.sum()
    lam = run.trajectory.states.lam[:, len(found.model.tree.body) :]
    assert lam[0, 0, 2] == pytest.approx(weight, rel=1e-9) and lam[-1, 1, 2] == pytest.approx(weight, rel=5e-2)
    assert np.all(lam[: frames[12] + 1, 1] == 0.0) and np.all(lam[frames[12] + 1 :, 0] == 0.0)


def test_a_foot_that_is_always_held_is_a_weld(tmp_path):
    def always(stage):
        for side in LEGS:
            stage.GetPrimAtPath(f"{ROBOT}/{side}/Foot/Sole").GetAttribute("calm:contact:active").Clear()
        stage.GetPrimAtPath(f"{ROBOT}/right/Foot/Sole").RemoveAPI("CalmContactAPI")

    def welded(stage):
        always(stage)
        stage.GetPrimAtPath(f"{ROBOT}/left/Foot/Sole").RemoveAPI("CalmContactAPI")
        weld = UsdPhysics.FixedJoint.Define(stage, f"{ROBOT}/left/stand")
        weld.CreateBody1Rel().SetTargets([f"{ROBOT}/left/Foot"])
        weld.CreateLocalPos0Attr(Gf.Vec3f(0.0, 0.05, 0.0))
        weld.CreateLocalPos1Attr(Gf.Vec3f(0.0, 0.0, -0.04))

    held, run = forward(write_stepper(tmp_path / "held.usda", always))
    fixed, other = forward(write_stepper(tmp_path / "fixed.usda", welded))
    for path in (TORSO, f"{ROBOT}/right/Foot"):
        one, two = run.trajectory.states, other.trajectory.states
        moved = [part.c[:, component(own, path)] for own, part in ((held, one), (fixed, two))]
        # places in the stage have single precision, so that poses differ by that
        np.testing.assert_allclose(moved[0] - moved[0][0], moved[1] - moved[1][0], rtol=0, atol=1e-10)
        assert np.abs(one.V[:, component(held, path)] - two.V[:, component(fixed, path)]).max() < 1e-7
    efforts = [
        part.model.motor_values(reactions(part.model.system, r.trajectory, r.joint_angles, r.joint_rates).efforts)
        for part, r in ((held, run), (fixed, other))
    ]
    paths = [[motor.path for motor in part.character.motors] for part in (held, fixed)]
    order = [paths[1].index(path) for path in paths[0]]
    np.testing.assert_allclose(efforts[0], efforts[1][:, order], rtol=1e-6, atol=1e-5)


def stamping(frames):
    """Steps whose right foot lands while it moves."""
    torso, feet = walk(frames)
    s = np.clip(2.0 * np.asarray(frames) / (FRAMES - 1), 0.0, 1.0)
    feet["right"] = (0.1 * s, 0.12 * s * (1.0 - s))
    return torso, feet


@pytest.mark.parametrize("edit", [None, giving], ids=["ideal", "drives"])
def test_derivatives_over_a_landing_agree_with_differences(tmp_path, edit):
    found, angles, rates = prepared(write_stepper(tmp_path / "stepper.usda", edit, walking=stamping))
    model, h = found.model, found.grid.h
    simulator = Simulator(model, h, found.world, False)
    run = simulator.run(angles, rates)
    rng, share = np.random.default_rng(3), np.arange(len(angles)) / len(angles)
    waves = np.sin(np.pi * np.arange(1, 5) * share[:, None] + 0.3)
    values = waves @ rng.normal(size=(4, angles.shape[1]))
    speeds = np.gradient(values, h, axis=0)

    def measured(eps):
        other = Simulator(model, h, found.world, False).run(angles + eps * values, rates + eps * speeds)
        efforts = reactions(model.system, other.trajectory, other.joint_angles, other.joint_rates).efforts
        return other.target_positions, model.motor_values(efforts)

    linear = simulator.linearize(run)
    motion, efforts = linear.tangent(values, speeds, True)
    states = run.trajectory.states
    jacobian = target_jacobians(model, states.c, states.q, states.u)
    places = np.einsum("tkia,tka->tki", jacobian[:, :, :3], motion[:, model.targets.component])
    for exact, plus, minus in zip((places, efforts), measured(1e-5), measured(-1e-5), strict=True):
        np.testing.assert_allclose(exact, (plus - minus) / 2e-5, rtol=0, atol=1e-7 * np.abs(exact).max())
    # the adjoint is the transpose, and a block of directions is each of them
    weights, by_effort = rng.normal(size=motion.shape), rng.normal(size=efforts.shape)
    by_value, by_rate = linear.adjoint(weights.copy(), by_effort)
    forwards = np.sum(weights * motion) + np.sum(by_effort * efforts)
    assert np.sum(by_value * values) + np.sum(by_rate * speeds) == pytest.approx(forwards, rel=1e-11)
    one, row = np.eye(angles.shape[1]), np.ascontiguousarray(jacobian[:, :, 2])
    first, block = linear.responses(values[:, :1], speeds[:, :1], 0, one, model.targets.component, row)
    single, _ = linear.tangent(values[:, :1] * one[2], speeds[:, :1] * one[2], False)
    expected = np.einsum("tka,tka->tk", row, single[:, model.targets.component])
    np.testing.assert_allclose(block[:, :, 2], expected[first:], atol=1e-10 * np.abs(expected).max())


def test_the_continuous_adjoint_refuses_contacts(tmp_path):
    found, run = forward(write_stepper(tmp_path / "stepper.usda"), 1 / 48)
    with pytest.raises(ValueError, match="supports neither contacts nor motors that are switched"):
        linearize(
            found.model.system, run.trajectory, run.joint_angles, run.joint_rates,
            Workspace.for_system(found.model.system), continuous=True,
        )  # fmt: skip


def test_steps_over_a_landing_are_of_second_order(tmp_path):
    path = write_stepper(tmp_path / "stepper.usda", giving)
    runs = [forward(path, step) for step in (1 / 96, 1 / 192, 1 / 384, 1 / 768)]
    at = [run.target_positions[found.grid.frames, 0] for found, run in runs]
    far = [np.linalg.norm(a - b, axis=1).max() for a, b in zip(at[:-1], at[1:], strict=True)]
    assert far[1] < 0.35 * far[0] and far[2] < 0.3 * far[1]
