"""Where Newton's method starts a step: Taylor's formula, and what it missed at the step before; compiled.

Taylor's formula to the acceleration misses the third order, which changes little from one step to the next. With it,
predictions are as good as those of a cubic through four instants, and need no instants but the one before.
"""

from __future__ import annotations

from calmotion.arrays import Array
from calmotion.multibody.kernels.so3 import turn
from calmotion.multibody.model.system import State, System
from calmotion.support.compilation import kernel, shared_kernel

MISSED = 3  # row of a scratch's memory
JUMP = 0.5  # rotation that is missed [rad] by which a motion jumps, and tells nothing about the next step


@kernel
def _moved(h: float, before: State, memory: Array, b: int, i: int) -> float:
    """Change of position i of component b over a step, by Taylor's formula."""
    moved: float = h * (before.V[b, i] + 0.5 * h * memory[0, b, i])
    return moved


@shared_kernel
def predict(system: System, h: float, before: State, now: State, memory: Array) -> None:
    """Positions of the new instant, from the one before and the memory of its step (`Scratch.memory`)."""
    for b in range(len(system.parent)):
        for i in range(3):
            now.c[b, i] = before.c[b, i] + (_moved(h, before, memory, b, i) + memory[MISSED, b, i])
            now.turn[b, i] = _moved(h, before, memory, b, 3 + i) + memory[MISSED, b, 3 + i]
        for j in range(system.elastic[b]):
            now.u[b, j] = before.u[b, j] + (_moved(h, before, memory, b, 6 + j) + memory[MISSED, b, 6 + j])
        turn(before.q[b], now.turn[b], now.q[b])


@shared_kernel
def remember_missed(system: System, h: float, before: State, now: State, memory: Array) -> None:
    """What Taylor's formula missed at the new instant, into the memory, whose accelerations are those before it."""
    largest = 0.0
    for b in range(len(system.parent)):
        for i in range(3):
            memory[MISSED, b, i] = now.c[b, i] - before.c[b, i] - _moved(h, before, memory, b, i)
            missed: float = now.turn[b, i] - _moved(h, before, memory, b, 3 + i)
            memory[MISSED, b, 3 + i] = missed
            largest = max(largest, abs(missed))
        for j in range(system.elastic[b]):
            memory[MISSED, b, 6 + j] = now.u[b, j] - before.u[b, j] - _moved(h, before, memory, b, 6 + j)
    if largest > JUMP:
        memory[MISSED, :, :] = 0.0
