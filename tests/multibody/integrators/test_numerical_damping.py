"""BDF2 damps an undamped vibration as much as the root of its difference equation says."""

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.modes import system_modes
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.simulation.body_reduction import BodyReduction
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.preparation import prepare
from calmotion.testing import beam_arm, quintic, shot_of

PERIODS = 10


@pytest.fixture(scope="module")
def model():
    character, meshes = beam_arm(modes=1, elasticity="linear", damping=0.0, gravity=0.0)
    bodies = BodyReduction(character, meshes, None).bodies(None)
    shot = compile_shot(character, shot_of(quintic(0.0, 1.0), 1.0), bodies)
    return prepare(shot, RunSettings(pre_roll=0.0)).model


def bent(model, size):
    """The arm with its only flexible component bent, its load following."""
    state = rigid_state(model, np.zeros(len(model.motor)))
    state.u[0, 0] = size
    state.c[1] += model.system.Phi[1, 0, :, 0] * size
    turned = np.array([1.0, *(0.5 * model.system.Psi[1, 0, :, 0] * size)])
    state.q[1] = turned / np.linalg.norm(turned)
    return state


@pytest.mark.parametrize("steps", [20, 40, 80])
def test_the_damping_ratio_is_that_of_the_root(model, steps):
    h = 1.0 / (float(system_modes(model, np.zeros(len(model.motor)))[0][0]) * steps)
    none = np.zeros((PERIODS * steps + 1, len(model.motor)))
    workspace = Workspace.for_system(model.system)
    u = simulate(model.system, bent(model, 1e-6), none, none, h, workspace, from_equilibrium=False).states.u[:, 0, 0]
    # amplitudes of the first and the last period
    first, last = np.abs(u[: steps + 1]).max(), np.abs(u[-steps - 1 :]).max()
    # 3/2 - 2/z + 1/(2 z^2) = i phase
    phase = 2.0 * np.pi / steps
    z = 1.0 / np.roots([0.5, -2.0, 1.5 - 1j * phase])
    exponent = np.log(z[np.argmin(np.abs(z - np.exp(1j * phase)))])
    expected = -exponent.real / np.abs(exponent)
    assert np.log(first / last) / (2.0 * np.pi * (PERIODS - 1)) == pytest.approx(expected, rel=0.12)
