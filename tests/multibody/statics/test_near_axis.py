"""Free joints whose load lies next to their axis hang down; where rounding alone turns them, they stay as they are."""

from dataclasses import replace

import numpy as np
import pytest
from arms import compiled
from calmotion.model import Body, Frame, Joint, MassProperties
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import start_angles
from calmotion.multibody.statics.equilibrium import equilibrium
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.testing.beam_arms import IDENTITY
from neutral_hinges import push_rod, turning

ASIDE = (0.0, 1.0, 0.0)
SLANTED = (0.0, 0.6, 0.8)


def at_rest(character):
    """The rotation matrix of each body of a character in its equilibrium, by the body's number."""
    model = compiled(character)
    angles = np.zeros(len(model.motor))
    start = rigid_state(model, start_angles(model, angles))
    state, _ = equilibrium(model.system, start, angles, Workspace.for_system(model.system))
    return lambda body: rotation_from_quaternion(state.q[list(model.tree.body).index(body)])


def with_ball_rods(offsets, direction):
    """The push rod's parallelogram with further rods beside it, between ball joints, their masses off their axes."""
    character = push_rod((0.0, 0.0, -9.81), 0.01)
    bodies, joints = list(character.bodies), list(character.joints)
    for k, offset in enumerate(offsets):
        side = 0.02 * (k + 1)
        here, there = Frame(np.array([0.0, side, 0.05]), IDENTITY), Frame(np.array([0.3, 0.0, 0.0]), IDENTITY)
        near = Frame(np.zeros(3), IDENTITY)
        center = np.array([0.15, 0.0, 0.0]) + offset * np.array(direction)
        mass = MassProperties(0.005, center, np.diag([1e-8, 4e-6, 4e-6]))
        bodies.append(Body(f"/Rod/Ball{k}", here, mass))
        joints.append(Joint(f"/Rod/NearBall{k}", "spherical", 0, len(bodies) - 1, here, near))
        joints.append(Joint(f"/Rod/FarBall{k}", "spherical", len(bodies) - 1, 1, there, here))
    return replace(character, bodies=tuple(bodies), joints=tuple(joints))


@pytest.mark.parametrize("offset", [0.0, 1e-16, 1e-13, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3])
@pytest.mark.parametrize("direction", [ASIDE, SLANTED], ids=["aside", "slanted"])
def test_a_rod_between_ball_joints_moves_nothing_by_turning_about_itself(offset, direction):
    turned = at_rest(with_ball_rods((offset,), direction))(3)
    np.testing.assert_allclose(turned[:, 0], [1.0, 0.0, 0.0], atol=1e-9)
    if offset >= 1e-10:
        assert (turned @ np.array(direction))[2] < -1.0 + 1e-3


def test_rods_of_different_offsets_hang_down_together():
    """Each has another stiffness; three of them start above their axes, where it is negative."""
    offsets = (1e-9, 3e-7, 2e-5, -1e-8)
    turned = at_rest(with_ball_rods(offsets, SLANTED))
    for k, offset in enumerate(offsets):
        assert np.sign(offset) * (turned(3 + k) @ np.array(SLANTED))[2] < -1.0 + 1e-3, offset


@pytest.mark.parametrize("offset", [1e-15, 1e-12, 1e-10, 1e-8, 1e-6, 1e-3])
def test_a_wheel_whose_mass_lies_next_to_its_axle_hangs_down(offset):
    turned = at_rest(turning((0.0, 0.0, -9.81), offset))(1)
    if offset >= 1e-10:
        np.testing.assert_allclose(turned[:, 0], [0.0, 0.0, -1.0], atol=1e-3)
