"""A stream of commands with gaps, repeated ticks or a coarse rate."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from calmotion.arrays import Array

from ..guessing import with_guessed_loops
from ..kernels import late
from ..signals import Drive
from ..situation import Situation
from .base import AddedExplanation, Effect, State


class Stream(AddedExplanation):
    """Commands that arrive late, twice, not at all, or in coarse steps; all joints show it at the same time."""

    cause = "stream"
    label = "the stream of commands"
    tells = "a log of the time at which the driver receives each command"
    RATES = (4.0, 40.0)  # of a coarse stream [Hz]
    PEAKS, PHASES = 6, 7  # of the periodogram that are tried, and phases of each
    LENGTHS = (0.04, 0.06, 0.09, 0.13, 0.2, 0.3)  # of a gap [s]
    MOST = 14  # gaps
    WORTH = 8.0  # gain of a gap in half the squared weighted error, by the logarithm of the number of samples

    def effect(self, situation: Situation, state: State, error: Array, start: Effect | None) -> Effect:
        """What was sent, or the coarse rate or the gaps that fit best."""
        healthy = situation.moved(situation.healthy)
        if situation.sent is not None:
            moved = situation.moved(_drive(situation, situation.sent), situation.sent) - healthy
            rows = ({"name": "largest_jump", "path": "", "value": _largest_jump(situation), "unit": "rad or m"},)
            return Effect(situation.of_joints(moved), moved, rows, 0)
        found = [self._coarse(situation, healthy, error), self._gaps(situation, healthy, error)]
        keep = situation.fitted
        penalty = np.log(max(keep.sum(), 2))
        return min(
            found, key=lambda e: 0.5 * np.sum((error - e.vector)[keep] ** 2) / _spread(error) + e.count * penalty
        )

    def _coarse(self, situation: Situation, healthy: Array, error: Array) -> Effect:
        """A command that is held for a period."""
        keep, best = situation.fitted, (np.inf, 0.0, 0.0)
        tried = self._periods(situation, error)
        if not tried:
            return Effect(np.zeros(len(error)))
        drive = situation.healthy
        for turn in range(4):
            for rate, phase in tried:
                moved = situation.moved(drive, self._asked(situation, rate, phase))
                vector = situation.of_joints(moved - healthy)
                best = min(best, (float(np.sum((error - vector)[keep] ** 2)), rate, phase))
            _, rate, phase = best
            if not turn and drive is not (drive := _drive(situation, self._asked(situation, rate, phase))):
                best = (np.inf, rate, phase)
            # over the whole recording, the phase tells the rate
            near, turns = 1.2 / situation.times[-1] / 2.5**turn, 0.3 / 2.5**turn
            tried = [
                (rate + a, (phase - a * 0.5 * situation.times[-1] + b) % 1.0)
                for a in near * np.linspace(-1.0, 1.0, 7)
                for b in turns * np.linspace(-1.0, 1.0, 5)
            ]
        _, rate, phase = best
        moved = situation.moved(drive, self._asked(situation, rate, phase)) - healthy
        rows = ({"name": "rate", "path": "", "value": rate, "unit": "Hz"},)
        return Effect(situation.of_joints(moved), moved, rows, 2)

    def _periods(self, situation: Situation, error: Array) -> list[tuple[float, float]]:
        """Rates and phases by the periodogram of how late encoders are: a sawtooth, whose first harmonic is
        -sin(2 pi (rate t + phase)) / (pi rate)."""
        some = slice(None, None, max(1, round(0.004 / situation.h)))
        times = situation.times[some]
        weight, late_by = np.zeros((2, len(times)))
        for m, (signal, own) in _encoder_errors(situation, error).items():
            speed = situation.rates[some, m]
            weight, late_by = weight + own * speed**2, late_by - own * signal[some] * speed
        if not np.any(weight):
            return []
        rates = np.arange(*self.RATES, 0.35 / times[-1])
        late_by = late_by - weight * (np.sum(late_by) / np.sum(weight))
        waves = np.exp(2j * np.pi * rates[:, None] * times)
        size = waves @ late_by / (waves**0 @ weight)
        found = []
        for k in np.argsort(-np.abs(size) * rates)[: self.PEAKS]:
            # sin(x + p) has the phase p - pi/2 of a cosine, and the conjugate of the sum
            phase = (np.angle(-np.conj(size[k])) + 0.5 * np.pi) / (2.0 * np.pi)
            # lags that are guessed shift phases
            found += [(float(rates[k]), float(phase + d) % 1.0) for d in np.arange(self.PHASES) / self.PHASES]
        return found

    def _asked(self, situation: Situation, rate: float, phase: float) -> Array:
        """The command in steps of a rate [Hz]."""
        ticks = (np.floor(situation.times * rate + phase) - phase) / rate
        at = np.clip(np.round(ticks / situation.h).astype(int), 0, len(situation.command) - 1)
        return np.asarray(situation.command[at])

    def _gaps(self, situation: Situation, healthy: Array, error: Array) -> Effect:
        """Gaps in which the last command is held, one after the other, as long as each is worth its parameters."""
        command, total = situation.command.copy(), np.zeros(len(error))
        gaps: list[tuple[float, float]] = []
        worth = self.WORTH * np.log(len(error)) * _spread(error)
        while len(gaps) < self.MOST:
            left = error - total
            found = self._best_gap(situation, command, left)
            if found is None:
                break
            held = np.empty_like(command)
            late(situation.h, command, *found, held)
            vector = situation.of_joints(situation.moved(situation.healthy, held) - healthy)
            if 0.5 * (np.sum(left**2) - np.sum((error - vector) ** 2)) < worth:
                break
            command, total = held, vector
            gaps.append(found)
        if not gaps:
            return Effect(total)
        lengths = [length for _, length in gaps]
        rows = (
            {"name": "gaps", "path": "", "value": float(len(gaps)), "unit": ""},
            {"name": "longest_gap", "path": "", "value": max(lengths), "unit": "s"},
        )
        moved = situation.moved(situation.healthy, command) - healthy
        return Effect(total, moved, rows, 2 * len(gaps))

    def _best_gap(self, situation: Situation, command: Array, left: Array) -> tuple[float, float] | None:
        """Start and length of the gap that explains most of what is left in encoders, by the joints' lags."""
        h, last = situation.h, len(command) - 1
        step = max(1, round(0.008 / h))
        starts = np.arange(0, last - round(self.LENGTHS[0] / h), step)
        best: tuple[float, float, float] = (0.0, 0.0, 0.0)
        # the encoders' error on the grid, moved back by the lag of each loop
        signals = _encoder_errors(situation, left)
        if not signals:
            return None
        for length in self.LENGTHS:
            n = round(length / h)
            window = np.arange(n)
            rows = np.minimum(starts[:, None] + window, last)
            gain = np.zeros(len(starts))
            for m, (signal, weight) in signals.items():
                shape = command[starts, m][:, None] - command[rows, m]
                gain += weight * (2.0 * np.sum(shape * signal[rows], 1) - np.sum(shape**2, 1))
            k = int(np.argmax(gain))
            best = max(best, (float(gain[k]), starts[k] * h, length))
        if best[0] <= 0.0:
            return None
        return best[1], best[2]

    def remedy(self, situation: Situation, parameters: Sequence[Mapping[str, Any]]) -> str:
        """Mend the sender."""
        rows = {row["name"]: row["value"] for row in parameters}
        if "rate" in rows:
            return (
                f"commands arrive in steps of {rows['rate']:.3g} Hz: send them at 100 Hz or more, or interpolated "
                "(calmotion export --rate finds the lowest rate; calmotion live --sender-rate smooths a slow sender)"
            )
        what = (
            f"{rows['gaps']:.0f} gaps of up to {1e3 * rows['longest_gap']:.0f} ms"
            if "gaps" in rows
            else "gaps or jumps"
        )
        return (
            f"the stream of commands has {what}: send from a buffer on a timer of its own, not from the loop that "
            "logs or thinks; calmotion live bridges late samples"
        )


def _spread(error: Array) -> float:
    """A robust variance of a weighted error: most of a recording lies outside gaps."""
    return max(1.0, float((1.4826 * np.median(np.abs(error))) ** 2))


def _drive(situation: Situation, command: Array) -> Drive:
    """Healthy loops under another command than the intended one: gains that are guessed are guessed anew."""
    if not any(joint.guessed for joint in situation.joints):
        return situation.healthy
    return with_guessed_loops(replace(situation, command=command)).healthy


def _largest_jump(situation: Situation) -> float:
    assert situation.sent is not None
    return float(np.abs(situation.sent - situation.command).max())


def _encoder_errors(situation: Situation, left: Array) -> dict[int, tuple[Array, float]]:
    """Errors of the encoders on the grid, moved back by the lag of the loop, and the weight of a step of the grid."""
    found = {}
    for motor, k in situation.encoders.items():
        sensor, weight = situation.sensors[k], situation.weights[k]
        block = situation.blocks[situation.blocks_of[k][0]]
        joint = situation.joints[motor]
        lag = (1.0 - joint.share) * situation.healthy.damping[motor] / joint.gain if joint.gain else 0.0
        signal = np.interp(situation.times + lag, sensor.times, left[block] / weight)
        found[motor] = signal, weight**2 * situation.h * len(sensor.times) / max(np.ptp(sensor.times), 1e-9)
    return found
