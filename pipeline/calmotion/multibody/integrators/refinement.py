"""A step that Newton's method does not solve, divided into smaller steps.

Their end is the initial guess for the step itself, whose equations are then solved as everywhere else, so that
gradients are exact. Where they still cannot be solved, the end of the smaller steps is the result.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from calmotion.arrays import Array
from calmotion.multibody.integrators import newton
from calmotion.multibody.integrators.coefficients import IMPLICIT, MISSED
from calmotion.multibody.integrators.trajectory import Inputs, Record
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.so3 import turns_between
from calmotion.multibody.model.moving_markers import between
from calmotion.multibody.model.system import Instants, State, System, allocate_state
from calmotion.multibody.statics.consistent_start import instant_before

PARTS = (4, 16, 64, 256)


def _copy(source: State, out: State) -> None:
    for part, value in zip(out, source, strict=True):
        part[:] = value


def _turn_between(first: State, last: State) -> Array:
    """Rotation vectors from one state to another, body axes [rad], shape [B, 3]."""
    vectors = np.zeros_like(first.turn)
    turns_between(first.q, last.q, vectors)
    return vectors


def refined_step(
    system: System, integrator: str, h: float, n: int, inputs: Inputs, record: Record, ws: Workspace
) -> bool | None:
    """Fill instant n of a trajectory, whose instants before n are done.

    Returns:
        True where the equations of the step are satisfied, False where the result is that of the smaller steps, None
        where those fail too.
    """
    angles, rates, world, states = inputs.angles, inputs.rates, inputs.world, record.states
    if not (np.all(np.isfinite(angles[n])) and np.all(np.isfinite(rates[n]))):
        return None
    before = State(*[part[n - 1] for part in states])
    before2 = record.earlier if n == 1 else State(*[part[n - 2] for part in states])
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
        instants = Instants(before2, before, now)
        code, *_ = newton.step(system, IMPLICIT[integrator](h), instants, angles[n], rates[n], True, ws)
        if code == newton.CONVERGED:
            return True
        _copy(end, now)
        ws.scratch.memory[:] = after
        ws.scratch.memory[MISSED] = 0.0  # of small steps
        return False
    return None


def _small_steps(
    system: System, integrator: str, k: float, parts: int, before: State, acceleration: Array,
    curve: CubicHermiteSpline, world: Array, ws: Workspace,
) -> State | None:  # fmt: skip
    """The state after so many steps of length k, or None where one of them fails."""
    coefficients = IMPLICIT[integrator](k)
    ws.scratch.memory[MISSED] = 0.0  # of a step of another length
    here = State(*[part.copy() for part in before])
    earlier, here.turn[:] = instant_before(system, here, acceleration, k)
    for part in range(1, parts + 1):
        now = allocate_state(system)
        ws.work.world[:] = between(world, parts * k, part / parts)
        angle, rate = curve(part * k), curve(part * k, 1)
        code, *_ = newton.step(system, coefficients, Instants(earlier, here, now), angle, rate, False, ws)
        if code != newton.CONVERGED:
            return None
        earlier, here = here, now
    return here
