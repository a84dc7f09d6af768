"""A simulation of which only a piece in time is held at once: that of a whole long shot would fill the memory."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.coefficients import IMPLICIT
from calmotion.multibody.integrators.integrate import integrate
from calmotion.multibody.integrators.simulation import march
from calmotion.multibody.integrators.trajectory import Inputs, Record, Trajectory, copy_of_instant
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.moving_markers import rooted
from calmotion.multibody.model.phases import has_contacts
from calmotion.multibody.model.system import State, System

NEEDED = 2  # instants before a step that its formulas read; what else they remember is in the workspace


def integrate_in_pieces(
    system: System, start: State, angles: Array, rates: Array, h: float, workspace: Workspace, integrator: str,
    world: Array | None, size: int, divides: bool = True,
) -> Iterator[tuple[slice, Trajectory]]:  # fmt: skip
    """`integrate` from static equilibrium, to the last bit, piece by piece.

    Contacts and integrators that are not implicit make one piece.

    Args:
        workspace: Nobody else may use it before the last piece.
        size: Largest number of instants of a piece; at least three.
        divides: As of `integrate`.

    Yields:
        The instants of a piece, and their trajectory.

    Raises:
        SimulationFailure: A step that cannot be solved.
    """
    total = len(angles)
    size = max(size, NEEDED + 1)
    done = min(size, total)
    if integrator not in IMPLICIT or has_contacts(system):
        done = total
    first = slice(0, done)
    piece = integrate(
        system, start, angles[first], rates[first], h, workspace, integrator=integrator,
        world=None if world is None else world[first], divides=divides,
    )  # fmt: skip
    yield first, piece
    roots = rooted(world, total)
    while done < total:
        stop = min(done + size, total)
        rows = slice(done - NEEDED, stop)
        piece = _gone_on(system, piece, Inputs(angles[rows], rates[rows], roots[rows]), workspace, done, divides)
        yield slice(done, stop), piece
        done = stop


def _gone_on(system: System, before: Trajectory, inputs: Inputs, ws: Workspace, done: int, divides: bool) -> Trajectory:
    """The piece after another one.

    Args:
        inputs: From the last two instants of that piece on.
        done: Instants before this piece.
    """
    begin, count = time.perf_counter(), len(inputs.angles)
    states = State(*[np.zeros((count, *part.shape[1:])) for part in before.states])
    for part, known in zip(states, before.states, strict=True):
        part[:NEEDED] = known[-NEEDED:]
    record = Record(copy_of_instant(states, 0), states, np.zeros(count), np.zeros((count, 3)))
    try:
        found = march(system, before.integrator, before.h, NEEDED, inputs, record, ws, begin, divides=divides)
    except SimulationFailure as failure:
        failure.time_s += (done - NEEDED) * before.h
        raise
    own = slice(NEEDED, None)
    return replace(
        found, states=State(*[part[own] for part in states]), world=inputs.world[own], margins=found.margins[own],
        costs=found.costs[own], refined=tuple(n - NEEDED for n in found.refined),
    )  # fmt: skip
