"""Frequencies of a rotating cantilever, whose stiffening a linear floating frame misses."""

import numpy as np
import pytest
from calmotion.model import ElasticMaterial
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.statics.equilibrium import STATIC
from scipy.linalg import eig
from turning_beam import TurningBeam

LENGTH, THICKNESS = 1.0, 0.01  # slender: shear and rotary inertia are 0.1% of the first frequency
# first flapping frequency over spin, both times sqrt(rho A L^4 / EI)
PUBLISHED = {0: 3.5160, 1: 3.6816, 2: 4.1373, 3: 4.7973, 4: 5.5850, 5: 6.4495, 6: 7.3604, 10: 11.2023, 12: 13.1702}
MATERIAL = ElasticMaterial("/Looks/Beam", 2.0e11, 0.0, 7850.0, damping_ratio=0.0)
SCALE = np.sqrt(MATERIAL.density * 12.0 / (MATERIAL.youngs_modulus * THICKNESS**2)) * LENGTH**2


def first_frequencies(beam, spin):
    """The two lowest frequencies of the elastic coordinates about the steady state of a spin [rad/s] about y."""
    model = beam.model
    system, ws = model.system, Workspace.for_system(model.system)
    state = rigid_state(model, np.zeros(1))
    state.V[0, 4] = spin
    r = int(system.elastic[0])
    zero = np.zeros(1)
    for _ in range(30):
        Hv, Vd = np.zeros((1, 4, 4)), np.zeros_like(state.V)
        assemble(system, STATIC, state, Vd, zero, zero, Hv, True, ws.work, ws.blocks)
        K, P, D = (block[0, 6 : 6 + r, 6 : 6 + r].copy() for block in (ws.blocks.K, ws.blocks.P, ws.blocks.D))
        step = np.linalg.solve(K, -ws.blocks.res[0, 6 : 6 + r])
        state.u[0, :r] += step
        if np.abs(step).max() < 1e-13:
            break
    one, none = np.eye(r), np.zeros((r, r))
    values = eig(np.block([[none, one], [-K, -P]]), np.block([[one, none], [none, D]]), right=False)
    imaginary = np.sort(values.imag[values.imag > 0.0])
    return imaginary[:2]


def test_flapping_and_lagging_frequencies_rise_with_the_spin():
    beam = TurningBeam(LENGTH, THICKNESS, MATERIAL, (30, 1, 1), "stvk", 8)
    for eta, published in PUBLISHED.items():
        lag, flap = first_frequencies(beam, eta / SCALE) * SCALE
        assert flap == pytest.approx(published, rel=0.01)
        assert lag == pytest.approx(np.sqrt(published**2 - eta**2), rel=0.02)


def test_a_linear_floating_frame_does_not_stiffen():
    beam = TurningBeam(LENGTH, THICKNESS, MATERIAL, (30, 1, 1), "linear", 8)
    lowest = first_frequencies(beam, 3.0 / SCALE)[0] * SCALE
    assert lowest < 0.5 * np.sqrt(PUBLISHED[3] ** 2 - 9.0)
