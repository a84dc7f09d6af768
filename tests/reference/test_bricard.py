"""Bricard mechanism (IFToMM): five bars of 1 m and 1 kg and the ground along six edges of a cube, six hinges.

Each hinge is across the two bars that it joins. By counting it cannot move (one constraint is redundant), yet it does.
"""

import numpy as np
import pytest
from calmotion.model import WORLD, Body, Character, Frame, Joint, MassProperties, Target
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.joint_arrays import body_anchors
from calmotion.multibody.model.model import compile_model, rigid_body
from calmotion.multibody.model.topology import span_tree
from scipy.spatial.transform import Rotation

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 0, 1]], float)
GRAVITY = np.array([0.0, -9.81, 0.0])
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def bricard():
    bodies, joints = [], []
    ends = np.roll(CORNERS, -1, axis=0)
    for k in range(5):
        along = ends[k] - CORNERS[k]
        inertia = (np.eye(3) - np.outer(along, along)) / 12.0 + 1e-9 * np.eye(3)
        bodies.append(Body(f"/C/Bar{k}", Frame(CORNERS[k], IDENTITY), MassProperties(1.0, 0.5 * along, inertia)))
    for k in range(6):
        one, other = (k - 1, k) if 0 < k < 5 else ((WORLD, 0) if k == 0 else (WORLD, 4))
        axis = np.cross(CORNERS[k] - CORNERS[k - 1], ends[k] - CORNERS[k])
        turn, _ = Rotation.align_vectors(axis[None], [[0.0, 0.0, 1.0]])
        quaternion = np.roll(turn.as_quat(), 1)
        sides = [Frame(CORNERS[k] - (0.0 if b == WORLD else bodies[b].rest.position), quaternion) for b in (one, other)]
        joints.append(Joint(f"/C/Hinge{k}", "revolute", one, other, *sides))
    target = Target("/C/P3", 2, Frame(ends[2] - CORNERS[2], IDENTITY))
    character = Character("/C", tuple(bodies), tuple(joints), (), (target,), GRAVITY)
    tree = span_tree(character)
    return compile_model(
        character, tree, [rigid_body(b, a) for b, a in zip(bodies, body_anchors(character, tree), strict=True)]
    )


def energies(model, states):
    """Kinetic and potential energy at all instants [J], shape [T] each."""
    system = model.system
    R = Rotation.from_quat(np.roll(states.q, -1, axis=-1).reshape(-1, 4)).as_matrix().reshape(*states.q.shape[:2], 3, 3)
    w, omega = np.einsum("tbij,tbi->tbj", R, states.V[..., :3]), states.V[..., 3:6]
    J = np.array([np.trace(Z) * np.eye(3) - Z for Z in system.Z])
    kinetic = 0.5 * np.einsum("b,tbi,tbi->t", system.mass, w, w)
    kinetic += np.einsum("tbi,tbi->t", w, np.cross(omega, system.s[None])) + 0.5 * np.einsum(
        "tbi,bij,tbj->t", omega, J, omega
    )
    centers = states.c * system.mass[:, None] + np.einsum("tbij,bj->tbi", R, system.s)
    return kinetic, -centers.sum(axis=1) @ GRAVITY


def released(h, seconds):
    model = bricard()
    none = np.zeros((round(seconds / h) + 1, len(model.system.rows)))
    start, ws = rigid_state(model, none[0]), Workspace.for_system(model.system)
    return model, simulate(model.system, start, none, none, h, ws, from_equilibrium=False)


def test_it_moves_with_its_energy_kept_at_the_order_of_the_scheme():
    drifts = []
    for h in (4e-3, 2e-3):
        model, trajectory = released(h, 4.0)
        assert len(model.tree.closing) == 1 and trajectory.refined == ()
        kinetic, potential = energies(model, trajectory.states)
        drifts.append(np.abs(kinetic + potential - potential[0] - kinetic[0]).max() / kinetic.max())
        assert kinetic.max() > 5.0, "it falls"
        assert trajectory.max_joint_gap < 1e-8 and np.all(np.isfinite(trajectory.states.lam))
        # the redundant constraint leaves no load of its own: what the joints carry is of the size of the weights
        assert np.abs(trajectory.states.lam).max() < 50.0 * 5.0 * 9.81
    assert 1.6 < np.log2(drifts[0] / drifts[1]) < 3.4 and drifts[1] < 0.02, drifts


@pytest.mark.long
def test_it_runs_for_ten_seconds():
    model, trajectory = released(1e-3, 10.0)
    kinetic, potential = energies(model, trajectory.states)
    assert np.abs(kinetic + potential - potential[0]).max() < 0.02 * kinetic.max()
    assert trajectory.max_joint_gap < 1e-8 and trajectory.refined == ()
