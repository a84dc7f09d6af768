"""LoadEnvelope of the bodies of simple robots against mechanics done by hand."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import (
    Animation,
    Body,
    Character,
    FEMesh,
    FEMeshes,
    Frame,
    Joint,
    MassProperties,
    MeshQuality,
    Motor,
    Target,
    Track,
)
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.inputs.time_grid import make_grid
from calmotion.simulation.rigid_run import highest_frequency, rigid_bodies, shot_load_envelopes

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
LENGTH, MASS, AMPLITUDE, FREQUENCY = 0.5, 2.0, 0.3, 3.0


def frame(x=0.0, rotation=IDENTITY):
    return Frame(np.array([x, 0.0, 0.0]), rotation)


def animation(times, tracks):
    return Animation(times, tuple(tracks), tuple(tracks))


def turntable():
    """A link turned about z by a motor, a point mass welded to its end (the joint's axes turned about x)."""
    turned = np.array([np.cos(0.3), np.sin(0.3), 0.0, 0.0])
    inertia = 1e-9 * np.eye(3)
    bodies = (
        Body("/T/Link", frame(), MassProperties(1.0, np.array([LENGTH / 2, 0.0, 0.0]), inertia)),
        Body("/T/Load", frame(LENGTH), MassProperties(MASS, np.array([0.1, 0.0, 0.0]), inertia)),
    )
    joints = (
        Joint("/T/Motor", "revolute", -1, 0, frame(), frame()),
        Joint("/T/Weld", "fixed", 0, 1, frame(LENGTH, turned), frame(0.0, turned)),
    )
    motors = (Motor(0, "/T/Motor", "drive:angular:physics:targetPosition"),)
    targets = (Target("/T/Load/tip", 1, frame(0.25)),)
    return Character("/T", bodies, joints, motors, targets, np.array([0.0, 0.0, -9.81]))


@pytest.fixture(scope="module")
def oscillation():
    """The turntable swings as a sine that fades in; peaks of a full swing are those of the sine."""
    character = turntable()
    times = np.arange(481) / 120.0
    s = np.clip(times / 2.5, 0.0, 1.0)
    fade = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    track = Track(times, AMPLITUDE * fade * np.sin(2 * np.pi * FREQUENCY * times))
    return shot_load_envelopes(
        character, animation(times, [track]), make_grid(times, 1 / 960, 0.0), span_tree(character), None
    )


def test_accelerations_of_a_swinging_link(oscillation):
    link, load = oscillation
    w = 2 * np.pi * FREQUENCY
    assert np.allclose(link.acceleration, [0.0, 0.0, 9.81], atol=2e-3)
    assert np.allclose(link.angular_acceleration, [0.0, 0.0, AMPLITUDE * w**2], rtol=0.01, atol=1e-6)
    assert np.allclose(link.angular_velocity, [0.0, 0.0, AMPLITUDE * w], rtol=0.01, atol=1e-6)
    # the load's origin: centripetal inwards, tangential across
    expected = [LENGTH * (AMPLITUDE * w) ** 2, LENGTH * AMPLITUDE * w**2, 9.81]
    assert np.allclose(load.acceleration, expected, rtol=0.02)


def test_force_and_moment_of_the_load_on_its_carrier(oscillation):
    link, load = oscillation
    w = 2 * np.pi * FREQUENCY
    radius = LENGTH + 0.1
    assert np.allclose(link.force[0], 0.0) and np.allclose(link.moment[0], 0.0)  # the joint that carries it
    force = MASS * np.array([radius * (AMPLITUDE * w) ** 2, radius * AMPLITUDE * w**2, 9.81])
    assert np.allclose(link.force[1], force, rtol=0.02)
    # arm 0.1 m along x, in the link's axes although the joint's own are turned
    assert np.allclose(link.moment[1], [0.0, 0.1 * force[2], 0.1 * force[1]], rtol=0.02, atol=1e-3 * force[2])
    assert load.force.shape == (1, 3) and np.all(load.force == 0.0)


def test_reach_is_the_distance_to_the_target_beyond(oscillation):
    assert oscillation[0].target_distance == pytest.approx([0.0, 0.25], abs=1e-6)


def test_the_highest_frequency_is_that_of_the_motion(oscillation):
    for body in oscillation:
        assert FREQUENCY <= body.frequency <= 2.5 * FREQUENCY


def test_highest_frequency_of_known_signals():
    t = np.arange(4000) / 1000.0
    tone = np.sin(2 * np.pi * 7.0 * t)[:, None]
    assert highest_frequency(tone, 1e-3) == pytest.approx(7.0, abs=0.6)
    assert highest_frequency(tone + 0.2 * np.sin(2 * np.pi * 40.0 * t)[:, None], 1e-3) == pytest.approx(40.0, abs=0.6)
    assert highest_frequency(tone + 0.002 * np.sin(2 * np.pi * 40.0 * t)[:, None], 1e-3) == pytest.approx(7.0, abs=0.6)
    assert highest_frequency(np.full((100, 3), 9.81), 1e-3) == 0.0
    assert highest_frequency(np.zeros((1, 3)), 1e-3) == 0.0


def test_the_load_of_a_robot_at_rest_is_its_weight():
    character = turntable()
    times = np.arange(25) / 24.0
    tracks = [Track(times, np.full(25, 0.4))]
    link, load = shot_load_envelopes(
        character, animation(times, tracks), make_grid(times, None, 0.0), span_tree(character), None
    )
    for body in (link, load):
        assert np.allclose(body.acceleration, [0.0, 0.0, 9.81], atol=1e-6)
        assert np.abs(body.angular_acceleration).max() < 1e-6 and body.frequency == 0.0
    assert np.allclose(link.force[1], [0.0, 0.0, MASS * 9.81], atol=1e-6)


def link(elements=8, length=0.32, width=0.022):
    """The mesh of the links of the fixture `arm`."""
    from skfem import MeshTet

    across = np.array([-width / 2, width / 2])
    mesh = MeshTet.init_tensor(np.linspace(0.0, length, elements + 1), across, across)
    return np.ascontiguousarray(mesh.p.T), np.ascontiguousarray(mesh.t.T.astype(np.int32))


def test_flexible_bodies_weigh_as_their_meshes(arm, bodies):
    """The masses of the rigid robot are those of the reduced one."""
    tree = span_tree(arm)
    points, tets = link()
    meshes = FEMeshes(tuple(FEMesh(k, points, tets, MeshQuality(0.0, 0.0, 0.0)) for k in range(2)))
    for rigid, reduced in zip(rigid_bodies(arm, tree, meshes), bodies, strict=True):
        assert rigid.invariants.mass == pytest.approx(reduced.invariants.mass, rel=1e-12)
        assert np.allclose(rigid.invariants.s, reduced.invariants.s, rtol=0, atol=1e-12)
        assert np.allclose(rigid.invariants.Z, reduced.invariants.Z, rtol=0, atol=1e-13)
    heavy = dataclasses.replace(arm.bodies[0], mass=MassProperties(3.0, np.zeros(3), np.zeros((3, 3))))
    character = dataclasses.replace(arm, bodies=(heavy, *arm.bodies[1:]))
    assert rigid_bodies(character, tree, meshes)[0].invariants.mass == pytest.approx(3.0)
