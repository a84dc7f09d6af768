"""The start of a step: Taylor's formula and what it missed."""

import numpy as np
from calmotion.multibody.integrators.coefficients import MISSED, predict, remember_missed
from calmotion.multibody.model.system import allocate_state
from particles import particle_system

H = 0.01


def cubic(system, rng, size=1.0):
    """A motion of constant third derivative: its states at any time, and accelerations."""
    count = len(system.parent)
    position, velocity, acceleration, jerk = size * rng.normal(size=(4, count, system.size))

    def at(time):
        state = allocate_state(system)
        state.q[:, 0] = 1.0
        moved = time * velocity + time**2 / 2.0 * acceleration + time**3 / 6.0 * jerk
        state.c[:], state.u[:] = (position + moved)[:, :3], (position + moved)[:, 6:]
        state.V[:] = velocity + time * acceleration + time**2 / 2.0 * jerk
        return state, moved[:, 3:6], acceleration + time * jerk

    return at


def predicted(system, at):
    """The instant after the one at zero as it is predicted, with the memory of the one at zero."""
    before, turned_before, acceleration = at(-H)
    now, turned, next_acceleration = at(0.0)
    now.turn[:] = turned - turned_before
    memory = np.zeros((4, len(system.parent), system.size))
    memory[0] = acceleration
    remember_missed(system, H, before, now, memory)
    memory[0] = next_acceleration
    found = allocate_state(system)
    predict(system, H, now, found, memory)
    return found, memory


def test_a_cubic_motion_is_predicted_exactly():
    rng = np.random.default_rng(0)
    system, _ = particle_system(rng, [-1, 0, 1], [2, 2, 2])
    at = cubic(system, rng)
    found, memory = predicted(system, at)
    then, turned, _ = at(H)
    assert np.abs(memory[MISSED]).max() > 1e-8
    for one, other in ((found.c, then.c), (found.u, then.u), (found.turn, turned)):
        assert np.abs(one - other).max() < 1e-15 * max(1.0, np.abs(other).max()) * 4
