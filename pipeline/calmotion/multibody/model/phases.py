"""The phases of a motion: stretches of instants in which the same contacts hold.

A contact is a joint to the world that comes and goes. Its world-side marker is a row of the moving markers, of a
rotation matrix of zeros while it does not hold: row n says what holds in the step from instant n - 1 to n. In motion a
contact holds what it holds where that is when it comes: its rows are of velocity alone (`kernels.joints.firmness`).

The two steps after a change are by the backward Euler method, a backward difference of first order that does not reach
back over the change: velocities may jump there. A contact that comes stops what it holds within the first of them, by
the impulse h lambda (M (V1 - V0) = h F + J^T h lambda, J V1 = 0: the time-stepping scheme of Moreau, an inelastic
impact that can only take energy away); the second one no longer reads the velocity before. As few steps are of first
order, the whole stays of second order. A backward Euler step of length h is one of BDF2 of length 3/2 h whose two
earlier instants are the same.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.multibody.model.system import State, System

EULER = 1.5  # length of a BDF2 step that equals a backward Euler step, over the length of that
RESTARTED = 2  # steps after a change


class Phase(NamedTuple):
    """Instants first..last-1, in which the same contacts hold.

    Attributes:
        system: With the rows of the contacts that hold.
        restarts: 1 where they are the first after a change, so that steps do not reach back; else 0.
    """

    first: int
    last: int
    system: System
    restarts: int


def has_contacts(system: System) -> bool:
    """Whether a system has joints that come and go."""
    return bool(np.any(system.contact))


def held_contacts(system: System, world: Array) -> BoolArray:
    """Which contacts hold by moving markers of shape [..., W, 18], shape [..., C], contacts in the joints' order."""
    markers = system.moving[np.flatnonzero(system.contact)]
    return np.asarray(np.any(world[..., markers, 9:] != 0.0, axis=-1))


def system_held(system: System, world: Array) -> System:
    """The system with the rows of the contacts that hold by markers of shape [W, 18]; itself without contacts."""
    if not has_contacts(system):
        return system
    return system._replace(rows=_rows(system, held_contacts(system, world)))


def without_contacts(system: System) -> System:
    """The system while no contact holds; itself without contacts."""
    if not has_contacts(system):
        return system
    return system._replace(rows=np.where(system.contact != 0, 0, system.rows).astype(np.int32))


def _rows(system: System, held: BoolArray) -> IntArray:
    rows, joints = system.rows.copy(), np.flatnonzero(system.contact)
    rows[joints] = np.where(held, system.contact[joints], 0)
    return rows


def changes(system: System, world: Array) -> IntArray:
    """Instants whose step is the first in which other contacts hold, of markers of shape [T, W, 18]."""
    held = held_contacts(system, world)
    return np.flatnonzero(np.any(held[1:] != held[:-1], axis=1)).astype(np.int32) + 1


def phases_of(system: System, world: Array, first: int, last: int) -> list[Phase]:
    """Phases of the instants first..last-1 of a motion with moving markers of shape [T, W, 18]."""
    if first >= last:
        return []
    if not has_contacts(system):
        return [Phase(first, last, system, 0)]
    restarts = np.zeros(last, bool)
    switched = changes(system, world[:last])
    for n in switched:
        restarts[n : n + RESTARTED] = True
    ends = {int(n) for n in (*switched, *(np.flatnonzero(restarts[1:] != restarts[:-1]) + 1)) if first < n < last}
    bounds = [first, *sorted(ends), last]
    return [
        Phase(start, end, system_held(system, world[start]), int(restarts[start]))
        for start, end in zip(bounds[:-1], bounds[1:], strict=True)
    ]


def still(before: State) -> State:
    """An instant as both instants before a backward Euler step see it: its rotation from the one before does not
    count."""
    return before._replace(turn=np.zeros_like(before.turn))
