"""Moving roots: their markers against differences, and a robot on one against the same robot carried by motors."""

import numpy as np
import pytest
from calmotion.model import Body, Character, Frame, Joint, MassProperties, Motor, Target
from calmotion.model.animation import MovingFrame
from calmotion.multibody.analysis.kinematics import rigid_poses
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import body_anchors, compile_model, rigid_body
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.forward import run_forward
from calmotion.simulation.inputs.curves import needed_pre_roll
from calmotion.simulation.inputs.roots import root_tracks, sample_roots
from calmotion.simulation.inputs.time_grid import make_grid
from scipy.spatial.transform import Rotation

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
X_UP = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])  # joint axis z along the body's x
AXIS = np.array([0.6, 0.0, 0.8])
FRAMES = np.linspace(0.0, 1.0, 25)


def frame(x=0.0, rotation=IDENTITY):
    return Frame(np.array([x, 0.0, 0.0]), rotation)


def swaying(phase=0.0):
    angle = 0.4 * np.sin(3.0 * FRAMES + phase)
    position = np.outer(0.2 * np.sin(5.0 * FRAMES + phase), [1.0, 0.5, 0.0])
    rotations = Rotation.from_rotvec(np.outer(angle, AXIS)) * Rotation.from_rotvec([0.3, 0.1, 0.0])
    return MovingFrame(0, FRAMES, position, np.roll(rotations.as_quat(), 1, axis=1))


@pytest.mark.parametrize("pre_roll", [0.0, 0.5])
def test_velocities_are_those_of_the_motion(pre_roll):
    grid = make_grid(FRAMES, 1e-3, pre_roll)
    world, h = sample_roots([swaying(0.4)], grid)[:, 0], grid.h
    position, R = world[:, :3], Rotation.from_matrix(world[:, 9:].reshape(-1, 3, 3))
    velocity = (position[2:] - position[:-2]) / (2.0 * h)
    spin = (R[:-2].inv() * R[2:]).as_rotvec() / (2.0 * h)
    middle = world[1:-1]
    # the middle instant's axes, half a turn on
    spin = (R[1:-1].inv() * R[:-2]).apply(spin)
    assert np.abs(velocity - middle[:, 3:6]).max() < 1e-4
    assert np.abs(spin - middle[:, 6:9]).max() < 1e-4
    shown = world[grid.frames]
    assert np.abs(shown[:, :3] - swaying(0.4).positions).max() < 1e-12
    if pre_roll:
        assert np.abs(world[0, 3:9]).max() < 1e-12, "a pre-roll starts at rest"


def test_a_cyclic_root_is_smooth_at_the_seam():
    wave = 2.0 * np.pi * FRAMES
    rotations = Rotation.from_rotvec(np.outer(0.4 * np.sin(wave + 0.3), AXIS))
    walked = np.outer(0.2 * np.sin(wave), [1.0, 0.5, 0.0])
    root = MovingFrame(0, FRAMES, walked, np.roll(rotations.as_quat(), 1, axis=1))
    grid = make_grid(FRAMES, 1e-3, 0.0, cyclic=True)
    world, h = sample_roots([root], grid)[:, 0], grid.h
    R = Rotation.from_matrix(world[:, 9:].reshape(-1, 3, 3))
    spin = (R[1:-1].inv() * R[:-2]).apply((R[:-2].inv() * R[2:]).as_rotvec() / (2.0 * h))
    assert np.abs(spin - world[1:-1, 6:9]).max() < 1e-4
    assert np.abs((world[2:, :3] - world[:-2, :3]) / (2.0 * h) - world[1:-1, 3:6]).max() < 1e-4
    assert np.abs(world[:2] - world[-2:]).max() < 1e-9
    assert np.abs(world[grid.frames, :3] - walked).max() < 1e-12


def test_a_root_in_motion_at_the_start_asks_for_a_pre_roll():
    assert needed_pre_roll(root_tracks([swaying()]), FRAMES) > 0.0
    turned = Rotation.from_rotvec(np.outer(FRAMES**3, AXIS))
    from_rest = MovingFrame(0, FRAMES, np.outer(FRAMES**2, AXIS), np.roll(turned.as_quat(), 1, axis=1))
    assert needed_pre_roll(root_tracks([from_rest]), FRAMES) == 0.0
    turned = np.linalg.norm([track.values for track in root_tracks([swaying()])[3:]], axis=0)
    assert turned.max() == pytest.approx(0.4, rel=2e-3)


def carried(root_moves):
    """A pendulum of two hinges under a cart that goes along x and turns about it: told to, or driven to by motors."""
    mass = MassProperties(0.3, np.array([0.05, 0.0, -0.1]), 2e-3 * np.eye(3))
    links = [Body(f"/C/L{k}", frame(), mass) for k in range(2)]
    hinge = Joint("/C/Swing", "revolute", 0, 1, Frame(np.array([0.1, 0.0, -0.2]), IDENTITY), frame())
    tip = Target("/C/tip", 1, Frame(np.array([0.0, 0.1, -0.3]), IDENTITY))
    gravity = np.array([1.0, 0.0, -9.81])
    if root_moves:
        joints = (Joint("/C/L0", "fixed", -1, 0, frame(), frame()), hinge)
        character = Character("/C", tuple(links), joints, (), (tip,), gravity)
    else:
        cart = Body("/C/Cart", frame(), MassProperties(0.1, np.zeros(3), 1e-3 * np.eye(3)))
        joints = (
            Joint("/C/Slide", "prismatic", -1, 2, frame(0.0, X_UP), frame(0.0, X_UP)),
            Joint("/C/Turn", "revolute", 2, 0, frame(0.0, X_UP), frame(0.0, X_UP)),
            hinge,
        )
        motors = (Motor(0, "/C/Slide", "drive:linear:physics:targetPosition"), Motor(1, "/C/Turn", "drive"))
        character = Character("/C", (*links, cart), joints, motors, (tip,), gravity)
    tree = span_tree(character)
    bodies = [rigid_body(b, a) for b, a in zip(character.bodies, body_anchors(character, tree), strict=True)]
    return compile_model(character, tree, bodies, [0] if root_moves else [])


def motion(t):
    """Length and angle of the cart's motors with their rates, shape [T, 2] each."""
    s, c = np.sin(2.0 * np.pi * t), np.cos(2.0 * np.pi * t)
    values = np.stack([0.05 * (t - s / (2.0 * np.pi)), 0.3 * (t - s / (2.0 * np.pi))], axis=1)
    return values, np.stack([0.05 * (1.0 - c), 0.3 * (1.0 - c)], axis=1)


def test_a_prescribed_root_moves_the_robot_as_motors_would():
    tips = {}
    for h in (1.0 / 240.0, 1.0 / 480.0):
        t = np.arange(0.0, 1.0 + h / 2, h)
        values, rates = motion(t)
        model = carried(False)
        by_motors = run_forward(model, Workspace.for_system(model.system), values, rates, h)
        x = np.outer(values[:, 0], [1.0, 0.0, 0.0])
        told = Rotation.from_rotvec(np.outer(values[:, 1], [1.0, 0.0, 0.0]))
        root = MovingFrame(0, t, x, np.roll(told.as_quat(), 1, axis=1))
        world = sample_roots([root], make_grid(t, h, 0.0))
        model, none = carried(True), np.zeros((len(t), 0))
        free = run_forward(model, Workspace.for_system(model.system), none, none, h, world)
        tips[h] = np.abs(free.target_positions - by_motors.target_positions).max()
        moved = np.abs(np.diff(by_motors.target_positions, axis=0)).sum()
        assert moved > 0.05 and free.trajectory.max_joint_gap < 1e-6
        c, _ = rigid_poses(model, np.zeros((len(t), 2)), world)
        assert np.abs(c[:, 0] - x).max() < 1e-12
    coarse, fine = tips.values()
    assert coarse < 1e-4 and (fine < 1e-8 or coarse / fine > 3.0), tips
