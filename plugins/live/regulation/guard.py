"""Letting go of deviations that do more harm than the shake that they are for.

Where limits keep some motors from what the regulator asks, it may turn in circles with the others. The linear model
then finds a larger error than where the intended motion passes through as it is, and the deviations glide to zero.
"""

import numpy as np
from calmotion.arrays import Array

from .gains import Gains


class Guard:
    """Judges a regulator by its model of the robot.

    Args:
        tick: [s].

    Attributes:
        lets_go: Whether deviations glide to zero, or stay there.
        count: In how many ticks they did glide.
    """

    MEMORY_S = 0.5  # over which errors are averaged
    REST_S = 2.0  # after which a robot at rest has no use for deviations
    GLIDES = 8.0  # rate at which deviations decay [1/s]
    NONE = 1e-11  # deviation that is gone [rad or m]
    HARM = 2e-3  # error that is let be, over the longest lever: commands also move ahead of a motion

    def __init__(self, tick: float):
        self._tick = tick
        self.begin(0)

    def begin(self, size: int) -> None:
        """Rest, with a state of a size."""
        self._passing, self._errors, self._rested_s = np.zeros(size), np.zeros(2), 0.0
        self.lets_go, self.count = False, 0

    def use(self, gains: Gains, before: Gains) -> None:
        """Go on in the modes of another pose."""
        self._passing = gains.state_from(self._passing, before)

    def judge(self, gains: Gains, x: Array, impulse: Array, moves: bool) -> None:
        """Once a tick, before its commands.

        Args:
            x: State of the regulator, shape [X].
            impulse: Of the tick, shape [S n].
            moves: Whether anything in the window does.
        """
        motors = gains.by_change.shape[1]
        deviations = np.abs(x[: 2 * motors]).max(initial=0.0)
        rows = np.array_split(gains.targets, gains.robots)[gains.robots // 2]
        found = np.array([np.sum((rows @ state) ** 2) for state in (x, self._passing)])
        self._errors += self._tick / self.MEMORY_S * (found - self._errors)
        self._passing = gains.transition @ self._passing + gains.by_impulse @ impulse
        self._rested_s = 0.0 if moves else self._rested_s + self._tick
        lever = np.sum(rows[:, :motors] ** 2, axis=0).max(initial=0.0)
        harms = self._errors[0] > self._errors[1] + self.HARM**2 * lever
        deviates = bool(deviations > self.NONE)
        self.lets_go = self._rested_s > self.REST_S or (deviates and (self.lets_go or bool(harms)))
        self._errors *= not self.lets_go
        self.count += self.lets_go and deviates

    def glide(self, deviation: Array, rate: Array) -> Array:
        """The change of the rates with which deviations decay, shape [m]."""
        return -self._tick * self.GLIDES * (2.0 * rate + self.GLIDES * deviation)
