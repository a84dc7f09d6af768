"""The states of all instants of a simulation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from calmotion.multibody.model.system import State
from calmotion.shot.character import Array
from calmotion.support.compilation import kernel


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States of all instants; arrays of `State` with a leading time axis, and what they cost.

    Attributes:
        h: Step [s].
        states: Arrays of shape [T, B, ...].
        world: Moving markers of the world at all instants, shape [T, W, 18], see `markers.moving_marker`.
        newton_iterations: In all: linear systems solved.
        factorisations: In all.
        max_joint_gap: Largest position gap of a joint [m].
        wall_s: Time it took [s].
        integrator: Name of the scheme.
        refined: Instants that only smaller steps reached.
        margins: How far the closed loops are from a pose in which they have one more way to move, shape [T]: see
            `loops.Border`; zeros where there are none.
        costs: Of each instant: linear systems solved, factorisations, largest position gap of a joint [m]; shape
            [T, 3], empty where they were not counted.
    """

    h: float
    states: State
    world: Array
    newton_iterations: int
    factorisations: int
    max_joint_gap: float
    wall_s: float
    integrator: str = "bdf2"
    refined: tuple[int, ...] = ()
    margins: Array = field(default_factory=lambda: np.zeros(0))
    costs: Array = field(default_factory=lambda: np.zeros((0, 3)))


@kernel
def instant_of(states, n):
    """Views of instant n of a trajectory."""
    return State(states.c[n], states.q[n], states.u[n], states.turn[n], states.V[n], states.lam[n])


def copy_of_instant(states: State, n: int) -> State:
    """Instant n of a trajectory by itself."""
    return State(*[part[n].copy() for part in states])
