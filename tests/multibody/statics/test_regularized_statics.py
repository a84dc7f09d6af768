"""Linkages at rest whose tree has no stiffness of its own: the loop holds them; derivatives are those of the whole."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.benchmarks.scenes.neutral_hinges import push_rod, turning
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.linear_solver.closed_chains import factor_closed_chains
from calmotion.multibody.linear_solver.elimination import factor
from calmotion.multibody.model.system import Blocks
from calmotion.multibody.statics.equilibrium import equilibrium, linearize
from calmotion.multibody.statics.regularized_statics import (
    is_regularized,
    regularize,
    solve_statics,
    solve_statics_transposed,
)
from dense import dense_matrix, join, split
from scipy.spatial.transform import Rotation


def resting(model, motor=0.4):
    """Its equilibrium, the angles of its joints, and a workspace with the static equations there."""
    ws = Workspace.for_system(model.system)
    angles = model.joint_angles(np.array([motor] if model.motor.max() >= 0 else []))
    state, _ = equilibrium(model.system, rigid_state(model, np.zeros(3)), angles, ws)
    linearize(model.system, state, angles, ws)
    return state, ws


@pytest.mark.parametrize("gravity", [(0, 0, 0), (0, -9.81, 0), (0, 0, -9.81)], ids=["none", "across", "in its plane"])
def test_a_linkage_rests_where_its_motor_has_it(gravity):
    state, ws = resting(compiled(push_rod(gravity)))
    rotation = Rotation.from_quat(np.roll(state.q, -1, axis=1)).as_matrix()
    for body in (0, 1):  # both turn by the crank's angle, about y
        np.testing.assert_allclose(np.abs(np.arctan2(rotation[body, 0, 2], rotation[body, 0, 0])), 0.4, atol=1e-10)
    assert np.abs(ws.blocks.res).max() < 1e-10 and np.abs(ws.blocks.gap).max() < 1e-11
    assert np.abs(state.lam).max() < 10.0, "forces are of the size of the weights"


@pytest.mark.parametrize("transposed", [False, True], ids=["plain", "transposed"])
@pytest.mark.parametrize(
    "made",
    [((0, 0, 0),), ((0, 0, -9.81), -0.02, False)],
    ids=["held by its loop alone", "hanging, so that it can swing"],
)
def test_solutions_are_those_of_the_whole_matrix(made, transposed):
    model = compiled(push_rod(*made))
    system = model.system
    _, ws = resting(model)
    blocks, matrix, solution = ws.blocks, ws.matrix, ws.scratch.solution
    A = dense_matrix(system, Blocks(*[part.copy() for part in blocks]))
    A = A.T if transposed else A  # free rows of joints are zero
    b = A @ np.random.default_rng(3).normal(size=len(A))  # that has a solution, though multipliers are redundant
    regularize(system, blocks.K, blocks.Lc, blocks.Nc)
    assert factor(system, blocks, matrix, solution.block) == -1
    factor_closed_chains(system, matrix, ws.scratch.border, solution)
    x, lam = split(system, b)
    solve = solve_statics_transposed if transposed else solve_statics
    solve(system, matrix, x, lam, solution)
    found, expected = join(system, x, lam), np.linalg.lstsq(A, b, rcond=1e-10)[0]
    assert np.abs(A @ found - b).max() < 1e-9 * np.abs(b).max()
    motion = slice(0, 6 * len(system.parent))
    np.testing.assert_allclose(found[motion], expected[motion], atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("gravity", [(0, 0, -9.81), (0, -9.81, 0)], ids=["wheel", "door"])
def test_a_free_joint_without_stiffness_keeps_its_angle_and_moves_with_its_parent(gravity):
    model = compiled(turning(gravity, 0.1 * (gravity[2] == 0)))
    state, ws = resting(model)
    for rotation in Rotation.from_quat(np.roll(state.q, -1, axis=1)).as_rotvec():
        np.testing.assert_allclose(rotation, [0.0, 0.0, 0.4], atol=1e-10)
    assert np.abs(ws.blocks.res).max() < 1e-10


def test_joints_with_motors_need_no_regularisation():
    model = compiled(chain(2, driven=(0, 1)))
    K, Lc, Nc = np.zeros((2, 6, 6)), np.zeros((2, 6, 6)), np.zeros((2, 6, 3))
    regularize(model.system, K, Lc, Nc)
    assert not K.any() and not Lc.any() and not Nc.any() and not is_regularized(model.system)
    assert is_regularized(compiled(chain(2, driven=(0,))).system)
