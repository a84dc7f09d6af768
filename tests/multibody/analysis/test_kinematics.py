import numpy as np
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_poses, rigid_state, target_frames, target_jacobians
from calmotion.multibody.kernels.so3 import turn
from calmotion.multibody.model.system import State
from particles import particle_system, random_state
from scipy.spatial.transform import Rotation


def test_chain_reaches_where_plane_trigonometry_says():
    model = compiled(chain(3, driven=(0, 1, 2), flipped=(1,)))
    motors = np.array([[0.3, -0.4, 1.1], [-2.0, 0.5, 0.1]])
    joints = model.joint_angles(motors)
    assert np.array_equal(joints[:, 1], -motors[:, 1])
    c, q = rigid_poses(model, joints)
    positions, _ = target_frames(model, c, q, np.zeros((2, 3, 0)))
    total = np.cumsum(joints, axis=1)
    # the y axis turns x towards -z
    expected = np.stack([np.cos(total).sum(1), np.zeros(2), -np.sin(total).sum(1)], axis=1)
    assert np.abs(positions[:, 0] - expected).max() < 1e-14


def test_values_and_their_transpose_belong_together():
    model = compiled(chain(3, driven=(0, 2), flipped=(2,)))
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(5, 2)), rng.normal(size=(5, 3))
    assert abs(np.sum(model.joint_angles(a) * b) - np.sum(a * model.motor_values(b))) < 1e-14


def test_rest_angles_are_read_from_the_authored_pose():
    import dataclasses

    character = chain(2)
    turned = np.array([np.cos(0.2), 0.0, np.sin(0.2), 0.0])
    body = character.bodies[1]
    bodies = (character.bodies[0], dataclasses.replace(body, rest=dataclasses.replace(body.rest, rotation=turned)))
    assert np.allclose(compiled(dataclasses.replace(character, bodies=bodies)).rest_angles, [0.0, 0.4])


def test_target_jacobian_matches_central_differences():
    rng = np.random.default_rng(4)
    model = compiled(chain(2, driven=(0,)))
    system, _ = particle_system(rng, [-1, 0], [3, 2])
    import dataclasses

    targets = dataclasses.replace(
        model.targets, Phi=rng.normal(size=(1, 3, 3)), Psi=rng.normal(size=(1, 3, 3)), component=np.array([0], np.int32)
    )
    model = dataclasses.replace(model, system=system, targets=targets)
    state = random_state(rng, system)
    J = target_jacobians(model, state.c[None], state.q[None], state.u[None])[0, 0]

    def frames(z):
        moved = State(*[part.copy() for part in state])
        R = Rotation.from_quat(np.roll(state.q[0], -1)).as_matrix()
        moved.c[0] += R @ z[:3]
        turn(state.q[0], z[3:6], moved.q[0])
        moved.u[0] += z[6:]
        p, q = target_frames(model, moved.c[None], moved.q[None], moved.u[None])
        return p[0, 0], Rotation.from_quat(np.roll(q[0, 0], -1))

    e = 1e-6
    _, base = frames(np.zeros(9))
    for k in range(9):
        (p1, r1), (p0, r0) = frames(e * np.eye(9)[k]), frames(-e * np.eye(9)[k])
        turned = (base.inv() * r1).as_rotvec() - (base.inv() * r0).as_rotvec()
        assert np.abs(np.concatenate([p1 - p0, turned]) / (2 * e) - J[:, k]).max() < 1e-8


def test_rigid_state_rests():
    model = compiled(chain(2, driven=(0, 1)))
    state = rigid_state(model, np.array([0.1, 0.2]))
    assert not state.V.any() and not state.turn.any()
