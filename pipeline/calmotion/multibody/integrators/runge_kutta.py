"""The classical Runge-Kutta method of fourth order on the index-1 form; compiled.

For comparison: it is explicit, so that stiff bodies need steps far shorter than those that resolve their motion.

A step integrates (c, theta, u, V), theta being the rotation vector from the step's start, theta' = J_r^-1(theta) omega
(H. Munthe-Kaas, Runge-Kutta methods on Lie groups, 1998).
"""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.integrators.trajectory import instant_of
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.so3 import inverse_right_jacobian, turn
from calmotion.multibody.linear_solver.closed_chains import copy_rows
from calmotion.multibody.linear_solver.index1 import accelerations
from calmotion.multibody.model.system import State, System, allocate_state
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import inlined_kernel, kernel

STAGES = np.array([0.0, 0.5, 1.0])  # instants of a step at which it evaluates the motors
BAUMGARTE = 10.0  # Baumgarte's coefficient [1/s]; one that grew with 1/h would take the method's order from it


@by_reference
class Slopes(NamedTuple):
    """Scratch of a step: a stage's state, slopes of positions and velocities, and their weighted sums, shape [B, N]."""

    stage: State
    positions: Array
    velocities: Array
    moved: Array
    gained: Array
    T: Array


def allocate_slopes(system: System) -> Slopes:
    """Scratch for one system."""
    shape = (len(system.parent), system.size)
    return Slopes(
        allocate_state(system), np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros((3, 3))
    )


@kernel
def _place(system: System, start: State, share: float, h: float, slopes: Slopes) -> None:
    """The state share * h along the slopes."""
    stage = slopes.stage
    for b in range(len(system.parent)):
        for i in range(3):
            stage.c[b, i] = start.c[b, i] + share * h * slopes.positions[b, i]
            stage.turn[b, i] = share * h * slopes.positions[b, 3 + i]
        for i in range(system.elastic[b]):
            stage.u[b, i] = start.u[b, i] + share * h * slopes.positions[b, 6 + i]
        for i in range(6 + system.elastic[b]):
            stage.V[b, i] = start.V[b, i] + share * h * slopes.velocities[b, i]
        turn(start.q[b], stage.turn[b], stage.q[b])


@inlined_kernel
def _slope(system: System, Vd: Array, slopes: Slopes) -> None:
    """Slopes at the stage's state."""
    stage, T = slopes.stage, slopes.T
    for b in range(len(system.parent)):
        inverse_right_jacobian(stage.turn[b], T)
        for i in range(6 + system.elastic[b]):
            slopes.positions[b, i] = stage.V[b, i]
            slopes.velocities[b, i] = Vd[b, i]
        for i in range(3):
            t = 0.0
            for k in range(3):
                t += T[i, k] * stage.V[b, 3 + k]
            slopes.positions[b, 3 + i] = t


@inlined_kernel
def step(system: System, h: float, start: State, now: State, inputs: Array, ws: Workspace, slopes: Slopes) -> int:
    """One step from `start` to `now`.

    Args:
        inputs: Angle, rate and acceleration of each joint's motor at start, middle and end, shape [3, 3, J].

    Returns:
        -1, or the component whose equations are singular or not finite.
    """
    count = len(system.parent)
    slopes.moved[:] = 0.0
    slopes.gained[:] = 0.0
    slopes.positions[:] = 0.0
    slopes.velocities[:] = 0.0
    for stage in range(4):
        _place(system, start, 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5), h, slopes)
        at = 0 if stage == 0 else (2 if stage == 3 else 1)
        bad = accelerations(system, slopes.stage, inputs[at, 0], inputs[at, 1], inputs[at, 2], BAUMGARTE, ws)
        if bad >= 0:
            return bad
        if stage == 0:
            copy_rows(slopes.stage.lam, start.lam)
        _slope(system, ws.scratch.Vd, slopes)
        weight = 1.0 / 3.0 if stage in (1, 2) else 1.0 / 6.0
        for b in range(count):
            for i in range(6 + system.elastic[b]):
                slopes.moved[b, i] += weight * slopes.positions[b, i]
                slopes.gained[b, i] += weight * slopes.velocities[b, i]
    copy_rows(slopes.moved, slopes.positions)
    copy_rows(slopes.gained, slopes.velocities)
    _place(system, start, 1.0, h, slopes)
    copy_rows(slopes.stage.c, now.c)
    copy_rows(slopes.stage.q, now.q)
    copy_rows(slopes.stage.u, now.u)
    copy_rows(slopes.stage.turn, now.turn)
    copy_rows(slopes.stage.V, now.V)
    copy_rows(slopes.stage.lam, now.lam)
    return -1


@kernel
def advance(
    system: System, h: float, states: State, inputs: Array, ws: Workspace, slopes: Slopes, limit: float
) -> tuple[int, int]:
    """Steps 1.. of a trajectory from its first instant.

    Args:
        states: Arrays of `State` with a leading time axis; the first is given.
        inputs: Shape [T - 1, 3, 3, J], see `step`.
        limit: Velocity [m/s, rad/s] above which the motion has diverged.

    Returns:
        The instant and the component of a failure, or the number of instants and -1.
    """
    for n in range(1, len(states.c)):
        start, now = instant_of(states, n - 1), instant_of(states, n)
        bad = step(system, h, start, now, inputs[n - 1], ws, slopes)
        if bad >= 0:
            return n, bad
        for b in range(len(system.parent)):
            for i in range(6 + system.elastic[b]):
                if not (abs(now.V[b, i]) < limit):
                    return n, b
    return len(states.c), -1
