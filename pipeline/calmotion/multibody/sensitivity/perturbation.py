"""Perturbations of the two instants that a step of BDF2 reads, and their tangents and adjoints over a simulation."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.kernels.so3 import turn, turns_between
from calmotion.multibody.model.system import State, System
from calmotion.multibody.sensitivity.adjoint import sweep_adjoint
from calmotion.multibody.sensitivity.linearization import Linearization
from calmotion.multibody.sensitivity.sweep import allocate_memory
from calmotion.multibody.sensitivity.tangent import sweep_tangent


@dataclass(frozen=True, eq=False)
class Perturbation:
    """Perturbation of the data that a step reads of two instants, by parts and as one vector.

    Attributes:
        shift: Translations of both in world axes, shape [2, B, 3].
        rotation: Rotation of the later one, body axes, shape [B, 3].
        elastic: Elastic coordinates of both, shape [2, B, R].
        velocity: Of both, shape [2, B, N].
        turn: Of the rotation vector between them, shape [B, 3].
    """

    shift: Array
    rotation: Array
    elastic: Array
    velocity: Array
    turn: Array

    @classmethod
    def of(cls, system: System, vector: Array | None = None) -> Perturbation:
        """From a vector, or zero."""
        count, size = len(system.parent), system.size
        shapes = (2, count, 3), (count, 3), (2, count, size - 6), (2, count, size), (count, 3)
        if vector is None:
            return cls(*[np.zeros(shape) for shape in shapes])
        ends = np.cumsum([int(np.prod(shape)) for shape in shapes])[:-1]
        return cls(*[part.reshape(shape) for part, shape in zip(np.split(vector, ends), shapes, strict=True)])

    @property
    def vector(self) -> Array:
        """All in one, shape [n]."""
        return np.concatenate([getattr(self, part.name).ravel() for part in fields(self)])

    def times(self, factor: float) -> Perturbation:
        """All parts times a factor."""
        return Perturbation(*[factor * getattr(self, part.name) for part in fields(self)])

    def scaled(self, factor: float) -> Perturbation:
        """Velocities times a factor [s], which makes them comparable with positions."""
        return Perturbation(self.shift, self.rotation, self.elastic, factor * self.velocity, self.turn)

    def over(self, unit: Array) -> Perturbation:
        """Each entry over the unit of its coordinate, shape [B, N]."""
        shift, elastic = self.shift / unit[:, :3], self.elastic / unit[:, 6:]
        return Perturbation(shift, self.rotation, elastic, self.velocity / unit, self.turn)


def tangent_from(
    lin: Linearization, start: Perturbation, d_angle: Array, d_rate: Array, efforts: bool = False
) -> tuple[Array, Array, Perturbation]:
    """`tangent.tangent` from a perturbation of the first two instants.

    Returns:
        As `tangent.tangent`, and the perturbation of the last two instants.
    """
    total, count, size = len(d_angle), len(lin.system.parent), lin.system.size
    dX, memory = np.zeros((total, count, size)), allocate_memory(lin.system, 3)
    memory.shift[:2], memory.velocity[:2], memory.turn[1] = start.shift, start.velocity, start.turn
    memory.velocity[:2, np.arange(size) >= 6 + lin.system.elastic[:, None]] = 0.0  # padding
    dX[1, :, 3:6], dX[:2, :, 6:] = start.rotation, start.elastic
    d_effort = sweep_tangent(lin, d_angle, d_rate, efforts, memory, dX)
    ends = [(total - 2) % 3, (total - 1) % 3]
    shift, velocity, turn = memory.shift[ends], memory.velocity[ends], memory.turn[ends[1]].copy()
    return dX, d_effort, Perturbation(shift, dX[-1, :, 3:6].copy(), dX[-2:, :, 6:].copy(), velocity, turn)


def adjoint_from(
    lin: Linearization, gradient: Array, end: Perturbation, effort_gradient: Array | None = None
) -> tuple[Array, Array, Perturbation]:
    """The transpose of `tangent_from`.

    Args:
        gradient, effort_gradient: As for `adjoint.adjoint`; those of instants 0 and 1 are not read.
        end: Derivative by the perturbation of the last two instants.

    Returns:
        Derivatives by angles and rates, shape [T, J] each, and by the perturbation of the first two instants.
    """
    Xbar = gradient.copy()
    Xbar[:2] = 0.0
    memory = allocate_memory(lin.system, len(Xbar))
    memory.shift[-2:], memory.velocity[-2:], memory.turn[-1] = end.shift, end.velocity, end.turn
    Xbar[-1, :, 3:6] += end.rotation
    Xbar[-2:, :, 6:] += end.elastic
    g_angle, g_rate = sweep_adjoint(lin, Xbar, effort_gradient, memory)
    start = Perturbation(memory.shift[:2], Xbar[1, :, 3:6], Xbar[:2, :, 6:], memory.velocity[:2], memory.turn[1])
    return g_angle, g_rate, start


def end_difference(system: System, states: State) -> Perturbation:
    """Difference of the last two instants of a trajectory and its first two."""
    rotation = np.zeros((len(system.parent), 3))
    turns_between(states.q[1], states.q[-1], rotation)
    return Perturbation(
        states.c[-2:] - states.c[:2],
        rotation,
        states.u[-2:] - states.u[:2],
        states.V[-2:] - states.V[:2],
        states.turn[-1] - states.turn[1],
    )


def perturbed(system: System, before2: State, before: State, change: Perturbation) -> tuple[State, State]:
    """Two instants after a perturbation."""
    first, second = State(*[part.copy() for part in before2]), State(*[part.copy() for part in before])
    for k, state in enumerate((first, second)):
        state.c[:] += change.shift[k]
        state.u[:] += change.elastic[k]
        state.V[:] += change.velocity[k]
    second.turn[:] += change.turn
    for b in range(len(system.parent)):
        turn(before.q[b], change.rotation[b], second.q[b])
        turn(second.q[b], -second.turn[b], first.q[b])
    return first, second
