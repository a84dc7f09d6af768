"""Linkages at rest whose tree has no stiffness of its own: the loop holds them; derivatives are those of the whole."""

import numpy as np
import pytest
from arms import Z_TO_Y, chain, compiled, frame
from calmotion.dynamics.elimination import factor
from calmotion.dynamics.held_statics import hold, solve_statics, solve_statics_transposed
from calmotion.dynamics.kinematics import rigid_state
from calmotion.dynamics.loops import factor_loops
from calmotion.dynamics.simulation import Workspace
from calmotion.dynamics.statics import equilibrium, linearize
from calmotion.dynamics.system import Blocks
from calmotion.shot import Body, Character, Joint, MassProperties, Motor, Target
from dense import dense_matrix, join, split


def linkage(gravity, offset=0.0, driven=True):
    """A crank and a balanced horn with a rod between them, in the plane of x and z; `offset` of the horn's mass [m]."""
    disc = MassProperties(0.4, np.array([0.0, 0.0, offset]), 1e-3 * np.eye(3))
    rod = MassProperties(0.1, np.array([0.15, 0.0, 0.0]), 1e-3 * np.eye(3))
    bodies = (
        Body("/L/Crank", frame(), disc), Body("/L/Horn", frame(0.3), disc), Body("/L/Rod", frame(z=0.05), rod)
    )  # fmt: skip

    def pin(name, parent, body, here, there):
        return Joint(f"/L/{name}", "revolute", parent, body, frame(*here, Z_TO_Y), frame(*there, Z_TO_Y))

    up, far = (0.0, 0.0, 0.05), (0.3, 0.0, 0.0)
    joints = (
        pin("Motor", -1, 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), pin("Pivot", -1, 1, far, (0.0, 0.0, 0.0)),
        pin("Near", 0, 2, up, (0.0, 0.0, 0.0)), pin("Far", 2, 1, far, up),
    )  # fmt: skip
    motors = (Motor(0, "/L/Motor", "drive:angular:physics:targetPosition"),) if driven else ()
    return compiled(
        Character("/L", bodies, joints, motors, (Target("/L/Horn", 1, frame(*up)),), np.array(gravity, dtype=float))
    )


def resting(model, motor=0.4):
    """Its equilibrium, the angles of its joints, and a workspace with the static equations there."""
    ws = Workspace.for_system(model.system)
    angles = model.joint_angles(np.array([motor] if model.motor.max() >= 0 else []))
    state, _ = equilibrium(model.system, rigid_state(model, np.zeros(3)), angles, ws)
    linearize(model.system, state, angles, ws)
    return state, ws


@pytest.mark.parametrize("gravity", [(0, 0, 0), (0, -9.81, 0), (0, 0, -9.81)], ids=["none", "across", "in its plane"])
def test_a_linkage_rests_where_its_motor_has_it(gravity):
    state, ws = resting(linkage(gravity))
    for body in (0, 1):  # both turn by the crank's angle, about y
        np.testing.assert_allclose(state.q[body], [np.cos(0.2), 0.0, np.sin(0.2), 0.0], atol=1e-10)
    assert np.abs(ws.blocks.res).max() < 1e-10 and np.abs(ws.blocks.gap).max() < 1e-11
    assert np.abs(state.lam).max() < 10.0, "forces are of the size of the weights"


@pytest.mark.parametrize("transposed", [False, True], ids=["plain", "transposed"])
@pytest.mark.parametrize(
    "made",
    [((0, 0, 0),), ((0, 0, -9.81), -0.02, False)],
    ids=["held by its loop alone", "hanging, so that it can swing"],
)
def test_solutions_are_those_of_the_whole_matrix(made, transposed):
    model = linkage(*made)
    system = model.system
    _, ws = resting(model)
    blocks, factors, border, block = ws.blocks, ws.factors, ws.scratch.border, ws.scratch.block
    A = dense_matrix(system, Blocks(*[part.copy() for part in blocks]))
    A = A.T if transposed else A  # free rows of joints are zero
    b = A @ np.random.default_rng(3).normal(size=len(A))  # that has a solution, though multipliers are redundant
    hold(system, blocks.D, blocks.K)
    tree = (factors.lu, factors.pivots, factors.Z)
    shared = (blocks.Lc, blocks.Lp, blocks.Hc[len(system.parent) :], blocks.Hp, blocks.Nc, blocks.Jp, *tree)
    assert factor(system, blocks, *tree, block) == -1
    factor_loops(system, *shared, border, block)
    x, lam = split(system, b)
    solve = solve_statics_transposed if transposed else solve_statics
    solve(
        system, blocks.D, *shared, border.inverse, x, lam, border.X, border.lam, border.y, border.x, block,
        np.zeros_like(x), np.zeros_like(lam),
    )  # fmt: skip
    found, expected = join(system, x, lam), np.linalg.lstsq(A, b, rcond=1e-10)[0]
    assert np.abs(A @ found - b).max() < 1e-9 * np.abs(b).max()
    motion = slice(0, 6 * len(system.parent))
    np.testing.assert_allclose(found[motion], expected[motion], atol=1e-9 * np.abs(expected).max())


def test_without_loops_nothing_is_held():
    model = compiled(chain(2, driven=(0, 1)))
    K, D = np.zeros((2, 6, 6)), np.ones((2, 6, 6))
    hold(model.system, D, K)
    assert not K.any()
