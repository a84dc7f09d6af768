"""Reactions of joints against Newton's and Euler's laws of the motion that they make."""

import numpy as np
import pytest
from arms import chain, compiled, frame
from calmotion.model import Body, Character, Joint, MassProperties, Motor, Target
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.joint_arrays import body_anchors
from calmotion.multibody.model.model import compile_model, rigid_body
from calmotion.multibody.model.topology import span_tree
from scipy.spatial.transform import Rotation

H = 1e-3
T = np.arange(0.0, 0.6 + H / 2, H)


def eased(reach):
    """Values and rates of a move from rest, shape [T, len(reach)] each."""
    return np.outer(T**3 * (2.0 - T), reach), np.outer(6.0 * T**2 - 4.0 * T**3, reach)


def run(model, values, rates):
    trajectory = simulate(
        model.system, rigid_state(model, values[0]), values, rates, H, Workspace.for_system(model.system)
    )
    return trajectory, reactions(model.system, trajectory, values, rates)


def acceleration(x):
    return (x[2:] - 2.0 * x[1:-1] + x[:-2]) / H**2


@pytest.mark.parametrize("flipped", [(), (1,)])
def test_they_are_what_the_links_beyond_need(flipped):
    """Masses of 1 kg at the ends of two driven links of 0.4 m: the force at each joint carries those beyond it."""
    model = compiled(chain(2, driven=(0, 1), length=0.4, flipped=flipped))
    values, rates = eased([1.0, -1.7])
    trajectory, found = run(model, values, rates)
    c, R = trajectory.states.c, Rotation.from_quat(np.roll(trajectory.states.q, -1, axis=-1).reshape(-1, 4))
    ends = c + R.apply([0.4, 0.0, 0.0]).reshape(c.shape)
    needed = acceleration(ends) + [0.0, 0.0, 9.81]
    inner = slice(30, -1)
    for joint in (0, 1):
        force = needed[:, joint:].sum(axis=1)
        lever = ends[1:-1, joint:] - c[1:-1, joint : joint + 1]
        moment = np.cross(lever, needed[:, joint:]).sum(axis=1)
        scale = np.abs(force).max()
        assert np.abs(found.forces[1:-1, joint] - force)[inner].max() < 2e-3 * scale
        assert np.abs(found.moments[1:-1, joint] - moment)[inner].max() < 2e-3 * scale
        # about the hinge's axis, y
        assert np.abs(found.efforts[:, joint] - found.moments[:, joint, 1]).max() < 1e-9 * scale


def test_the_effort_of_a_length_motor_is_a_force_along_its_axis():
    """A weight lifted along a slope of 30 degrees: m (g sin a + x'')."""
    slope = np.roll(Rotation.from_euler("y", 60, degrees=True).as_quat(), 1)
    body = Body("/C/Cart", frame(), MassProperties(2.0, np.zeros(3), 1e-2 * np.eye(3)))
    joint = Joint("/C/Lift", "prismatic", -1, 0, frame(rotation=slope), frame(rotation=slope))
    motors = (Motor(0, joint.path, "drive:linear:physics:targetPosition"),)
    down = np.array([0.0, 0.0, -9.81])
    character = Character("/C", (body,), (joint,), motors, (Target("/C/tip", 0, frame()),), down)
    tree = span_tree(character)
    model = compile_model(character, tree, [rigid_body(body, body_anchors(character, tree)[0])])
    values, rates = eased([0.8])
    _, found = run(model, values, rates)
    along = acceleration(values[:, 0])
    assert np.abs(found.efforts[31:-1, 0] - 2.0 * (9.81 * np.sin(np.pi / 6) + along[30:])).max() < 2e-2
    assert np.abs(np.linalg.norm(found.forces, axis=2)[0, 0] - 2.0 * 9.81) < 1e-9


def test_a_free_slider_carries_nothing_along_its_axis():
    body = Body("/C/Cart", frame(), MassProperties(2.0, np.array([0.0, 0.1, 0.0]), 1e-2 * np.eye(3)))
    slope = Rotation.from_euler("y", -60, degrees=True)
    quaternion = np.roll(slope.as_quat(), 1)
    joint = Joint("/C/Slide", "prismatic", -1, 0, frame(rotation=quaternion), frame(rotation=quaternion))
    down = np.array([0.0, 0.0, -9.81])
    character = Character("/C", (body,), (joint,), (), (Target("/C/tip", 0, frame()),), down)
    tree = span_tree(character)
    model = compile_model(character, tree, [rigid_body(body, body_anchors(character, tree)[0])])
    none = np.zeros((len(T), 1))
    start, ws = rigid_state(model, np.zeros(1)), Workspace.for_system(model.system)
    trajectory = simulate(model.system, start, none, none, H, ws, from_equilibrium=False)
    found = reactions(model.system, trajectory, none, none)
    axis = slope.apply([0.0, 0.0, 1.0])
    assert np.abs(found.efforts).max() < 1e-9 and np.abs(found.forces @ axis).max() < 1e-9
    # it slides down as a body on a slope does
    slid = -0.5 * 9.81 * np.sin(np.pi / 6) * T**2
    assert np.abs(trajectory.states.c[:, 0] - np.outer(slid, axis)).max() < 1e-9
    # and what it carries is the weight across the axis, at the center of mass
    across = np.array([0.0, 0.0, 9.81 * 2.0]) - 9.81 * 2.0 * np.sin(np.pi / 6) * axis
    assert np.abs(found.forces - across).max() < 1e-8
    assert np.abs(found.moments - np.cross([0.0, 0.1, 0.0], across)).max() < 1e-8


@pytest.mark.parametrize("integrator", ["generalized-alpha", "newmark"])
@pytest.mark.parametrize("h", [0.02, 0.01, 0.005])
def test_efforts_do_not_alternate_by_coarse_steps(integrator, h):
    """A mass of 1 kg at 0.4 m is lifted from rest to rest: m l^2 q'' - m g l cos q, and what it weighs at the end."""
    model = compiled(chain(1, driven=(0,), length=0.4))
    times = np.arange(0.0, 1.0 + h / 2, h)
    s = np.clip((times - 0.2) / 0.4, 0.0, 1.0)
    shape = [np.polyval(np.polyder([6, -15, 10, 0, 0, 0], k), s) / 0.4**k for k in range(3)]
    values, rates, bends = -0.7 * np.stack(shape)[:, :, None]
    trajectory = simulate(
        model.system, rigid_state(model, values[0]), values, rates, h, Workspace.for_system(model.system),
        integrator=integrator,
    )  # fmt: skip
    efforts = reactions(model.system, trajectory, values, rates).efforts
    expected = 0.4**2 * bends - 9.81 * 0.4 * np.cos(values)
    assert np.abs(efforts - expected).max() < 0.03 * np.abs(expected).max()  # before: 1.1 and more, for ever by Newmark
    assert efforts[times > 0.7] == pytest.approx(expected[times > 0.7], rel=0.06 if h > 0.01 else 0.02)
