"""From samples as they arrive to a motion of the motors at each tick that keeps their limits."""

from collections import Counter, deque

import numpy as np
from calmotion.arrays import Array

from .regulation.limits import MotorLimits

LATE, REPEATED, DISORDERED, NOT_FINITE = "late", "repeated", "disordered", "not finite"
JUMP, RESTARTED, REPLACED = "jump", "restarted", "replaced"
BEYOND, TOO_EARLY = "beyond a limit", "too early"


class Stream:
    """What a sender wants, at the ticks of the player.

    A sample is used at the tick of its time stamp; the first stamp is the time of the first tick. Samples may arrive
    long before their time, as those of a chunk do; one whose time has not come takes the place of all that are not
    older. Between samples of a slower sender the motion is a cubic through them, two periods of the sender late.
    Where none arrives in time the motion goes on at its speed, turns within `patience`, and comes to rest at the last
    sample. What the limits do not allow, such as a jump, is followed as fast as they do. The clock of the sender may
    drift against that of the ticks, and may begin anew.

    Args:
        limits: Of the motors.
        patience: [s].
        period: Of the sender [s]; at most a tick: each tick has its sample.
    """

    RESTART_S = 1.0  # by which a stamp leaps, and is off the clock, where the sender's clock has begun anew
    FOLLOWING = 2e-3  # share of the distance between both clocks that is made up with each late sample
    EARLY = 0.5  # the same in each second in which all samples are early
    MOST = 200_000  # samples that wait for their time: 13 minutes at 250 Hz
    SPACINGS = 101  # samples from which the sender's rate is found

    def __init__(self, limits: MotorLimits, patience: float, period: float = 0.0):
        self.limits, self.patience, self.tick = limits, patience, limits.tick
        self.delay = 2.0 * period if period > 1.5 * self.tick else 0.0
        self.events: Counter[str] = Counter()
        self._samples: deque[tuple[float, Array]] = deque()
        self._spacings: deque[float] = deque(maxlen=self.SPACINGS)
        self._slack = self.tick if self.delay else 0.25 * self.tick
        self._period = max(period, self.tick)
        self._second = round(1.0 / self.tick)

    def begin(self, position: Array) -> None:
        """Rest at a pose; the next sample is the first."""
        self.position, self.speed = np.array(position, float), np.zeros(len(position))
        self._wanted, self._change = self.position, np.zeros(len(position))
        for kept in (self._samples, self._spacings, self.events):
            kept.clear()
        # own time: that of stamps plus `_offset`, where the tick of the first sample is 0
        self._now, self._offset, self._ticks, self._count = 0.0, 0.0, 0, 0
        self._earliest, self._early = np.inf, 0.0
        self._locked, self._ended = True, False

    def end(self) -> None:
        """No sample will come any more: that none does is no event."""
        self._ended = True

    @property
    def ahead_s(self) -> float:
        """For how long there are samples that are not played yet [s]."""
        return max(self._samples[-1][0] - self._now + self.delay, 0.0) if self._samples else 0.0

    @property
    def sender_rate(self) -> float | None:
        """Samples a second by the last stamps; None where there are too few."""
        return float(1.0 / np.median(self._spacings)) if len(self._spacings) >= 10 else None

    @property
    def count(self) -> int:
        """Samples that were used."""
        return self._count

    def give(self, stamp: float, values: Array) -> bool:
        """A sample has arrived; whether it is used.

        Args:
            stamp: Time of the sender [s].
            values: Of the motors, shape [M].
        """
        if not (np.isfinite(stamp) and np.all(np.isfinite(values))):
            self.events[NOT_FINITE] += 1
            return False
        time = stamp + self._offset
        if not self._samples:
            self._offset, time = self._now - stamp, self._now
        newest = self._samples[-1][0] if self._samples else -np.inf
        if self._samples and min(abs(time - newest), abs(time - self._now)) > self.RESTART_S:
            self.events[RESTARTED] += 1
            time = max(self._now, newest + self._period)
            self._offset = time - stamp
        if time <= newest and time < self._now - 1e-3 * self.tick:
            self.events[REPEATED if time == newest else DISORDERED] += 1
            return False
        if len(self._samples) >= self.MOST:
            self.events[TOO_EARLY] += 1
            return False
        while self._samples and self._samples[-1][0] >= time:
            if self._samples.pop()[0] > time:
                self.events[REPLACED] += 1
        if self._count and time > newest:
            self._spacings.append(time - newest)
        kept = np.clip(values, self.limits.lower, self.limits.upper)
        if np.any(kept != values):
            self.events[BEYOND] += 1
        self._samples.append((time, kept))
        self._count += 1
        # samples of a slower sender arrive within the tick after their stamps
        apart = time - self._now
        self._earliest = min(self._earliest, apart)
        self._now += self.FOLLOWING * min(apart + self._slack, 0.0)
        return True

    def advance(self) -> Array:
        """The positions at the next tick, shape [M]."""
        aim, speed = self._aim()
        h = self.tick
        # in time this is the speed that leads to the aim; else the largest from which the rest can be caught up
        wanted = self.limits.towards(aim - h * speed - self.position, self.speed, self._change, speed)
        before = self.speed
        self.speed, acted = self.limits.kept(self.position, before, self._change, wanted)
        self._change = self.speed - before
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
        if not self._samples:
            return before, np.zeros_like(before)
        self._wanted = self._at(self._now - self.delay)
        self._ticks += 1
        if self._ticks % self._second == 0:
            self._early = self.EARLY * max(self._earliest - self._slack, 0.0) if np.isfinite(self._earliest) else 0.0
            self._earliest = np.inf
        self._now += self.tick * (1.0 + self._early)
        return self._wanted, (self._wanted - before) / self.tick

    def _at(self, time: float) -> Array:
        samples, rounding = self._samples, 1e-3 * self.tick
        while len(samples) > 2 and samples[2][0] < time - rounding:
            samples.popleft()
        newest, values = samples[-1]
        after = time - newest
        if after <= rounding:
            return self._between(time, rounding)
        if after > 0.5 * self.tick and not self._ended:
            self.events[LATE] += 1
        turn = 2.0 * self.patience
        if len(samples) < 2 or after >= turn:
            return values
        speed = (values - samples[-2][1]) / max(newest - samples[-2][0], 0.5 * self._period)
        beyond = values + speed * after * (1.0 - after / turn) ** 2
        return np.clip(beyond, self.limits.lower, self.limits.upper)

    def _between(self, time: float, rounding: float) -> Array:
        """A cubic through the samples, whose slopes are those from neighbour to neighbour."""
        samples = self._samples
        k = next(k for k, (stamp, _) in enumerate(samples) if stamp >= time - rounding)
        if k == 0 or abs(samples[k][0] - time) <= rounding:
            return samples[k][1]
        (t0, p0), (t1, p1) = samples[k - 1], samples[k]
        length, chord = t1 - t0, (p1 - p0) / (t1 - t0)
        s0 = (p1 - samples[k - 2][1]) / (t1 - samples[k - 2][0]) if k > 1 else chord
        s1 = (samples[k + 1][1] - p0) / (samples[k + 1][0] - t0) if k + 1 < len(samples) else chord
        x = (time - t0) / length
        return p0 + (p1 - p0) * x * x * (3.0 - 2.0 * x) + length * x * (1.0 - x) * (s0 * (1.0 - x) - s1 * x)
