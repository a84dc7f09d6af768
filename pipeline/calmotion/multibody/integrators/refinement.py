"""Steps that are divided into smaller ones: where Newton's method does not solve one, or friction turns in it.

For a step that is not solved, the end of the smaller ones is the initial guess for the step itself, whose equations are
then solved as everywhere else, so that gradients are exact. Where they still cannot be solved, the end of the smaller
steps is the result.

The friction of a servo turns within the speed by which it is smoothed, which a step passes in one leap. How far motion
goes beyond depends on where in the step that is, so that the exact derivative of such a step has little to do with that
of the motion: of a hobby servo by 2 ms steps 0.065 or -0.02 rad where it is 0.04, which a sixteenth of the step shows,
and a division of the steps in which friction turns.
"""

import math

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from calmotion.arrays import Array
from calmotion.multibody.integrators import newton
from calmotion.multibody.integrators.coefficients import IMPLICIT, MISSED
from calmotion.multibody.integrators.trajectory import Inputs, Record
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.so3 import turns_between
from calmotion.multibody.model.moving_markers import between
from calmotion.multibody.model.system import (
    BEYOND_COULOMB,
    FRICTION,
    FRICTION_SPEED,
    Instants,
    State,
    System,
    allocate_state,
)
from calmotion.multibody.statics.consistent_start import instant_before
from calmotion.support.compilation import shared_kernel

PARTS = (4, 16, 64, 256)
TURNED = 3  # code of a step in which friction turns, beside those of `newton`
TURNS = 0.01  # change of the direction of friction (-1 to 1) in a step, from which it is divided
RESOLVED = 0.5  # change of the speed in a part of such a step, over the speed by which friction is smoothed
MOST = 64  # parts


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
    for parts in PARTS:
        end = _small_steps(system, integrator, h, n, parts, inputs, before, memory, ws)
        if end is None:
            continue
        after = ws.scratch.memory.copy()
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
    system: System, integrator: str, h: float, n: int, parts: int, inputs: Inputs, before: State, memory: Array,
    ws: Workspace,
) -> State | None:  # fmt: skip
    """The state after so many parts of step n from a state and its memory, or None where one of them fails."""
    k, world = h / parts, inputs.world[n - 1 : n + 1]
    curve = CubicHermiteSpline([0.0, h], inputs.angles[n - 1 : n + 1], inputs.rates[n - 1 : n + 1])
    times = k * np.arange(1, parts + 1)
    angles, rates = curve(times), curve(times, 1)
    coefficients = IMPLICIT[integrator](k)
    ws.scratch.memory[:] = memory
    ws.scratch.memory[MISSED] = 0.0  # of a step of another length
    here = State(*[part.copy() for part in before])
    earlier, here.turn[:] = instant_before(system, here, memory[0], k)
    for part in range(parts):
        now = allocate_state(system)
        ws.work.world[:] = between(world, h, (part + 1) / parts)
        code, *_ = newton.step(system, coefficients, Instants(earlier, here, now), angles[part], rates[part], False, ws)
        if code != newton.CONVERGED:
            return None
        earlier, here = here, now
    here.turn[:] = _turn_between(before, here)
    return here


@shared_kernel
def parts_of_turn(system: System, before: State, now: State) -> int:
    """Parts of a step that resolve how the friction of a servo turns between its ends; 1 where it does not."""
    parts = 1.0
    for joint in range(len(system.rotor)):
        motor, k = system.servo[joint], system.rotor[joint]
        if k < 0 or not (motor[FRICTION] > 0.0 or motor[BEYOND_COULOMB] > 0.0):
            continue
        b, width = system.side[joint, 1], motor[FRICTION_SPEED]
        first, last = before.V[b, 6 + k] / width, now.V[b, 6 + k] / width
        if abs(math.tanh(last) - math.tanh(first)) > TURNS:
            parts = max(parts, abs(last - first) / RESOLVED)
    return int(min(math.ceil(parts), MOST))


def resolved_step(
    system: System, integrator: str, h: float, n: int, parts: int, inputs: Inputs, record: Record, memory: Array,
    ws: Workspace,
) -> bool:  # fmt: skip
    """Replace the end of step n by that of smaller ones, where these can be solved, and tell whether.

    Args:
        memory: Of the scratch, before the step.
    """
    before = State(*[part[n - 1] for part in record.states])
    after = ws.scratch.memory.copy()
    end = _small_steps(system, integrator, h, n, parts, inputs, before, memory, ws)
    if end is None:
        ws.scratch.memory[:] = after
        return False
    _copy(end, State(*[part[n] for part in record.states]))
    ws.scratch.memory[MISSED] = 0.0  # of small steps
    return True
