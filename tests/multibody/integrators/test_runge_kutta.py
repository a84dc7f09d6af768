"""RK4 on the index-1 form: fourth order, the published pendulum, and what it does on a stiff body."""

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.integrate import integrate
from calmotion.multibody.integrators.workspace import Workspace


def test_it_is_of_fourth_order_in_positions_and_velocities(flexible_tree):
    exact = flexible_tree(2560, "rk4").states
    errors = []
    for steps in (160, 320):
        states = flexible_tree(steps, "rk4").states
        errors.append([np.abs(getattr(states, part)[-1] - getattr(exact, part)[-1]).max() for part in ("c", "u", "V")])
    orders = np.log2(np.divide(*errors))
    assert np.all(orders > 3.7), (orders, errors)


def swing(integrator, h, seconds=10.0):
    """A pendulum released level: its tip, and the trajectory."""
    model = compiled(chain(1))
    none = np.zeros((round(seconds / h) + 1, 1))
    ws = Workspace.for_system(model.system)
    start = rigid_state(model, np.zeros(1))
    trajectory = integrate(model.system, start, none, none, h, ws, from_equilibrium=False, integrator=integrator)
    states = trajectory.states
    return target_frames(model, states.c, states.q, states.u)[0][-1, 0], trajectory


def test_a_pendulum_comes_to_its_published_place():
    """Pendulum of 1 m released level: (-0.27508746, -0.96141921) at t = 10 s; here to the other side."""
    tip, trajectory = swing("rk4", 1e-3)
    assert np.abs(tip[[0, 2]] - [0.27508746, -0.96141921]).max() < 3e-8
    assert trajectory.max_joint_gap < 1e-8
    assert np.abs(np.linalg.norm(trajectory.states.q, axis=2) - 1.0).max() < 1e-9


def test_it_blows_up_where_the_step_does_not_resolve_a_body(flexible_tree):
    system = flexible_tree.system
    stiff = system._replace(stiffness=1e6 * system.stiffness)
    start = flexible_tree(4, "bdf2").states
    first = type(start)(*[part[0].copy() for part in start])
    angles = np.zeros((201, 4))
    with pytest.raises(SimulationFailure, match="diverged") as failure:
        integrate(
            stiff, first, angles, angles, 1e-3, Workspace.for_system(stiff), integrator="rk4", from_equilibrium=False
        )
    assert failure.value.state is not None and failure.value.time_s < 0.2
