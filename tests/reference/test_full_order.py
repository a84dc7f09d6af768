"""The reduced body against the unreduced one on the same mesh: the swung arm, up to 30 degrees."""

import numpy as np
import pytest
from boxes import box_tets
from calmotion.model import ElasticMaterial
from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.statics.equilibrium import equilibrium
from full_order import FullOrder
from turning_beam import TurningBeam

LENGTH, THICKNESS, CELLS = 0.6, 0.02, 12
PAYLOAD = 0.2  # in four lumps at the corners of the end face
INERTIA = PAYLOAD * THICKNESS**2 / 4.0 * np.diag([2.0, 1.0, 1.0])
STEP = 1.0 / 480.0


def quintic(turn, duration):
    """Angle and rate of a move from rest to rest."""

    def angle(t):
        s = np.clip(t / duration, 0.0, 1.0)
        return -turn * (10 * s**3 - 15 * s**4 + 6 * s**5)

    def rate(t):
        s = np.clip(t / duration, 0.0, 1.0)
        return -turn * (30 * s**2 - 60 * s**3 + 30 * s**4) / duration

    return angle, rate


class Arm:
    """The unreduced arm with its root face, end face and the middle of that."""

    def __init__(self, youngs_modulus, law="stvk"):
        half = THICKNESS / 2
        points, tets = box_tets((CELLS, 1, 1), (LENGTH, THICKNESS, THICKNESS), (0.0, -half, -half))
        corners = np.flatnonzero(np.abs(points[:, 0] - LENGTH) < 1e-9)
        lumps = {int(node): PAYLOAD / 4.0 for node in corners}
        self.material = ElasticMaterial("/Looks/Plastic", youngs_modulus, 0.35, 1200.0, damping_ratio=0.0)
        self.full = FullOrder(points, tets, youngs_modulus, 0.35, 1200.0, law, lumps)
        X = self.full.nodes
        self.root = np.flatnonzero(np.abs(X[:, 0]) < 1e-9)
        self.end = np.flatnonzero(np.abs(X[:, 0] - LENGTH) < 1e-9)
        self.tip = int(self.end[np.linalg.norm(X[self.end] - [LENGTH, 0, 0], axis=1).argmin()])

    def reduced(self, law, modes=8):
        return TurningBeam(LENGTH, THICKNESS, self.material, (CELLS, 1, 1), law, modes, payload=(PAYLOAD, INERTIA))

    def difference(self, law, truth, angle, rate, duration):
        """Largest distance between the tips, of the largest deflection."""
        _, tip, _ = self.reduced(law).swing(angle, rate, STEP / 4, duration)
        return np.linalg.norm(tip[::4] - truth, axis=1).max() / np.abs(truth[:, 1]).max()

    def truth(self, angle, duration):
        """Tip in the hinge's axes (along, across), and the steepest slope of the end [rad]."""
        below = int(self.end[self.full.nodes[self.end][:, 2].argmin()])
        _, x = self.full.swing(self.root, angle, [0, 1, 0], STEP, duration, [self.tip, below])
        across = x[:, 0] - x[:, 1]
        return x[:, 0][:, [0, 2]], np.abs(np.arctan2(across[:, 0], across[:, 2])).max()


def test_a_slow_swing_equals_that_of_the_linear_body():
    arm = Arm(1.8e9)
    angle, rate = quintic(np.pi / 4, 1.0)
    truth, slope = arm.truth(angle, 1.2)
    assert slope < np.radians(1.0)
    assert arm.difference("linear", truth, angle, rate, 1.2) < 0.01


def test_at_thirty_degrees_the_nonlinear_basis_is_accurate_and_the_linear_one_fails():
    arm = Arm(3.9e8)
    angle, rate = quintic(np.pi / 2, 0.5)
    truth, slope = arm.truth(angle, 0.7)
    assert np.radians(29.0) < slope < np.radians(40.0)
    for law in ("stvk", "neohookean"):
        assert arm.difference(law, truth, angle, rate, 0.7) < 0.02
    assert arm.difference("linear", truth, angle, rate, 0.7) > 0.1


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_a_tip_load_deflects_it_equally(law):
    arm = Arm(1.8e9, law)
    loads = np.zeros_like(arm.full.nodes)
    loads[arm.end, 2] = 90.0 / len(arm.end)
    tip = (arm.full.statics(arm.root, loads) - arm.full.nodes)[arm.tip]
    assert tip[2] > 0.2
    reduced = arm.reduced(law)
    # the load as the weight of the payload, whose own inertia does not matter at rest; the arm weighs nothing
    system = reduced.model.system
    system.gravity[:] = (0.0, 0.0, 90.0 / PAYLOAD)
    for integrals in (system.s, system.M3, system.mass):
        integrals[0] = 0.0
    state, _ = equilibrium(system, rigid_state(reduced.model, np.zeros(2)), np.zeros(2), Workspace.for_system(system))
    found = target_frames(reduced.model, state.c[None], state.q[None], state.u[None])[0][0, 0]
    assert np.linalg.norm(found - [LENGTH, 0, 0] - tip) < 0.01 * np.linalg.norm(tip)


# the truth itself


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_the_forces_of_the_unreduced_body_are_derivatives_of_its_energy(law):
    full = Arm(1.8e9, law).full
    rng = np.random.default_rng(0)
    x = full.nodes + 1e-4 * rng.normal(size=full.nodes.shape)
    d = rng.normal(size=x.shape)
    force, stiffness = full.forces(x)
    h = 1e-7
    assert force @ d.ravel() == pytest.approx((full.energy(x + h * d) - full.energy(x - h * d)) / (2 * h), rel=1e-5)
    slope = (full.forces(x + h * d, False)[0] - full.forces(x - h * d, False)[0]) / (2 * h)
    assert np.allclose(stiffness @ d.ravel(), slope, rtol=0, atol=1e-6 * np.abs(slope).max())
