"""A step that Newton's method does not solve, approached through smaller steps.

Their end is first only a better guess for the step itself, whose equations then hold as everywhere else, so that
gradients stay exact. Where they still cannot be solved the end of the smaller steps stands as it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from calmotion.multibody.integrators import newton
from calmotion.multibody.integrators.schemes import SCHEMES
from calmotion.multibody.kernels.moving_frames import between
from calmotion.multibody.kernels.so3 import logarithm, matrix_of
from calmotion.multibody.model.system import State, System, allocate_state
from calmotion.multibody.statics.consistent_start import instant_before
from calmotion.shot.character import Array

if TYPE_CHECKING:
    from calmotion.multibody.integrators.workspace import Workspace

PARTS = (4, 16, 64, 256)


def _copy(source: State, out: State) -> None:
    for part, value in zip(out, source, strict=True):
        part[:] = value


def _turn_between(first: State, last: State) -> Array:
    """Rotation vectors from one state to another, body axes [rad], shape [B, 3]."""
    turns = np.zeros_like(first.turn)
    A, B = np.zeros((3, 3)), np.zeros((3, 3))
    for b in range(len(turns)):
        matrix_of(first.q[b], A)
        matrix_of(last.q[b], B)
        logarithm(A.T @ B, turns[b])
    return turns


def refined_step(
    system: System, integrator: str, h: float, n: int, earlier: State, states: State, angles: Array, rates: Array,
    world: Array, ws: Workspace,
) -> bool | None:  # fmt: skip
    """Fill instant n of a trajectory, whose instants before n are done.

    Args:
        earlier: The instant before the first.
        states, angles, rates, world: As in `simulation.simulate`.

    Returns:
        True where the step's own equations hold, False where smaller steps stand in for it, None where those fail too.
    """
    if not (np.all(np.isfinite(angles[n])) and np.all(np.isfinite(rates[n]))):
        return None
    before = State(*[part[n - 1] for part in states])
    before2 = earlier if n == 1 else State(*[part[n - 2] for part in states])
    now = State(*[part[n] for part in states])
    memory = ws.scratch.memory.copy()
    curve = CubicHermiteSpline([0.0, h], angles[n - 1 : n + 1], rates[n - 1 : n + 1])
    for parts in PARTS:
        ws.scratch.memory[:] = memory
        end = _small_steps(system, integrator, h / parts, parts, before, memory[0], curve, world[n - 1 : n + 1], ws)
        if end is None:
            continue
        after = ws.scratch.memory.copy()
        end.turn[:] = _turn_between(before, end)
        _copy(end, now)
        ws.scratch.memory[:] = memory
        ws.work.world[:] = world[n]
        code, *_ = newton.step(
            system, SCHEMES[integrator](h), h, before2, before, now, angles[n], rates[n], True, ws.work, ws.blocks,
            ws.factors, ws.scratch,
        )  # fmt: skip
        if code == newton.CONVERGED:
            return True
        _copy(end, now)
        ws.scratch.memory[:] = after
        return False
    return None


def _small_steps(
    system: System, integrator: str, k: float, parts: int, before: State, acceleration: Array,
    curve: CubicHermiteSpline, world: Array, ws: Workspace,
) -> State | None:  # fmt: skip
    """The state after so many steps of length k, or None where one of them fails."""
    scheme = SCHEMES[integrator](k)
    here = State(*[part.copy() for part in before])
    earlier, here.turn[:] = instant_before(system, here, acceleration, k)
    for part in range(1, parts + 1):
        now = allocate_state(system)
        ws.work.world[:] = between(world, parts * k, part / parts)
        angle, rate = curve(part * k), curve(part * k, 1)
        code, *_ = newton.step(
            system, scheme, k, earlier, here, now, angle, rate, False, ws.work, ws.blocks, ws.factors, ws.scratch
        )
        if code != newton.CONVERGED:
            return None
        earlier, here = here, now
    return here
