"""Commands whose motion follows a delayed intended motion: the state of the robot, and one step a tick."""

import numpy as np
from calmotion.arrays import Array, IntArray
from calmotion.multibody import VelocityForces

from .efforts import EffortLimits
from .gains import Gains
from .guard import Guard
from .limits import EFFORT, MotorLimits


class Window:
    """The intended motion at the ticks from the one that is played to the newest (window + 1 ticks, M motors).

    Rates and accelerations of a tick are known once the next one is: central differences, which belong to straight
    pieces between ticks.
    """

    def __init__(self, ticks: int, limits: MotorLimits, forces: VelocityForces):
        self._tick, self._forces, self._ticks = limits.tick, forces, ticks

    def begin(self, position: Array) -> None:
        """Rest at a pose."""
        count, self.positions = len(position), np.tile(position, (self._ticks + 2, 1))
        self.rates, self.accelerations = np.zeros((2, self._ticks, count))
        moving, rest = self._forces.both(position, np.zeros(count))
        self.forces, self.with_weight = np.tile(moving - rest, (self._ticks, 1)), np.tile(moving, (self._ticks, 1))

    def push(self, position: Array) -> None:
        """The intended position of the newest tick, shape [M]; the oldest tick leaves."""
        for rows in (self.positions, self.rates, self.accelerations, self.forces, self.with_weight):
            rows[:-1] = rows[1:]
        self.positions[-1] = position
        before, at, after = self.positions[-3:]
        self.rates[-1] = (after - before) / (2.0 * self._tick)
        self.accelerations[-1] = (after - 2.0 * at + before) / self._tick**2
        self.with_weight[-1], rest = self._forces.both(at, self.rates[-1])
        self.forces[-1] = self.with_weight[-1] - rest

    @property
    def played(self) -> Array:
        """The intended position at the tick that is played."""
        return np.asarray(self.positions[1])

    @property
    def next(self) -> Array:
        """That of the tick after it."""
        return np.asarray(self.positions[2])


class Regulator:
    """The state of the robot as the linear models have it, and the next commands.

    Args:
        coupling: Of all motors with those that may deviate, shape [M, m].
        deviating: The latter, shape [m].
        limits: Of all motors.
        efforts: Their limits of effort.
        guard: When deviations are let go of.

    Attributes:
        command: Of the tick, shape [M].
    """

    def __init__(
        self, coupling: Array, deviating: IntArray, limits: MotorLimits, efforts: EffortLimits, guard: Guard
    ) -> None:
        self._coupling, self._deviating, self._limits = coupling, deviating, limits
        self._efforts, self._guard = efforts, guard
        self._gains: Gains | None = None

    def begin(self, position: Array, gains: Gains) -> None:
        """Rest at a pose."""
        self._gains, self._x = gains, np.zeros(len(gains.transition))
        self.command, self._speed, self._change = np.array(position, float), *np.zeros((2, len(position)))
        self._efforts.begin()
        self._guard.begin(len(self._x))

    def use(self, gains: Gains) -> None:
        """Go on in the modes of another pose."""
        assert self._gains is not None
        self._guard.use(gains, self._gains)
        self._x, self._gains = gains.state_from(self._x, self._gains), gains

    @property
    def deviation(self) -> Array:
        """Of the commands from the intended motion, shape [m]."""
        return self._x[: len(self._deviating)]

    def advance(self, window: Window) -> tuple[Array, IntArray]:
        """The commands of the next tick, shape [M], and what limits acted, see `MotorLimits.kept`."""
        gains, h, m, lead = self._gains, self._limits.tick, len(self._deviating), self._efforts.lead.copy()
        assert gains is not None
        impulses = gains.impulses(window.accelerations, window.rates, window.forces, h)
        self._guard.judge(gains, self._x, impulses[0], bool(np.any(impulses) or np.any(window.rates)))
        wanted = -gains.feedback @ self._x
        wanted -= np.einsum("kmi,ki->m", gains.preview[: len(impulses)], impulses)
        if gains.efforts is not None:
            wanted -= self._efforts.pull(gains.efforts, self._x, impulses, window, not self._guard.lets_go)
        if self._guard.lets_go:
            wanted = self._guard.glide(self._x[:m], self._x[m : 2 * m])
        intended = (window.next + self._efforts.lead - window.played - lead) / h
        asked = intended + self._coupling @ (self._x[m : 2 * m] + wanted)
        faster = self._speed
        self._speed, acted = self._limits.kept(self.command, faster, self._change, asked)
        self._change = self._speed - faster
        change = (self._speed - intended)[self._deviating] - self._x[m : 2 * m]
        before, following = self._x, window.next + self._efforts.lead
        self._x = gains.transition @ self._x + gains.by_change @ change + gains.by_impulse @ impulses[0]
        if gains.efforts is not None:
            self._efforts.tell(gains.efforts, before, self._x)
        self._x[:m] = (self.command + h * self._speed - following)[self._deviating]
        self.command = following + self._coupling @ self._x[:m]
        return self.command, np.where(self._efforts.acted, EFFORT, acted)
