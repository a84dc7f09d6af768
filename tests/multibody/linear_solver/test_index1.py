"""Accelerations of the index-1 form against differences of a fine solution, and Baumgarte's terms."""

import numpy as np
import pytest
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.linear_solver.index1 import accelerations
from calmotion.multibody.model.system import State, allocate_blocks
from scipy.spatial.transform import Rotation


@pytest.fixture(scope="module")
def moving(flexible_tree):
    """A state in motion, inputs there, and its accelerations by differences."""
    steps, n = 640, 400
    states = flexible_tree(steps, "rk4").states
    h = flexible_tree.duration / steps
    # fourth-order difference
    V = states.V[n - 2 : n + 3]
    slope = (V[0] - 8.0 * V[1] + 8.0 * V[3] - V[4]) / (12.0 * h)
    state = State(*[part[n].copy() for part in states])
    return state, [values[0] for values in flexible_tree.drive([n * h])], slope, states.lam[n]


@pytest.mark.parametrize("baumgarte", [0.0, 10.0])
def test_they_are_what_the_motion_has(flexible_tree, moving, baumgarte):
    state, inputs, slope, multipliers = moving
    ws = Workspace.for_system(flexible_tree.system)
    here = State(*[part.copy() for part in state])
    assert accelerations(flexible_tree.system, here, *inputs, baumgarte, ws) == -1
    assert np.abs(ws.scratch.Vd - slope).max() < 1e-5 * np.abs(slope).max()
    assert np.abs(here.lam - multipliers).max() < 1e-5 * np.abs(multipliers).max()


def test_baumgarte_pulls_a_gap_back(flexible_tree, moving):
    """Moved apart by d and with a velocity v, a joint comes together with -2 a v - a^2 d."""
    state, inputs, *_ = moving
    system, baumgarte = flexible_tree.system, 7.0
    ws = Workspace.for_system(system)
    leaf = int(np.flatnonzero(~np.isin(np.arange(4), system.parent))[-1])
    found = []
    for d, v in (((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ((2e-6, 0.0, -1e-6), (0.0, 3e-6, 1e-6))):
        here = State(*[part.copy() for part in state])
        here.c[leaf] += d
        here.V[leaf, :3] += v
        assert accelerations(system, here, *inputs, baumgarte, ws) == -1
        found.append(ws.scratch.Vd.copy())
    p = system.parent[leaf]
    marker = gap_acceleration(system, state, leaf, p, found[1] - found[0])
    expected = -2.0 * baumgarte * np.array([0.0, 3e-6, 1e-6]) - baumgarte**2 * np.array([2e-6, 0.0, -1e-6])
    assert np.abs(marker - expected).max() < 1e-3 * np.abs(expected).max()


def gap_acceleration(system, state, b, p, change):
    """Change of the relative acceleration of a joint's markers by that of its components', positions unchanged."""
    total = np.zeros(3)
    for sign, body, side in ((1.0, b, 1), (-1.0, p, 0)):
        R = Rotation.from_quat(np.roll(state.q[body], -1)).as_matrix()
        y = system.position[b, side] + system.Phi[b, side] @ state.u[body]
        r = change[body]
        total += sign * (r[:3] + R @ (np.cross(r[3:6], y) + system.Phi[b, side] @ r[6:]))
    return total


def test_a_massless_free_body_is_named(flexible_tree, moving):
    state, inputs, *_ = moving
    system = flexible_tree.system
    ws = Workspace.for_system(system)
    assert allocate_blocks(system).K.shape[0] == 4
    nothing = {name: np.zeros_like(getattr(system, name)) for name in ("mass", "s", "Z", "M3", "M4", "S", "axial")}
    floating = system._replace(rows=np.array([6, 6, 0, 6], np.int32), **nothing)
    here = State(*[part.copy() for part in state])
    assert accelerations(floating, here, *inputs, 0.0, ws) >= 0
