import numpy as np
import pytest
from arms import chain, compiled
from calmotion.model.character import WORLD
from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import start_angles
from calmotion.multibody.statics.equilibrium import equilibrium, linearize
from mechanisms import mechanism
from particles import particle_system
from sweep_cases import rigid_start

FOUR_BAR = [(0.0, 0.0), (0.0, 0.8), (1.1, 1.0), (1.3, 0.0)], [(0, 1), (1, 2), (3, 2)]
PARALLELOGRAM = [(0.0, 0.0), (0.3, 0.8), (1.3, 0.8), (1.0, 0.0)], FOUR_BAR[1]
HINGES = [(WORLD, 0, 0), (0, 1, 1), (1, 2, 2), (WORLD, 2, 3)]


def four_bar_at(bars, driven, angles, gravity=9.81):
    """Static equilibrium of a linkage of four hinges, of which several are driven; its largest open row."""
    model = mechanism(*bars, HINGES, driven, gravity)
    joint_angles, ws = model.joint_angles(np.array([angles]))[0], Workspace.for_system(model.system)
    state, _ = equilibrium(model.system, rigid_state(model, start_angles(model, joint_angles)), joint_angles, ws)
    linearize(model.system, state, joint_angles, ws)
    return np.abs(ws.blocks.gap).max()


@pytest.mark.parametrize("gravity", [9.81, 0.0, -3.0])
@pytest.mark.parametrize("driven", [(0, 3), (0, 1), (1, 2), (0, 1, 2), (0, 2, 3)])
def test_motors_that_contradict_each_other_in_a_closed_chain_are_no_equilibrium(driven, gravity):
    """The pose of the smallest gaps was taken for one, with joints open by centimetres."""
    for angles in (0.15 * np.eye(len(driven))[0], np.linspace(-0.2, 0.3, len(driven))):
        with pytest.raises(SimulationFailure) as failure:
            four_bar_at(FOUR_BAR, driven, angles, gravity)
        assert failure.value.reason == Reason.OPEN and 0 <= failure.value.component < 4
        assert 1e-3 < np.abs(failure.value.gap).max() < 1.0
    assert four_bar_at(FOUR_BAR, driven, np.zeros(len(driven)), gravity) < 1e-9


def test_a_chain_of_motors_alone_that_contradict_each_other_has_no_equilibrium():
    for gravity in (9.81, 0.0, -3.0):
        with pytest.raises(SimulationFailure) as failure:
            four_bar_at(FOUR_BAR, (0, 1, 2, 3), np.linspace(-0.2, 0.3, 4), gravity)
        assert failure.value.reason in (Reason.OPEN, Reason.NO_EQUILIBRIUM)
    assert four_bar_at(FOUR_BAR, (0, 1, 2, 3), np.zeros(4)) < 1e-9


def test_motors_that_agree_in_a_closed_chain_have_an_equilibrium():
    for angle in (-0.2, 0.1, 0.3):
        assert four_bar_at(PARALLELOGRAM, (0, 3), [angle, angle]) < 1e-9
        assert four_bar_at(PARALLELOGRAM, (0, 1), [angle, -angle]) < 1e-9
        assert four_bar_at(FOUR_BAR, (0,), [angle]) < 1e-9


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
