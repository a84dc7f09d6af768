"""The phases of a motion: stretches of instants in which the same contacts hold and the same motors are on.

A contact is a joint to the world that comes and goes. Its world-side marker is a row of the moving markers, of a
rotation matrix of zeros while it does not hold: row n says what holds in the step from instant n - 1 to n. In motion a
contact holds what it holds where that is when it comes: its rows are of velocity alone (`kernels.joints.firmness`).

The two steps after a change are by the backward Euler method, a backward difference of first order that does not reach
back over the change: velocities may jump there. A contact that comes stops what it holds within the first of them, by
the impulse h lambda (M (V1 - V0) = h F + J^T h lambda, J V1 = 0: the time-stepping scheme of Moreau, an inelastic
impact that can only take energy away); the second one no longer reads the velocity before. As few steps are of first
order, the whole stays of second order. A backward Euler step of length h is one of BDF2 of length 3/2 h whose two
earlier instants are the same.

A servo that is switched off exerts no torque, not even that of the voltage which it induces; its friction stays. It has
a row of the moving markers as well, of zeros while it is off. Accelerations jump there, so steps do not reach back.
"""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.multibody.model.system import BACK_EMF, POSITION_GAIN, VELOCITY_GAIN, State, System

EULER = 1.5  # length of a BDF2 step that equals a backward Euler step, over the length of that
RESTARTED = 2  # steps after a change


class Phase(NamedTuple):
    """Instants first..last-1, in which the same contacts hold and the same motors are on.

    Attributes:
        system: With the rows of the contacts that hold, and without the torque of motors that are off.
        restarts: 1 where they are the first after a change, so that steps do not reach back; else 0.
    """

    first: int
    last: int
    system: System
    restarts: int


def has_phases(system: System) -> bool:
    """Whether a system has joints that come and go, or motors that are switched."""
    return bool(np.any(system.contact)) or bool(np.any(system.switch >= 0))


def held_contacts(system: System, world: Array) -> BoolArray:
    """Which contacts hold by moving markers of shape [..., W, 18], shape [..., C], contacts in the joints' order."""
    return _on(world, system.moving[np.flatnonzero(system.contact)])


def _on(world: Array, rows: IntArray) -> BoolArray:
    return np.asarray(np.any(world[..., rows, 9:] != 0.0, axis=-1))


def system_held(system: System, world: Array) -> System:
    """The system with the rows of the contacts that hold, and the motors that are on, by markers of shape [W, 18];
    itself where nothing comes and goes."""
    if np.any(system.contact):
        rows, joints = system.rows.copy(), np.flatnonzero(system.contact)
        rows[joints] = np.where(held_contacts(system, world), system.contact[joints], 0)
        system = system._replace(rows=rows)
    switched = np.flatnonzero(system.switch >= 0)
    off = switched[~_on(world, system.switch[switched])]
    if len(off):
        servo = system.servo.copy()
        servo[off[:, None], [POSITION_GAIN, VELOCITY_GAIN, BACK_EMF]] = 0.0
        system = system._replace(servo=servo)
    return system


def without_contacts(system: System) -> System:
    """The system while no contact holds; itself without contacts."""
    if not np.any(system.contact):
        return system
    return system._replace(rows=np.where(system.contact != 0, 0, system.rows).astype(np.int32))


def changes(system: System, world: Array) -> IntArray:
    """Instants whose step is the first in which other contacts hold or other motors are on, of markers of shape
    [T, W, 18]."""
    on = np.hstack([held_contacts(system, world), _on(world, system.switch[system.switch >= 0])])
    return np.flatnonzero(np.any(on[1:] != on[:-1], axis=1)).astype(np.int32) + 1


def phases_of(system: System, world: Array, first: int, last: int) -> list[Phase]:
    """Phases of the instants first..last-1 of a motion with moving markers of shape [T, W, 18]."""
    if first >= last:
        return []
    if not has_phases(system):
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
