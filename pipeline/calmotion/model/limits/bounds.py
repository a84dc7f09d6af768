"""Limits of the motors, and how far a motion exceeds them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.model.character import Character
from calmotion.model.limits.base import CurveLimit
from calmotion.model.limits.kinds import kinds_of_limits


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of one quantity of all motors, shape [M] each; infinite where there are none.

    Attributes:
        lower, upper: [rad], [rad/s], [rad/s^2] or [N m] (m and N of a length motor).
        scale: What an excess is measured by.
    """

    lower: Array
    upper: Array
    scale: Array

    @classmethod
    def between(cls, lower: Array, upper: Array) -> Bounds:
        """Bounds whose scale is their size, or 1 where that is zero or there are none."""
        both = np.abs(np.stack([lower, upper]))
        size = np.max(np.where(np.isfinite(both), both, 0.0), axis=0)
        return cls(lower, upper, np.where(size > 0.0, size, 1.0))

    def narrowed(self, shares: Array) -> Bounds:
        """So large shares of these bounds, shape [M]."""
        return Bounds(self.lower * shares, self.upper * shares, self.scale)


def motor_bounds(character: Character, movable: BoolArray | None = None) -> dict[str, Bounds]:
    """Bounds by the name of their quantity; only quantities of which some motor has one.

    Args:
        movable: Motors whose curve may change, shape [M]; the curves of others are not bounded. None: all motors.
    """
    joints = [character.joints[motor.joint] for motor in character.motors]
    found: dict[str, Bounds] = {}
    for name, kind in kinds_of_limits().items():
        pairs = [kind.bounds(motor, joint) for motor, joint in zip(character.motors, joints, strict=True)]
        lower, upper = np.array(pairs, float).reshape(-1, 2).T
        if movable is not None and isinstance(kind, CurveLimit):
            lower, upper = np.where(movable, lower, -np.inf), np.where(movable, upper, np.inf)
        if np.any(np.isfinite([lower, upper])):
            found[name] = Bounds.between(lower, upper)
    return found


@dataclass(frozen=True, eq=False)
class Excess:
    """How far a motor goes within one of its limits.

    Attributes:
        motor: Its index.
        quantity: Name of the kind of limit.
        limit: The limit [rad], [rad/s], [rad/s^2] or [N m].
        value: The value that comes closest to it, or exceeds it most.
        instant: When.
        excess: (value - limit) / scale: positive where the limit is exceeded.
    """

    motor: int
    quantity: str
    limit: float
    value: float
    instant: int
    excess: float


def excesses(bounds: dict[str, Bounds], values: dict[str, Array], judged: BoolArray) -> list[Excess]:
    """For each limit of each motor, where it comes closest.

    Args:
        values: Of each quantity, shape [T, M].
        judged: Which instants count, shape [T].
    """
    found = []
    instants = np.flatnonzero(judged)
    for name, bound in bounds.items():
        for motor in range(len(bound.scale)):
            v = values[name][instants, motor]
            ends = ((bound.upper[motor], 1.0), (bound.lower[motor], -1.0))
            sides = [(limit, sign * (v - limit)) for limit, sign in ends if np.isfinite(limit)]
            if sides:
                limit, beyond = max(sides, key=lambda side: float(np.max(side[1])))
                n = int(np.argmax(beyond))
                share = float(beyond[n] / bound.scale[motor])
                found.append(Excess(motor, name, float(limit), float(v[n]), int(instants[n]), share))
    return found
