"""From samples as they arrive to a motion of the motors at each tick that keeps their limits."""

from __future__ import annotations

from collections import Counter, deque

import numpy as np
from calmotion.arrays import Array

from .limits import MotorLimits, braking_speed

LATE, REPEATED, DISORDERED, NOT_FINITE = "late", "repeated", "disordered", "not finite"
JUMP, RESTARTED = "jump", "restarted"


class Stream:
    """What a sender wants, at the ticks of the player.

    A sample is used at the tick of its time stamp; the first stamp is the time of the first tick. Between samples of a
    slower sender the motion is a cubic through them, two periods of the sender late. Where none arrives in time the
    motion goes on at its speed for at most `patience`, then to rest. What the limits do not allow, such as a jump, is
    followed as fast as they do. The clock of the sender may drift against that of the ticks, and may begin anew.

    Args:
        limits: Of the motors.
        patience: [s].
        period: Of the sender [s]; at most a tick: each tick has its sample.
    """

    RESTART_S = 1.0  # by which a stamp leaps where the sender's clock has begun anew
    FOLLOWING = 2e-3  # share of the distance between both clocks that is made up with each sample

    def __init__(self, limits: MotorLimits, patience: float, period: float = 0.0):
        self.limits, self.patience, self.tick = limits, patience, limits.tick
        self.delay = 2.0 * period if period > 1.5 * self.tick else 0.0
        self.events: Counter[str] = Counter()
        self._samples: deque[tuple[float, Array]] = deque(maxlen=64)
        self._slack = self.tick if self.delay else 0.25 * self.tick
        self._period = max(period, self.tick)
        self._start: float | None = None
        self._ticks = 0
        self._locked = True

    def begin(self, position: Array) -> None:
        """Rest at a pose; the next sample is the first."""
        self.position, self.speed = np.array(position, float), np.zeros(len(position))
        self._wanted = self.position
        self._samples.clear()
        self.events.clear()
        self._start, self._ticks, self._locked, self._ended = None, 0, True, False

    def end(self) -> None:
        """No sample will come any more: that none does is no event."""
        self._ended = True

    def give(self, stamp: float, values: Array) -> None:
        """A sample has arrived: the time of the sender [s], and the motors' values, shape [M]."""
        if not (np.isfinite(stamp) and np.all(np.isfinite(values))):
            self.events[NOT_FINITE] += 1
            return
        if self._samples and abs(stamp - self._samples[-1][0]) > self.RESTART_S:
            self.events[RESTARTED] += 1
            self._samples.clear()
            self._start = None
        if self._samples and stamp <= self._samples[-1][0]:
            self.events[REPEATED if stamp == self._samples[-1][0] else DISORDERED] += 1
            return
        if self._start is None:
            self._start, self._ticks = stamp, 0
        apart = stamp - self._start - self._ticks * self.tick
        # samples of a slower sender arrive within the tick after their stamps
        self._start += self.FOLLOWING * (apart - np.clip(apart, -self._slack, self._slack))
        self._samples.append((stamp, np.clip(values, self.limits.lower, self.limits.upper)))

    def advance(self) -> Array:
        """The positions at the next tick, shape [M]."""
        aim, speed = self._aim()
        h = self.tick
        gap = aim - h * speed - self.position
        # in time this is the speed that leads to the aim; else the largest from which the rest can be caught up
        catch_up = np.sign(gap) * braking_speed(np.abs(gap), self.limits.acceleration, h)
        self.speed, acted = self.limits.kept(self.position, self.speed, speed + catch_up)
        self.position = self.position + h * self.speed
        locked = bool(np.all(np.abs(aim - self.position) <= 1e-12 + 1e-9 * np.abs(aim)))
        if locked:
            self.position = aim.copy()
        elif self._locked and np.any(acted >= 0):
            self.events[JUMP] += 1
        self._locked = locked
        return self.position

    def _aim(self) -> tuple[Array, Array]:
        """Where the sender wants the motors at the next tick, and the speed that it has there."""
        before = self._wanted
        if self._start is None or not self._samples:
            return before, np.zeros_like(before)
        time = self._start + self._ticks * self.tick - self.delay
        self._ticks += 1
        self._wanted = self._at(time)
        return self._wanted, (self._wanted - before) / self.tick

    def _at(self, time: float) -> Array:
        stamps = [stamp for stamp, _ in self._samples]
        newest, values = self._samples[-1]
        after = time - newest
        if after <= 1e-3 * self.tick:
            return self._between(time, stamps)
        if after > 0.5 * self.tick and not self._ended:
            self.events[LATE] += 1
        if len(stamps) < 2:
            return values
        # the speed of the last samples, which ends smoothly after the patience
        speed = (values - self._samples[-2][1]) / max(newest - stamps[-2], 0.5 * self._period)
        left = min(after / self.patience, 1.0) if self.patience > 0.0 else 1.0
        return np.clip(values + speed * self.patience * left * (1.0 - 0.5 * left), self.limits.lower, self.limits.upper)

    def _between(self, time: float, stamps: list[float]) -> Array:
        """A cubic through the samples, whose slopes are those from neighbour to neighbour."""
        k = int(np.searchsorted(stamps, time - 1e-3 * self.tick))
        if k == 0 or abs(stamps[k] - time) <= 1e-3 * self.tick:
            return self._samples[k][1]
        t0, t1, p0, p1 = stamps[k - 1], stamps[k], self._samples[k - 1][1], self._samples[k][1]
        length, chord = t1 - t0, (p1 - p0) / (t1 - t0)
        s0 = (p1 - self._samples[k - 2][1]) / (t1 - stamps[k - 2]) if k > 1 else chord
        s1 = (self._samples[k + 1][1] - p0) / (stamps[k + 1] - t0) if k + 1 < len(stamps) else chord
        x = (time - t0) / length
        return p0 + (p1 - p0) * x * x * (3.0 - 2.0 * x) + length * x * (1.0 - x) * (s0 * (1.0 - x) - s1 * x)
