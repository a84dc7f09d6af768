"""The rigid robot's response to its motors against differences of poses, and its mass matrix against kinetic energy."""

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.rigid_response import RigidResponse, motor_responses
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.kernels.markers import WORLD_MARKER
from calmotion.multibody.model.model import rigid_model
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.intended_motion import rigid_motion
from calmotion.simulation.preparation import prepare
from calmotion.testing import beam_arm, shot_of
from linkage_arm import linkage_arm, performance
from scipy.spatial.transform import Rotation


def prepared(character, meshes, animation):
    bodies = reduce_bodies(character, span_tree(character), meshes)
    return prepare(compile_shot(character, animation, bodies), RunSettings(step=1 / 96, pre_roll=0.0))


@pytest.fixture(scope="module", params=["arm", "four-bar"])
def case(request):
    if request.param == "arm":
        shot = prepared(*beam_arm(2, modes=2), shot_of(lambda t: 0.9 * t**2, 1.0, motors=2))
    else:
        shot = prepared(*linkage_arm(modes=2), performance(1.0))
    rigid = rigid_model(shot.model)
    animation = performance(1.0) if request.param != "arm" else shot_of(lambda t: 0.9 * t**2, 1.0, motors=2)
    angles, _ = sample_tracks(animation.tracks, shot.grid)
    return rigid, angles, shot.grid.h


def response(rigid, angles, h):
    motion = rigid_motion(rigid, angles, np.zeros_like(angles), h)
    world = np.zeros((len(angles), 0, WORLD_MARKER))
    times = h * np.arange(len(angles))
    motors = np.arange(angles.shape[1], dtype=np.int32)
    return motion, motor_responses(rigid, motion.c, motion.q, rigid.joint_angles(angles), motors, world, times)


def test_motions_are_the_derivatives_of_the_poses(case):
    rigid, angles, h = case
    motion, (motions, _) = response(rigid, angles, h)
    R = Rotation.from_quat(np.roll(motion.q.reshape(-1, 4), -1, axis=1)).as_matrix().reshape(motion.c.shape + (3,))
    e = 1e-5
    for m in range(angles.shape[1]):
        up, down = (rigid_motion(rigid, angles + s * e * np.eye(angles.shape[1])[m], np.zeros_like(angles), h)
                    for s in (1, -1))  # fmt: skip
        expected = np.einsum("nbji,nbj->nbi", R, (up.c - down.c) / (2 * e))
        assert np.abs(expected - motions[:, :, :3, m]).max() < 1e-6


def test_efforts_of_unit_accelerations_are_the_mass_matrix(case):
    rigid, angles, h = case
    _, (motions, inertia) = response(rigid, angles, h)
    system = rigid.system
    expected = np.zeros(inertia.shape)
    for b in range(len(system.parent)):
        x = motions[:, b]
        s = system.s[b]
        cross = np.array([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
        # second moments Z = int rho X X^T give the inertia tr(Z) 1 - Z
        M = np.block([[system.mass[b] * np.eye(3), -cross], [cross, np.trace(system.Z[b]) * np.eye(3) - system.Z[b]]])
        expected += np.einsum("nia,ij,njb->nab", x, M, x)
    assert np.abs(inertia - np.swapaxes(inertia, 1, 2)).max() < 1e-9 * np.abs(inertia).max()
    assert np.abs(inertia - expected).max() < 1e-9 * np.abs(expected).max()


def test_a_singular_pose_is_reported_at_its_time(case):
    rigid, angles, h = case
    motion = rigid_motion(rigid, angles, np.zeros_like(angles), h)
    singular, q = 6, motion.q.copy()
    q[singular] = np.nan
    motors, world = np.arange(angles.shape[1], dtype=np.int32), np.zeros((len(angles), 0, WORLD_MARKER))
    joint_angles, times = rigid.joint_angles(angles), h * np.arange(len(angles))
    with pytest.raises(SimulationFailure) as failure:
        RigidResponse.along(rigid, motion.c, q, joint_angles, motors, world, times, stride=3)
    assert failure.value.time_s == times[singular]
    assert failure.value.reason == "singular"
