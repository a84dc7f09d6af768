"""The gradient of the whole chain, and the preconditioner against the rigid robot's own matrix."""

import dataclasses

import numpy as np
import pytest
from calmotion.dynamics.kinematics import rigid_poses
from calmotion.dynamics.model import compile_model, rigid_model
from calmotion.dynamics.topology import span_tree
from calmotion.retarget.curves import make_basis, make_grid, sample_tracks
from calmotion.retarget.objective import Objective
from calmotion.retarget.preconditioner import RigidPreconditioner, rigid_motor_jacobian
from calmotion.retarget.problem import RetargetProblem, rigid_motion
from scipy.spatial.transform import Rotation


def make_problem(arm, bodies, animation, pre_roll, smoothness=1e-6, kept=False):
    model = compile_model(arm, span_tree(arm), bodies)
    grid = make_grid(animation.frame_times, 1 / 240, pre_roll)
    angles, rates = sample_tracks(animation.tracks, grid)
    rigid = rigid_motion(model, angles, rates, grid.h)
    objective = Objective.over(model, rigid.reference, grid.times, grid.h)
    basis = make_basis(grid, 0.1, kept)
    return RetargetProblem(model, grid, angles, rates, objective, basis, np.array([0, 1]), smoothness, 1e-4, gain=1e-6)


@pytest.fixture(scope="module", params=[(0.0, False), (0.25, False), (0.0, True)], ids=["rest", "pre-roll", "kept"])
def linearized(request, arm, bodies, animation):
    pre_roll, kept = request.param
    problem = make_problem(arm, bodies, animation, pre_roll, kept=kept)
    x = 0.02 * np.random.default_rng(0).normal(size=problem.size)
    problem.value(x)
    # products need what `linearize` leaves behind, so differences are taken on a second problem
    other = make_problem(arm, bodies, animation, pre_roll, kept=kept)
    return problem, x, problem.linearize(), other


def test_gradient_matches_central_differences_of_the_whole_simulation(linearized):
    problem, x, gradient, other = linearized
    rng = np.random.default_rng(1)
    for _ in range(2):
        d = rng.normal(size=len(x))
        e = 1e-4

        def difference(e, d=d):
            return (other.value(x + e * d) - other.value(x - e * d)) / (2 * e)

        expected = (4.0 * difference(e) - difference(2 * e)) / 3.0
        assert abs(gradient @ d - expected) < 1e-7 * abs(expected)


def test_product_is_symmetric_and_follows_the_change_of_the_residuals(linearized):
    problem, x, _, _ = linearized
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, len(x)))
    Ha, Hb = problem.product(a), problem.product(b)
    assert abs(a @ Hb - b @ Ha) < 1e-11 * abs(a @ Hb)
    change = np.sum(problem.push_forward(a) ** 2) + a @ problem._bend(a)
    assert abs(a @ Ha - change) < 1e-11 * change


def test_static_start_follows_the_curves(arm, bodies, animation):
    """A change of the first coefficient alone already moves the first instant."""
    problem = make_problem(arm, bodies, animation, 0.0)
    problem.value(np.zeros(problem.size))
    problem.linearize()
    d = np.zeros(problem.size)
    d[1] = 1.0  # elbow
    change = problem.push_forward(d)
    assert np.abs(change[0, 1]).max() > 1e-3


def test_rigid_jacobian_matches_central_differences(arm, bodies, animation):
    problem = make_problem(arm, bodies, animation, 0.0)
    rigid = rigid_model(problem.model)
    motors = problem.angles[::40]
    J = rigid_motor_jacobian(rigid, rigid.joint_angles(motors), np.array([0, 1]))
    e = 1e-6
    for k in range(2):
        frames = []
        for sign in (1, -1):
            c, q = rigid_poses(rigid, rigid.joint_angles(motors + sign * e * np.eye(2)[k]))
            R = Rotation.from_quat(np.roll(q.reshape(-1, 4), -1, axis=1)).as_matrix().reshape(c.shape[:2] + (3, 3))
            t = rigid.targets
            own = t.component
            frames.append(c[:, own] + np.einsum("nkij,kj->nki", R[:, own], t.position))
        assert np.abs((frames[0] - frames[1]) / (2 * e) - J[:, :, :3, k]).max() < 1e-8


def test_preconditioner_inverts_the_rigid_gauss_newton_matrix(arm, bodies, animation):
    problem = make_problem(arm, bodies, animation, 0.0)
    rigid = rigid_model(problem.model)
    J = rigid_motor_jacobian(rigid, rigid.joint_angles(problem.angles), problem.motors)
    penalty = 1e-6 * problem.basis.bending + 1e-4 * problem.basis.closeness
    pre = RigidPreconditioner(J, problem.objective.weights, problem.basis.values, penalty)
    B = problem.basis.values.toarray()
    rows = np.einsum("nkia,np->nkipa", J * problem.objective.weights[..., None], B).reshape(-1, problem.size)
    H = rows.T @ rows + np.kron(penalty.toarray(), np.eye(2))
    H += 1e-9 * np.max(np.diag(H)) * np.eye(len(H))
    fixed = np.zeros(problem.size, bool)
    fixed[[3, 7]] = True
    b = np.random.default_rng(3).normal(size=problem.size)
    b[fixed] = 0.0
    pre.factor(fixed)
    free = ~fixed
    expected = np.zeros_like(b)
    expected[free] = np.linalg.solve(H[np.ix_(free, free)], b[free])
    assert np.abs(pre.solve(b) - expected).max() < 1e-6 * np.abs(expected).max()


def test_rotation_weight_alone_gives_a_consistent_gradient(arm, bodies, animation):
    targets = tuple(dataclasses.replace(t, position_weight=0.0, rotation_weight=1.0) for t in arm.targets)
    character = dataclasses.replace(arm, targets=targets)
    problem = make_problem(character, bodies, animation, 0.0)
    x = 0.02 * np.random.default_rng(5).normal(size=problem.size)
    problem.value(x)
    gradient = problem.linearize()
    d, e = np.random.default_rng(6).normal(size=len(x)), 1e-4

    def difference(e):
        return (problem.value(x + e * d) - problem.value(x - e * d)) / (2 * e)

    expected = (4.0 * difference(e) - difference(2 * e)) / 3.0
    assert abs(gradient @ d - expected) < 1e-7 * abs(expected)
