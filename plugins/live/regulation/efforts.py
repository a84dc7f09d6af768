"""Changes of the commands that keep the efforts of the motors within what they have, as far as the motion is known.

With multipliers z of the efforts e <= most and e >= -most at the ticks to come, the regulator's least cost gets terms
z e, and its changes the parts -pulls z. The efforts are then e0 - response z, and the multipliers solve the dual

    greatest  z e0 - z response z / 2 - most |z|.

A share of the response is added to its diagonal: efforts may exceed their limits a little where the commands would
have to leave the intended motion far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.model import ON_ERROR, SERVO, Motor
from calmotion.multibody import PoseModel, unsaturated
from numba import njit


class Intended(Protocol):
    """The intended motion at the ticks of a window (W ticks); see `Window`."""

    rates: Array
    accelerations: Array
    forces: Array
    with_weight: Array


@dataclass(frozen=True, eq=False)
class Efforts:
    """The efforts of A motors in the closed loop of a regulator in a pose, at T ticks of its window or fewer.

    Attributes:
        by_rate, by_acceleration: Of all motors' intended inputs, shape [A, M].
        by_force: Of `VelocityForces`, shape [A, N].
        before, after: Efforts by the states before and after a tick, shape [A, X].
        closed, by_change, by_impulse: Of the state, with the feedback; shapes [X, X], [X, m], [X, S n].
        answer, ahead: Changes by a state that is wanted, [m, X], which impulses want, [X, S n].
        pulls: Change by the multipliers of a tick so many ticks later, shape [T, m, A].
        response: Efforts by multipliers, softened, shape [T A, T A].
    """

    SOFTNESS = 0.2  # of the mean response of an effort to its own multiplier
    LARGEST = 300  # efforts that are looked at: ticks times motors

    by_rate: Array
    by_acceleration: Array
    by_force: Array
    before: Array
    after: Array
    closed: Array
    by_change: Array
    by_impulse: Array
    answer: Array
    ahead: Array
    pulls: Array
    response: Array

    @classmethod
    def of(
        cls, pose: PoseModel, rates: Array, tick: float, limited: BoolArray, loop: tuple[Array, ...], window: int
    ) -> Efforts:
        """Of a regulator in a pose.

        Args:
            rates: Those of the inputs and amplitudes in the state, shape [M + n, X].
            limited: Motors whose efforts have limits, shape [M].
            loop: `closed` to `ahead`, as above.
        """
        closed, by_change, by_impulse, answer, ahead = loop
        inertia = np.concatenate([pose.inertia, -pose.by_acceleration.T], axis=1)[limited]
        before = -inertia @ rates / tick
        after = pose.resistance[limited] @ rates - before
        count = len(before)
        ticks = max(min(window, cls.LARGEST // count), 1)
        wanted, moved = after.T, by_change
        pulls, moves = [answer @ wanted], [after @ moved]
        wanted, strikes = closed.T @ after.T + before.T, after @ closed + before
        for _ in range(1, ticks):
            pulls.append(answer @ wanted)
            moves.append(strikes @ moved)
            wanted, moved = closed.T @ wanted, closed @ moved
        found, pulled = np.zeros((ticks, count, ticks, count)), np.array(pulls)
        for k, move in enumerate(moves):
            row = (move @ pulled).transpose(1, 0, 2)
            found[k] = row
            if k:
                found[k, :, 1:] += found[k - 1, :, :-1]
        response = found.reshape(ticks * count, -1)
        response[np.diag_indices_from(response)] += cls.SOFTNESS * np.trace(response) / len(response)
        motors = len(pose.inertia)
        return cls(
            pose.resistance[limited, :motors], inertia[:, :motors], pose.by_input.T[limited], before, after,
            closed, by_change, by_impulse, answer, ahead, pulled, response,
        )  # fmt: skip


class EffortLimits:
    """Keeps efforts while commands are found.

    Args:
        motors: All of them.
        tick: [s].
        known: Whether `VelocityForces` are; else no effort is.

    Attributes:
        limited: Motors whose efforts have limits, shape [M].
        needed: Efforts of the last tick over what the motors have, shape [M].
        acted: Motors whose effort was held in the last tick, shape [M].
        lead: By how much commands lead, since a servo near its largest torque gives less than its controller wants [rad
            or m], shape [M].
    """

    SHARE = 0.99  # of the largest effort, that is used
    BEYOND_REST = 0.05  # the same beyond what a pose at rest needs, where that is more
    LONGEST_S = 20.0  # that is counted as held
    PATIENCE_S = 1.0  # for which a motor is held; then what it may exert grows by its largest effort in such a time

    def __init__(self, motors: Sequence[Motor], tick: float, known: bool):
        most = np.array([motor.max_torque for motor in motors], float)
        self.limited: BoolArray = np.isfinite(most) & known
        self._most, self._tick = most[self.limited], tick
        chosen = [motor for motor, limited in zip(motors, self.limited, strict=True) if limited]
        servos = np.array([motor.model == SERVO and motor.position_gain > 0.0 for motor in chosen], bool)
        gains = np.array([motor.position_gain for motor in chosen])
        lag = np.array([motor.velocity_gain * (motor.damping_on == ON_ERROR) for motor in chosen])
        self._gives = np.divide(self._most, gains, out=np.zeros(len(chosen)), where=servos)
        self._follows = tick / (2.0 * tick + np.divide(lag, gains, out=np.zeros(len(chosen)), where=servos))
        self.begin()

    def begin(self) -> None:
        """Rest."""
        self._multipliers, self._held_s = np.zeros((1, len(self._most))), np.zeros(len(self._most))
        self.needed, self.lead, self.acted = *np.zeros((2, len(self.limited))), np.zeros(len(self.limited), bool)

    def pull(self, efforts: Efforts, x: Array, impulses: Array, window: Intended, holds: bool) -> Array:
        """The part of the change of rates that keeps the efforts, shape [m]; sets `lead` for the next tick.

        Args:
            x: State of the regulator, shape [X].
            impulses: Of the window, shape [W, S n].
            window: What is intended.
            holds: Whether efforts are held; else they are looked at alone.
        """
        ticks, count = len(efforts.pulls), len(self._most)
        rest = (window.with_weight[:ticks] - window.forces[:ticks]) @ efforts.by_force.T
        moving = window.accelerations[:ticks] @ efforts.by_acceleration.T + window.rates[:ticks] @ efforts.by_rate.T
        self._known = moving + window.with_weight[:ticks] @ efforts.by_force.T
        free = efforts_ahead(
            efforts.closed, efforts.by_change, efforts.by_impulse, efforts.answer, efforts.ahead, efforts.before,
            efforts.after, x, impulses, self._known,
        )  # fmt: skip
        most = np.maximum(self.SHARE * self._most, np.abs(rest) + self.BEYOND_REST * self._most)
        most += np.maximum(self._held_s / self.PATIENCE_S - 1.0, 0.0) * self._most
        held = free
        start = np.zeros((ticks, count))
        if holds and np.any(np.abs(free) > most):
            kept = self._multipliers[1 : ticks + 1]
            start[: len(kept)] = kept
            start = multipliers(efforts.response, free.ravel(), most.ravel(), start.ravel()).reshape(ticks, count)
            held = free - (efforts.response @ start.ravel()).reshape(ticks, count)
        self._multipliers = start
        held_s = self._held_s + np.where(np.any(start != 0.0, axis=0), self._tick, -self._tick)
        self._held_s = np.clip(held_s, 0.0, self.LONGEST_S)
        self.acted[self.limited] = start[0] != 0.0
        at = min(1, ticks - 1)
        shares = np.clip(np.stack([held[at], rest[at]]) / self._most, -self.SHARE, self.SHARE)
        wanted, of_rest = self._gives * (unsaturated(shares) - shares)
        self.lead[self.limited] += self._follows * (wanted - of_rest - self.lead[self.limited])
        return np.asarray(np.einsum("kma,ka->m", efforts.pulls, start))

    def tell(self, efforts: Efforts, before: Array, after: Array) -> None:
        """Keep what the last tick needs, with the states before and after it."""
        exerted = efforts.after @ after + efforts.before @ before + self._known[0]
        self.needed[self.limited] = np.abs(exerted) / self._most


@njit(cache=True)  # type: ignore[untyped-decorator]
def efforts_ahead(
    closed: Array, by_change: Array, by_impulse: Array, answer: Array, ahead: Array, before: Array, after: Array,
    x: Array, impulses: Array, known: Array,
) -> Array:  # fmt: skip
    """The efforts at T ticks of the window, shape [T, A], without multipliers.

    Args:
        x: State at the first one.
        impulses: Of the window, shape [W, S n].
        known: Efforts of the intended motion, shape [T, A].
    """
    ticks = len(known)
    changes, found = np.zeros((ticks, len(answer))), np.zeros_like(known)
    wanted, back = np.zeros(len(x)), closed.T
    for k in range(len(impulses) - 1, -1, -1):
        value = ahead @ impulses[k] + wanted
        if k < ticks:
            changes[k] = answer @ value
        wanted = back @ value
    for k in range(ticks):
        moved = closed @ x - by_change @ changes[k] + by_impulse @ impulses[k]
        found[k] = after @ moved + before @ x + known[k]
        x = moved
    return found


def multipliers(response: Array, free: Array, most: Array, start: Array) -> Array:
    """The multipliers of efforts, shape [N]: greatest z free - z response z / 2 - most |z|, as far as a tick allows.

    By an active set whose signs are tried and corrected, which never gets worse (Lee, Battle, Raina, Ng, Efficient
    sparse coding algorithms, 2006).

    Args:
        response: Efforts by multipliers, shape [N, N].
        free: Efforts without them, shape [N].
        most: Their largest sizes, shape [N].
        start: Multipliers from which they are looked for.
    """
    turns, most_active, rounding = 16, 120, 1e-9

    def worth(z: Array) -> Array:
        """Of rows, shape [R, N]."""
        return np.asarray(z @ free - 0.5 * np.sum(z @ response * z, axis=1) - np.abs(z) @ most)

    found = start if worth(start[None])[0] > 0.0 else np.zeros_like(free)
    signs, several = np.sign(found), True
    for _ in range(turns):
        active = np.flatnonzero(signs)
        aim = np.zeros_like(free)
        if len(active):
            aim[active] = np.linalg.solve(response[np.ix_(active, active)], free[active] - signs[active] * most[active])
        turned = active[aim[active] * signs[active] < 0.0]
        if len(turned):
            steps = found[turned] / (found[turned] - aim[turned])
            tried = found + np.append(steps, 1.0)[:, None] * (aim - found)
            tried[np.arange(len(turned)), turned] = 0.0
            worths = worth(tried)
            several = several and worths.max() > worth(found[None])[0]
            found = tried[worths.argmax()]
            signs = np.sign(found)
            continue
        found = aim
        left = free - response @ found
        beyond = np.where(signs == 0.0, np.abs(left) - most, 0.0)
        added = np.flatnonzero(beyond > rounding * most)[: max(most_active - len(active), 0)]
        if not len(added):
            break
        if not several:
            added, several = np.array([beyond.argmax()]), True
        signs[added] = np.sign(left[added])
    return found
