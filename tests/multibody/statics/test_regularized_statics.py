"""Linkages at rest whose tree has no stiffness of its own: the loop holds them; derivatives are those of the whole."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.model import WORLD, Body, Character, Frame, Joint, MassProperties, Motor, Target
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.failure import SimulationFailure
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
from dense import dense_matrix, free_sliders, join, multipliers, split
from neutral_hinges import push_rod, turning
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
    factor_closed_chains(system, matrix, ws.scratch.border)
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


def carried(kind, gravity=(0.0, 0.0, -9.81)):
    """An arm that a motor turns about z, with a carriage on a rail along x or a rod on a ball joint."""
    still = np.array([1.0, 0.0, 0.0, 0.0])
    along_x = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])
    heavy = [MassProperties(0.7, np.array([0.0, 0.0, z]), np.diag([2e-3, 2e-3, 1e-3])) for z in (0.0, -0.1)]
    at, end = Frame(np.zeros(3), still), np.array([0.3, 0.0, 0.0])
    bodies = (Body("/C/Arm", at, heavy[0]), Body("/C/End", Frame(end, still), heavy[1]))
    turned = along_x if kind == "prismatic" else still
    start = 0.2 if kind == "prismatic" else 0.3  # of the rail; the carriage stands 0.1 m from it
    joints = (
        Joint("/C/Motor", "revolute", WORLD, 0, at, at),
        Joint("/C/Free", kind, 0, 1, Frame(np.array([start, 0.0, 0.0]), turned), Frame(np.zeros(3), turned)),
    )
    target = Target("/C/End", 1, Frame(np.zeros(3), still))
    motor = Motor(0, joints[0].path, "drive:angular:physics:targetPosition")
    return compiled(Character("/C", bodies, joints, (motor,), (target,), np.array(gravity)))


def test_a_carriage_that_nothing_holds_keeps_its_place_on_the_rail():
    model = carried("prismatic")
    ws = Workspace.for_system(model.system)
    angles = np.array([0.4, 0.1])
    state, _ = equilibrium(model.system, rigid_state(model, angles), angles * [1, 0], ws)
    np.testing.assert_allclose(state.c[1], [0.3 * np.cos(0.4), 0.3 * np.sin(0.4), 0.0], atol=1e-9)
    assert np.abs(ws.blocks.res).max() < 1e-9


def test_a_carriage_on_a_rail_that_slopes_falls():
    model = carried("prismatic", (-1.0, 0.0, -9.81))
    angles = np.array([0.4, 0.1])
    with pytest.raises(SimulationFailure):
        equilibrium(model.system, rigid_state(model, angles), angles * [1, 0], Workspace.for_system(model.system))


@pytest.mark.parametrize("transposed", [False, True], ids=["plain", "transposed"])
@pytest.mark.parametrize("kind", ["prismatic", "spherical"])
def test_solutions_with_directions_that_nothing_holds_are_those_of_the_whole_matrix(kind, transposed):
    model = carried(kind)
    system, ws = model.system, Workspace.for_system(model.system)
    angles = np.array([0.4, 0.1 if kind == "prismatic" else 0.0])
    state, _ = equilibrium(system, rigid_state(model, angles), angles * [1, 0], ws)
    linearize(system, state, angles * [1, 0], ws)
    blocks, matrix, solution = ws.blocks, ws.matrix, ws.scratch.solution
    A = dense_matrix(system, Blocks(*[part.copy() for part in blocks]))
    for joint in np.flatnonzero(free_sliders(system)):
        row = multipliers(system, joint).start + 2
        A[row, row] = 1.0  # the length is an unknown
    A = A.T if transposed else A
    b = A @ np.random.default_rng(3).normal(size=len(A))
    regularize(system, blocks.K, blocks.Lc, blocks.Nc)
    assert factor(system, blocks, matrix, solution.block) == -1
    x, lam = split(system, b)
    (solve_statics_transposed if transposed else solve_statics)(system, matrix, x, lam, solution)
    assert np.abs(A @ join(system, x, lam) - b).max() < 1e-8 * np.abs(b).max()
    if kind == "prismatic" and not transposed:
        # the arm's motor turns the carriage with it: no length along the rail
        x, lam = np.zeros_like(x), np.zeros_like(lam)
        lam[:] = -blocks.by_angle * np.array([1.0, 0.0])[:, None]
        solve_statics(system, matrix, x, lam, solution)
        assert abs(lam[1, 2]) < 1e-12 and abs(x[1, 5] - 1.0) < 1e-9


def test_joints_with_motors_need_no_regularisation():
    model = compiled(chain(2, driven=(0, 1)))
    K, Lc, Nc = np.zeros((2, 6, 6)), np.zeros((2, 6, 6)), np.zeros((2, 6, 3))
    regularize(model.system, K, Lc, Nc)
    assert not K.any() and not Lc.any() and not Nc.any() and not is_regularized(model.system)
    assert is_regularized(compiled(chain(2, driven=(0,))).system)
