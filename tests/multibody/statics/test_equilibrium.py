import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.statics.equilibrium import equilibrium, linearize
from particles import particle_system
from sweep_cases import rigid_start


@pytest.mark.parametrize("start", [0.0, 1.0, -2.5])
def test_free_pendulum_settles_hanging_down(start):
    model = compiled(chain(2))
    state, _ = equilibrium(
        model.system, rigid_state(model, np.array([start, 0.3])), np.zeros(2), Workspace.for_system(model.system)
    )
    tip, _ = target_frames(model, state.c[None], state.q[None], state.u[None])
    assert np.abs(tip[0, 0] - [0.0, 0.0, -2.0]).max() < 1e-9


def test_motor_carries_the_moment_of_the_weight():
    model = compiled(chain(2, driven=(0, 1)))
    state, _ = equilibrium(
        model.system, rigid_state(model, np.zeros(2)), np.zeros(2), Workspace.for_system(model.system)
    )
    # masses of 1 kg at 1 and 2 m; a moment about +y lifts -z upwards when negative
    assert np.allclose(state.lam[:, 5], [-9.81 * 3.0, -9.81 * 1.0], rtol=1e-12)
    assert np.allclose(state.lam[:, 2], [2 * 9.81, 9.81], rtol=1e-12)


def test_flexible_tree_is_in_balance_at_every_row():
    rng = np.random.default_rng(0)
    system, _ = particle_system(rng, [-1, 0, 1, 0], [2, 0, 3, 2], stiffness=3000.0)
    angle, ws = rng.normal(size=4) * 0.3, Workspace.for_system(system)
    state, _ = equilibrium(system, rigid_start(system, angle), angle, ws)
    linearize(system, state, angle, ws)
    assert np.abs(ws.blocks.res).max() < 1e-9 and np.abs(ws.blocks.gap).max() < 1e-11
    assert np.abs(state.u).max() > 1e-3, "the case should sag visibly"
