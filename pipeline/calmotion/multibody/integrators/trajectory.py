"""The states of all instants of a simulation."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.model.system import Instants, State
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import kernel


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States of all instants; arrays of `State` with a leading time axis, and their cost.

    Attributes:
        h: Step [s].
        states: Arrays of shape [T, B, ...].
        world: Moving markers of the world at all instants, shape [T, W, 18], see `markers.moving_marker`.
        newton_iterations: In all: linear systems solved.
        factorisations: In all.
        max_joint_gap: Largest position gap of a joint [m].
        wall_s: Time it took [s].
        integrator: Its name.
        refined: Instants that only smaller steps reached.
        margins: Distance of the closed chains from a pose in which they have one more degree of freedom, shape [T]: see
            `closed_chains.Border`; zeros where there are none.
        costs: Of each instant: linear systems solved, factorisations, largest position gap of a joint [m]; shape
            [T, 3], empty where they were not counted.
        divided: Parts into which each step was divided as friction turns, shape [T]; empty where none was.
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
    divided: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))


@by_reference
class Inputs(NamedTuple):
    """What drives a simulation.

    Attributes:
        angles, rates: Angle [rad] (or length [m]) and rate of each joint's motor, shape [T, J].
        world: Moving markers of the world, shape [T, W, 18].
    """

    angles: Array
    rates: Array
    world: Array


@by_reference
class Record(NamedTuple):
    """What the steps of a simulation fill.

    Attributes:
        earlier: The state of the instant before the first.
        states, margins, costs: See `Trajectory`.
    """

    earlier: State
    states: State
    margins: Array
    costs: Array


@kernel
def instant_of(states: State, n: int) -> State:
    """Views of instant n of a trajectory."""
    return State(states.c[n], states.q[n], states.u[n], states.turn[n], states.V[n], states.lam[n])


@kernel
def instants_of(earlier: State, states: State, n: int) -> Instants:
    """Views of instant n >= 1 of a trajectory and the two before it."""
    before2 = earlier if n == 1 else instant_of(states, n - 2)
    return Instants(before2, instant_of(states, n - 1), instant_of(states, n))


def copy_of_instant(states: State, n: int) -> State:
    """Instant n of a trajectory by itself."""
    return State(*[part[n].copy() for part in states])
