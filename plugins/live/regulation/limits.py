"""Speeds that keep the motors' limits at all later ticks, for commands that run straight between two ticks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array, IntArray
from calmotion.model import Character

NAMES = ("position", "velocity", "acceleration", "effort")
EFFORT = NAMES.index("effort")  # which is told, not kept


def braking_speed(distance: Array, acceleration: Array, tick: float) -> Array:
    """The largest speed from which a motor can stop within a distance, slowing down at each tick.

    A speed of a h x comes to rest within n = ceil(x) ticks, over a h^2 (n x - n (n - 1) / 2).

    Args:
        distance: [rad or m], not negative.
        acceleration: a, may be infinite.
        tick: h [s].
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        steps = np.where(np.isfinite(acceleration), distance / (acceleration * tick**2), 0.0)
        ticks = np.maximum(np.ceil(np.sqrt(0.25 + 2.0 * steps) - 0.5), 1.0)
        slowed = np.where(ticks > 1.0, 0.5 * acceleration * tick * (ticks - 1.0), 0.0)
        return np.where(np.isfinite(distance), distance / (tick * ticks) + slowed, np.inf)


@dataclass(frozen=True, eq=False)
class MotorLimits:
    """Limits of M motors, infinite where there are none.

    Attributes:
        lower, upper: Positions [rad or m], shape [M].
        velocity, acceleration: Shape [M].
        tick: Time between two commands [s].
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    tick: float

    @classmethod
    def of(cls, character: Character, tick: float) -> MotorLimits:
        """Those of a character's motors."""
        joints, motors = [character.joints[motor.joint] for motor in character.motors], character.motors
        return cls(
            np.array([joint.lower for joint in joints], float),
            np.array([joint.upper for joint in joints], float),
            np.array([motor.max_velocity for motor in motors], float),
            np.array([motor.max_acceleration for motor in motors], float),
            tick,
        )

    def share(self, of: float) -> MotorLimits:
        """The same positions with a share of velocity and acceleration."""
        return MotorLimits(self.lower, self.upper, of * self.velocity, of * self.acceleration, self.tick)

    def kept(self, position: Array, speed: Array, wanted: Array) -> tuple[Array, IntArray]:
        """The speeds next to wanted ones that keep all limits now and can keep them later.

        Args:
            position, speed: Where the motors are and how they came there, which kept the limits, shape [M].
            wanted: Speeds for the next tick, shape [M].

        Returns:
            The speeds, and for each motor the number of `NAMES` that acted, -1 for none.
        """
        step = self.acceleration * self.tick
        up = braking_speed(np.maximum(self.upper - position, 0.0), self.acceleration, self.tick)
        down = braking_speed(np.maximum(position - self.lower, 0.0), self.acceleration, self.tick)
        upper, lower = np.stack([up, self.velocity, speed + step]), np.stack([-down, -self.velocity, speed - step])
        most, least = upper.min(axis=0), lower.max(axis=0)
        # from a position beyond its limits, or a speed that no motor may have, back as fast as allowed
        least = np.minimum(least, most)
        found = np.clip(wanted, least, most)
        which: IntArray = np.where(
            wanted > most, upper.argmin(axis=0), np.where(wanted < least, lower.argmax(axis=0), -1)
        ).astype(np.int32)
        return found, which
