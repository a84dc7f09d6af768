"""Backlash and ripple: what moves a joint beside its loop."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from calmotion.arrays import Array

from ..kernels import follow_with_play, oscillate
from ..signals import HEALTHY, Drive
from ..situation import Situation
from .base import AddedExplanation, Columns, Effect, State


class Backlash(AddedExplanation):
    """Play in a gear: the load moves over to the other side where the torque changes its sign."""

    cause = "backlash"
    label = "backlash"
    tells = "push the joint by hand with its motor on: backlash moves without force, a soft loop resists"
    WIDTHS = tuple(np.geomspace(0.001, 0.08, 9))  # [rad]

    def applies(self, situation: Situation) -> bool:
        """Where loads are known: they press teeth to one side."""
        return situation.known

    def effect(self, situation: Situation, state: State, error: Array, start: Effect | None) -> Effect:
        """The widths that fit best, and how much of them encoders see, joint by joint."""
        T, M = situation.command.shape
        found = {} if start is None else {row["path"]: row["value"] for row in start.parameters}
        widths = np.array([found.get(joint.path, 0.0) for joint in situation.joints])
        one = [self._one(situation, state.drive, m, widths[m]) for m in range(M)]
        for _ in range(2):
            for m in range(M):
                left = error - sum((v for k, (_, v) in enumerate(one) if k != m), np.zeros(len(error)))
                widths[m], one[m] = self._best(situation, state, m, left, widths[m])
        keep = [m for m in range(M) if widths[m] > 0.0]
        deviation = sum((one[m][0] for m in keep), np.zeros((3, T, M)))
        rows = tuple(
            {"name": "width", "path": situation.joints[m].path, "value": float(widths[m]), "unit": "rad"} for m in keep
        )
        return Effect(sum((one[m][1] for m in keep), np.zeros(len(error))), deviation, rows, 2 * len(keep))

    def _best(
        self, situation: Situation, state: State, m: int, left: Array, before: float
    ) -> tuple[float, tuple[Array, Array]]:
        rows = situation.fitted
        tried = [0.0, before, *self.WIDTHS] if not before else [0.0, *(before * np.geomspace(0.7, 1.4, 5))]
        best: tuple[float, float] = (np.inf, 0.0)
        for _ in range(2):
            for width in tried:
                effect = self._one(situation, state.drive, m, width, left)
                # a width has to be worth its two parameters
                cost = float(np.sum((left - effect[1])[rows] ** 2)) * (1.0 if width else 0.995)
                best = min(best, (cost, width))
            tried = [] if not best[1] else list(best[1] * np.geomspace(0.77, 1.3, 6))
        return best[1], self._one(situation, state.drive, m, best[1], left)

    def _one(
        self, situation: Situation, drive: Drive, m: int, width: float, left: Array | None = None
    ) -> tuple[Array, Array]:
        """Deviation of a joint, and what sensors show of it."""
        T, M = situation.command.shape
        load, motor = np.zeros((2, 3, T, M))
        if not width:
            return load, np.zeros(len(situation.error))
        joint, (gain, damping) = situation.joints[m], situation.finite(drive)
        gains, own = np.array([gain[m], damping[m], drive.share[m]]), np.zeros((2, 4, T))
        command = np.interp(situation.times - drive.delay[m], situation.times, situation.command[:, m])
        rate = np.gradient(command, situation.h)
        for k, play in enumerate((width, 0.0)):
            follow_with_play(situation.h, command, rate, joint.inertia, joint.load, gains, play, own[k])
        load[:, :, m] = own[0, :3] - own[1, :3]
        load[0, :, m] -= load[0, 0, m]
        motor[0, :, m] = own[0, 3] - own[1, 3]
        outside = situation.of_joints(load, encoders=False)
        inside = situation.of_joints(load) - outside
        seen = situation.of_joints(motor) - situation.of_joints(motor, encoders=False)
        if left is not None and inside.any():
            # an encoder is on the motor's side of the play, or on the load's
            share = Columns((inside - seen)[None], np.array([0.0]), np.array([1.0])).sizes(
                left - seen, situation.fitted
            )
            seen = seen + share[0] * (inside - seen)
        return load, outside + seen

    def remedy(self, situation: Situation, parameters: Sequence[Mapping[str, Any]]) -> str:
        """Preload the gear."""
        if not parameters:
            return "look for play in the gears"
        worst = max(parameters, key=lambda row: row["value"])
        return (
            f"{worst['path']} has {np.degrees(worst['value']):.2g} degrees of backlash: tighten its horn, screws and "
            "gear, preload it with a spring or its weight, and keep its torque from changing sign (its value in "
            "calm:motor:backlash shows the effect)"
        )


class Ripple(AddedExplanation):
    """Ripple of a motor or gear: so many waves a turn, so that its frequency is proportional to the speed."""

    cause = "ripple"
    label = "ripple of a motor or gear"
    tells = "the same motion at half of its speed: the frequency of a ripple halves, that of a resonance stays"
    MOST = 220.0  # waves a turn
    FASTEST = 0.4  # frequency of a wave, of the sampling rate

    def applies(self, situation: Situation) -> bool:
        """Where joints move by more than some waves."""
        return bool(np.ptp(situation.command, axis=0).max(initial=0.0) > 0.2)

    def effect(self, situation: Situation, state: State, error: Array, start: Effect | None) -> Effect:
        """The joint and the number of waves a turn that fit best."""
        motion, best = state.motion, (np.inf, 0, 0.0)
        rows = situation.fitted
        tried = [(m, n) for m in range(len(situation.joints)) for n in self._orders(situation, motion, m)]
        if start is not None and start.parameters:
            row = next(row for row in start.parameters if row["name"] == "waves")
            m = [joint.path for joint in situation.joints].index(row["path"])
            tried = [(m, row["value"] * (1.0 + d)) for d in np.linspace(-0.01, 0.01, 5)]
        for turn in range(2):
            for m, n in tried:
                columns, _ = self._waves(situation, motion, m, n)
                sizes = columns.sizes(error, rows)
                best = min(best, (float(np.sum((error - sizes @ columns.vectors)[rows] ** 2)), m, n))
            _, m, n = best
            near = 1.5 / max(np.ptp(situation.command[:, m]), 0.1)
            tried = [(m, max(n + d, 1.0)) for d in near * np.linspace(-1.0, 1.0, 13)] if not turn else tried
        _, m, n = best
        columns, shapes = self._waves(situation, motion, m, n)
        sizes = columns.sizes(error, rows)
        deviation = np.tensordot(sizes, shapes, 1)
        values = (("waves", n, "a turn"), ("amplitude", float(np.hypot(*sizes)), "rad"))
        parameters = tuple(
            {"name": name, "path": situation.joints[m].path, "value": float(value), "unit": unit}
            for name, value, unit in values
        )
        return Effect(sizes @ columns.vectors, deviation, parameters, 3)

    def _orders(self, situation: Situation, motion: Array, m: int) -> list[float]:
        """Numbers of waves a turn that the motion tells apart and the sensors can follow."""
        turned, fastest = float(np.ptp(motion[0][:, m])), float(np.abs(motion[1][:, m]).max())
        if turned < 0.2:
            return []
        rate = max(1.0 / float(np.median(np.diff(s.times))) for s in situation.sensors)
        most = min(self.MOST, self.FASTEST * min(rate, 250.0) * 2.0 * np.pi / max(fastest, 1e-9))
        step = 2.0 / turned
        lowest = max(8.0, 4.0 * np.pi / turned)  # two waves at least: less of one could be anything
        return list(np.arange(lowest, most, step))[:90]

    def _waves(self, situation: Situation, motion: Array, m: int, n: float) -> tuple[Columns, Array]:
        """Sine and cosine: torques of a loop whose gain is known, else motions of the joint."""
        T, M = situation.command.shape
        angle = n * (motion[0][:, m] - motion[0][0, m])
        waves = np.stack([np.sin(angle), np.cos(angle) - 1.0], axis=1)
        shapes = np.zeros((2, 3, T, M))
        joint = situation.joints[m]
        if joint.gain:
            omega = np.sqrt(joint.gain / joint.inertia)
            own = np.zeros((3, T, 2))
            oscillate(situation.h, np.tile(omega[:, None], (1, 2)), HEALTHY, omega[:, None] ** 2 * waves, own)
            shapes[:, :, :, m] = np.moveaxis(own, 2, 0)
        else:
            rates = np.gradient(waves, situation.h, axis=0)
            for k, part in enumerate((waves, rates, np.gradient(rates, situation.h, axis=0))):
                shapes[:, k, :, m] = part.T
        return Columns(np.stack([situation.of_joints(shape) for shape in shapes])), shapes

    def remedy(self, situation: Situation, parameters: Sequence[Mapping[str, Any]]) -> str:
        """Avoid the speed, or the ripple."""
        rows = {row["name"]: row for row in parameters}
        waves = rows["waves"]
        speed = float(np.percentile(np.abs(situation.rates), 90))
        return (
            f"{waves['path']} has {waves['value']:.3g} waves a turn ({waves['value'] * speed / 6.283:.2g} Hz at "
            f"{speed:.2g} rad/s): check gear teeth, belt and current loop, and avoid the speed at which that meets "
            "a resonance"
        )
