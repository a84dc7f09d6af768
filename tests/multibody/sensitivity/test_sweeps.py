"""Tangent and adjoint sweeps: transpose test, and central differences of the whole simulation (identities 6, 7)."""

import numpy as np
import pytest
from calmotion.multibody.analysis.kinematics import system_poses
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.system import LINEAR, NEOHOOKEAN, STVK, allocate_state
from calmotion.multibody.sensitivity.adjoint import adjoint
from calmotion.multibody.sensitivity.linearization import linearize
from calmotion.multibody.sensitivity.linearized_steps import bytes_of_an_instant
from calmotion.multibody.sensitivity.tangent import tangent
from particles import nonlinear, particle_system, without_rotation
from scipy.spatial.transform import Rotation

H = 0.01
TIMES = np.arange(0.0, 0.3 + H / 2, H)


def moving_marker():
    """A marker that sways and turns, at all instants, shape [T, 1, 18]."""
    from calmotion.multibody.model.moving_markers import pack

    s, c = np.sin(4.0 * TIMES), np.cos(4.0 * TIMES)
    axis = np.array([0.6, 0.0, 0.8])
    position, velocity = np.outer(s, [0.1, 0.2, 0.0]), np.outer(4.0 * c, [0.1, 0.2, 0.0])
    matrices = Rotation.from_rotvec(np.outer(0.4 * s, axis)).as_matrix()
    return pack(position, velocity, np.outer(1.6 * c, axis), matrices)[:, None]


MOVED = moving_marker()


def rigid_start(system, angle):
    state = allocate_state(system)
    c, q = system_poses(system, angle[None], MOVED[:1] if np.any(system.moving >= 0) else None)
    state.c[:], state.q[:] = c[0], q[0]
    return state


def curves(p):
    """Joint angles and rates from coefficients of shape [4, J]: harmonics, so that the start moves too."""
    w = 3.0 + 2.0 * np.arange(4)
    phase = np.outer(TIMES, w)
    return np.cos(phase) @ p, (-w * np.sin(phase)) @ p


def close(system, angle):
    """Put the component-side markers of the loops where the parent-side ones are."""
    state = rigid_start(system, angle)
    R = Rotation.from_quat(np.roll(state.q, -1, axis=1)).as_matrix()
    for joint in range(len(system.parent), len(system.rows)):
        p, b = system.side[joint]
        point = state.c[p] + R[p] @ system.position[joint, 0]
        system.position[joint, 1] = R[b].T @ (point - state.c[b])
        system.rotation[joint, 1] = R[b].T @ R[p] @ system.rotation[joint, 0]


class Case:
    """A tree with free hinges, and a random linear functional of its motion."""

    def __init__(self, rows, laws=None, sliding=(), loops=(), moving=(), seed=0, nonrotating=(), weight=True):
        rng = np.random.default_rng(seed)
        self.system, _ = particle_system(rng, [-1, 0, 1, 0], [2, 0, 3, 2], rows, 3000.0, sliding, loops, moving)
        self.system = without_rotation(self.system, nonrotating)
        if not weight:
            self.system = self.system._replace(gravity=np.zeros(3))
        if laws is not None:
            self.system = nonlinear(self.system, laws, rng, stiffness=3000.0)
        joints = len(self.system.rows)
        self.p = (0.1 if loops else 0.3) * rng.normal(size=(4, joints))
        self.dp = rng.normal(size=(4, joints))
        if not weight and not loops:  # a free hinge keeps the angle that it is given, which is no motor's
            self.dp[:, self.system.rows < 6] = 0.0
        if loops:
            close(self.system, curves(self.p)[0][0])
        self.world = MOVED if moving else None
        self.ws = Workspace.for_system(self.system)
        shape = (len(TIMES), 4)
        self.wc, self.wq, self.wu = (rng.normal(size=shape + (k,)) for k in (3, 4, self.system.size - 6))

    def simulate(self, p):
        angles, rates = curves(p)
        start = rigid_start(self.system, angles[0])
        return simulate(self.system, start, angles, rates, H, self.ws, world=self.world), angles, rates

    def value(self, p):
        states = self.simulate(p)[0].states
        return float(np.sum(self.wc * states.c) + np.sum(self.wq * states.q) + np.sum(self.wu * states.u))

    def gradient(self, states):
        """Derivative of `value` by (R^T dc, dphi, du)."""
        shape = states.q.shape[:2]
        R = Rotation.from_quat(np.roll(states.q.reshape(-1, 4), -1, axis=1)).as_matrix().reshape(shape + (3, 3))
        w, x, y, z = np.moveaxis(states.q, -1, 0)
        E = 0.5 * np.stack([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])  # dq = E dphi
        out = np.zeros(shape + (self.system.size,))
        out[..., :3] = np.einsum("nbik,nbi->nbk", R, self.wc)
        out[..., 3:6] = np.einsum("ijnb,nbi->nbj", E, self.wq)
        out[..., 6:] = self.wu
        return out


CASES = {
    "driven": ([6, 6, 6, 6], None),
    "with a free hinge": ([6, 6, 5, 6], None),
    "bodies of large deflection": ([6, 6, 6, 6], [STVK, LINEAR, NEOHOOKEAN, LINEAR]),
    "sliders": ([6, 6, 6, 6], None, (0, 2, 3)),
    "a loop closed by a free slider": ([6, 5, 3, 5], None, (0, 4), ((2, 3, 5),), (), 1),
    "a moving root": ([6, 6, 5, 6], None, (), (), (0,)),
    "bodies that never turn": ([6, 6, 5, 6], [STVK, LINEAR, LINEAR, LINEAR], (3,), (), (), 0, (0, 2, 3)),
    "a loop": ([6, 5, 3, 5], None, (0,), ((2, 3, 3),)),
    "hinges that nothing holds": ([6, 5, 5, 6], None, (), (), (), 0, (), False),
    "hinges that a loop alone holds": ([6, 5, 5, 5], None, (), ((2, 3, 3),), (), 0, (), False),
}


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES)
def case(request):
    case = Case(*request.param)
    trajectory, angles, rates = case.simulate(case.p)
    lin = linearize(case.system, trajectory, angles, rates, case.ws)
    return case, lin, case.gradient(trajectory.states)


def test_adjoint_is_the_transpose_of_the_tangent(case):
    case, lin, gradient = case
    d_angle, d_rate = curves(case.dp)
    products = tangent(lin, d_angle, d_rate)[0] * gradient
    g_angle, g_rate = adjoint(lin, gradient)
    backward = float(np.sum(g_angle * d_angle) + np.sum(g_rate * d_rate))
    assert abs(float(np.sum(products)) - backward) < 1e-12 * float(np.abs(products).sum())


def test_windows_of_a_few_instants_give_the_same_sweeps(case):
    case, lin, gradient = case
    d_angle, d_rate = curves(case.dp)
    angles, rates = curves(case.p)
    few = linearize(case.system, lin.trajectory, angles, rates, case.ws, memory=7 * bytes_of_an_instant(case.system))
    assert few.size == 7 and len(few.windows()) == 5 and few.windows()[-1] == (28, 31)
    assert np.array_equal(tangent(few, d_angle, d_rate)[0], tangent(lin, d_angle, d_rate)[0])
    for found, expected in zip(adjoint(few, gradient), adjoint(lin, gradient), strict=True):
        assert np.array_equal(found, expected)
    # what the case's other tests use has been made with the same workspace, and is whole
    again = linearize(case.system, lin.trajectory, angles, rates, case.ws, few)
    assert len(again.windows()) == 1


def test_gradient_matches_central_differences_of_the_whole_simulation(case):
    case, lin, gradient = case
    g_angle, g_rate = adjoint(lin, gradient)
    d_angle, d_rate = curves(case.dp)
    found = float(np.sum(g_angle * d_angle) + np.sum(g_rate * d_rate))
    e = 1e-3

    def difference(e):
        return (case.value(case.p + e * case.dp) - case.value(case.p - e * case.dp)) / (2 * e)

    # Richardson extrapolation of two central differences
    expected = (4.0 * difference(e) - difference(2 * e)) / 3.0
    assert abs(found - expected) < 1e-7 * abs(expected)


def test_efforts_of_motors_match_differences_and_their_transpose(case):
    case, lin, gradient = case
    driven = case.system.rows == 6
    weights = np.random.default_rng(8).normal(size=(len(TIMES), len(driven))) * driven
    # holding torques are large, and would hide the rest; those of a free slider at rest are not determined
    weights[0] *= 0.0 if np.any((case.system.rows == 5) & (case.system.sliding == 1)) else 1e-2

    def effort(p):
        trajectory, angles, rates = case.simulate(p)
        return float(np.sum(weights * reactions(case.system, trajectory, angles, rates).efforts))

    d_angle, d_rate = curves(case.dp)
    moved, change = tangent(lin, d_angle, d_rate, efforts=True)
    found = float(np.sum(weights * change))
    e = 1e-3
    steps = [(effort(case.p + k * e * case.dp) - effort(case.p - k * e * case.dp)) / (2 * k * e) for k in (1, 2)]
    expected = (4.0 * steps[0] - steps[1]) / 3.0
    assert abs(found - expected) < 1e-6 * abs(expected)
    g_angle, g_rate = adjoint(lin, gradient, weights)
    forward = found + float(np.sum(moved * gradient))
    backward = float(np.sum(g_angle * d_angle) + np.sum(g_rate * d_rate))
    size = sum(float(np.abs(part).sum()) for part in (weights * change, moved * gradient, g_angle * d_angle))
    assert abs(forward - backward) < 1e-12 * size
