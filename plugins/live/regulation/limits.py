"""Speeds that keep the motors' limits at all later ticks, for commands that run straight between two ticks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array, IntArray
from calmotion.model import Character

from .jerk import approach, kept_with_jerk

NAMES = ("position", "velocity", "acceleration", "effort", "jerk")
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
        velocity, acceleration, jerk: Shape [M].
        tick: Time between two commands [s].
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
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
            np.array([motor.max_jerk for motor in motors], float),
            tick,
        )

    def towards(self, gap: Array, speed: Array, change: Array, aim: Array) -> Array:
        """The speeds with which motors catch up, and do not pass, where they are wanted, shape [M].

        Args:
            gap: To where they are wanted at the next tick, if they go on with the speeds `aim` [rad or m].
            speed, change: Of the last tick, as of `kept`.
        """
        caught = aim + np.sign(gap) * braking_speed(np.abs(gap), self.acceleration, self.tick)
        limited = np.isfinite(self.jerk)
        if not np.any(limited):
            return caught
        most = self.jerk * self.tick**2
        gaps = gap + self.tick * aim
        return np.where(
            limited, approach(gaps, speed, change, aim, self.acceleration * self.tick, most, self.tick), caught
        )

    def kept(self, position: Array, speed: Array, change: Array, wanted: Array) -> tuple[Array, IntArray]:
        """The speeds next to wanted ones that keep all limits now and can keep them later.

        Args:
            position, speed: Where the motors are and how they came there, which kept the limits, shape [M].
            change: By how much the speed changed with the last tick, shape [M].
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
        limited = np.isfinite(self.jerk)
        if np.any(limited):
            slower, acted = kept_with_jerk(
                position, speed, change, wanted, self.lower, self.upper, self.velocity, step,
                self.jerk * self.tick**2, self.tick,
            )  # fmt: skip
            found, which = np.where(limited, slower, found), np.where(limited, acted, which).astype(np.int32)
        return found, which
