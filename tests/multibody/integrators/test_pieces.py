"""A simulation in pieces is that of the whole, to the last bit."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.integrate import integrate
from calmotion.multibody.integrators.pieces import integrate_in_pieces
from calmotion.multibody.integrators.workspace import Workspace

H = 1 / 240


def swinging(count=100):
    """Two driven links: a model, its start, and its motor's angles and rates."""
    model = compiled(chain(2, driven=(0, 1), length=0.3))
    times = H * np.arange(count)[:, None] * np.array([5.0, 3.0])
    angles, rates = (model.joint_angles(part) for part in (1.0 - np.cos(times), np.array([5.0, 3.0]) * np.sin(times)))
    return model.system, rigid_state(model, angles[0]), angles, rates


@pytest.mark.parametrize("integrator", ["bdf2", "newmark", "generalized-alpha", "rk4"])
@pytest.mark.parametrize("size", [1, 33, 200])
def test_pieces_are_the_whole_to_the_last_bit(integrator, size):
    system, start, angles, rates = swinging()
    whole = integrate(system, start, angles, rates, H, Workspace.for_system(system), integrator=integrator)
    pieces = list(
        integrate_in_pieces(system, start, angles, rates, H, Workspace.for_system(system), integrator, None, size)
    )
    rows = np.concatenate([np.arange(part.start, part.stop) for part, _ in pieces])
    assert np.array_equal(rows, np.arange(len(angles)))
    if integrator == "rk4" or size == 200:
        assert len(pieces) == 1
    elif size == 33:
        assert [len(piece.states.c) for _, piece in pieces] == [33, 33, 33, 1]
    for k, part in enumerate(whole.states):
        assert np.array_equal(part, np.concatenate([piece.states[k] for _, piece in pieces])), whole.states._fields[k]
    assert sum(piece.newton_iterations for _, piece in pieces) == whole.newton_iterations
    assert max(piece.max_joint_gap for _, piece in pieces) == whole.max_joint_gap
    assert np.array_equal(np.concatenate([piece.margins for _, piece in pieces]), whole.margins)


def test_a_failure_in_a_later_piece_has_the_time_of_the_whole():
    system, start, angles, rates = swinging()
    angles = angles.copy()
    angles[70:] = np.nan
    failures = []
    for size in (100, 33):
        with pytest.raises(SimulationFailure) as failure:
            list(integrate_in_pieces(system, start, angles, rates, H, Workspace.for_system(system), "bdf2", None, size))
        failures.append(failure.value)
    assert failures[0].time_s == pytest.approx(70 * H) == failures[1].time_s
    assert failures[0].component == failures[1].component
