"""Links and base: what swings although its joints do as they should."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from calmotion.arrays import Array
from calmotion.recordings import ANGLE
from scipy.linalg import eigh
from scipy.optimize import least_squares

from ..kernels import march
from ..signals import Drive, at_places, on_grid
from ..situation import Situation
from .base import AddedExplanation, Columns, Effect, Parameter, State


class Structure(AddedExplanation):
    """Oscillators that the motion drives: frequencies and damping are searched, sizes fitted within bounds."""

    SEARCH: ClassVar[dict[str, Any]] = {"max_nfev": 10, "diff_step": 1e-3, "xtol": 1e-3, "ftol": 1e-4}

    def applies(self, situation: Situation) -> bool:
        """Where there are a model and a sensor at a target."""
        return situation.mechanics is not None and any(s.kind != ANGLE and s.index >= 0 for s in situation.sensors)

    def parameters(self, situation: Situation) -> tuple[Parameter, ...]:
        """What is free."""
        raise NotImplementedError

    def columns(self, situation: Situation, state: State, values: Array) -> Columns:
        """What the sensors show, by size."""
        raise NotImplementedError

    def rows(self, situation: Situation, values: Array, sizes: Array) -> tuple[dict[str, Any], ...]:
        """What is reported."""
        raise NotImplementedError

    def effect(self, situation: Situation, state: State, error: Array, start: Effect | None) -> Effect:
        """The frequencies and damping that fit best."""
        parameters, keep = self.parameters(situation), situation.fitted
        scale = max(float(np.sqrt(np.mean(error[keep] ** 2))), 1e-9)
        heavy = np.sqrt(len(situation.times) * situation.h)  # a prior counts as a second of samples does

        def left(x: Array) -> Array:
            columns = self.columns(situation, state, _values(parameters, x))
            rest = error - columns.sizes(error, keep) @ columns.vectors
            prior = [(v - p.scaled(p.starts[0])) / p.spread for v, p in zip(x, parameters, strict=True)]
            return np.concatenate([rest[keep] / (scale * np.sqrt(keep.sum())), np.array(prior) * 0.05 / heavy])

        low, high = (np.array([p.scaled(getattr(p, side)) for p in parameters]) for side in ("low", "high"))
        best = None
        for x in self._starts(parameters, start):
            found = least_squares(left, np.clip(x, low + 1e-9, high - 1e-9), bounds=(low, high), **self.SEARCH)
            best = found if best is None or found.cost < best.cost else best
        assert best is not None
        values = _values(parameters, best.x)
        columns = self.columns(situation, state, values)
        sizes = columns.sizes(error, keep)
        reported = self.rows(situation, values, sizes)
        return Effect(sizes @ columns.vectors, None, reported, len(parameters) + len(sizes), best.x)

    def _starts(self, parameters: Sequence[Parameter], start: Effect | None) -> list[Array]:
        if start is not None and start.found is not None:
            return [start.found]
        count = max(len(p.starts) for p in parameters)
        return [np.array([p.scaled(p.starts[min(k, len(p.starts) - 1)]) for p in parameters]) for k in range(count)]

    def at_targets(
        self, situation: Situation, shown: Mapping[int, tuple[Array, Array, Array]], joints: Array | None = None
    ) -> Array:
        """The vector of what targets do: displacement, its second derivative, turn by number of the target; and of
        deviations of the joints, shape [T, M]."""
        rows: list[Array | None] = []
        for sensor in situation.sensors:
            if sensor.index < 0 or (sensor.kind == ANGLE and joints is None):
                rows.append(None)
            elif sensor.kind == ANGLE:
                assert joints is not None
                rows.append(joints[:, sensor.index, None])
            else:
                rows.append(situation.at_target(sensor, *shown[sensor.index]))
        return situation.vector(rows)


def _values(parameters: Sequence[Parameter], x: Array) -> Array:
    return np.array([p.value(float(v)) for p, v in zip(parameters, x, strict=True)])


class Links(Structure):
    """Links that bend: the modes of the model, with frequencies and damping that may differ from it."""

    cause = "links"
    label = "the flexible links"
    tells = (
        "an accelerometer at the hand and one at the last joint's housing: links swing between them, a base moves both"
    )
    COARSER = 2  # steps of the grid in one of the simulation
    SIZES = (0.7, 1.4)  # of the links' effect, of that of the model

    def applies(self, situation: Situation) -> bool:
        """Where the model has flexible links."""
        return super().applies(situation) and situation.flexible is not None

    def parameters(self, situation: Situation) -> tuple[Parameter, ...]:
        """A factor of the frequencies of the links alone, and a factor of their damping."""
        factors = (1.0, 0.86, 1.17)
        return (
            Parameter("factor", "", factors, 0.6, 1.6, 0.1, True),
            Parameter("damping_factor", "", (1.0, 1.0, 1.0), 0.1, 20.0, 1.0, True),
        )

    def columns(self, situation: Situation, state: State, values: Array) -> Columns:
        """What the flexible robot does beyond the rigid one, under the same commands."""
        if not state.kept:
            command = situation.equivalent(state.motion, state.drive)
            state.kept.update(command=command, rigid=self._run(situation, state.drive, command, np.ones(2), False))
        rigid = state.kept["rigid"]
        flexible = self._run(situation, state.drive, state.kept["command"], values, True)
        shown = {
            k: tuple(one - other for one, other in zip(flexible[0][k], rigid[0][k], strict=True)) for k in flexible[0]
        }
        low, high = self.SIZES
        return Columns(
            self.at_targets(situation, shown, flexible[1] - rigid[1])[None], np.array([low]), np.array([high])
        )

    def _run(
        self, situation: Situation, drive: Drive, command: Array, values: Array, bends: bool
    ) -> tuple[dict[int, tuple[Array, Array, Array]], Array]:
        """Motion of the targets, and deviations of the joints, shape [T, M]."""
        robot, h = situation.flexible, situation.h
        assert robot is not None
        M = command.shape[1]
        moves = np.flatnonzero(np.isfinite(drive.gain))  # the loops of the others do not give
        free = np.concatenate([moves, np.arange(M, robot.mass.shape[1] if bends else M)])
        both = np.ix_(np.arange(len(robot.mass)), free, free)
        K, C = float(values[0]) ** 2 * robot.stiffness[both], float(values[1]) * robot.damping[both]
        loops = np.arange(len(moves))
        K[:, loops, loops] += drive.gain[moves]
        C[:, loops, loops] += drive.damping[moves]
        place = robot.place
        rates = np.gradient(command, h, axis=0)
        push = at_places(place, robot.by_acceleration[:, free])
        force = np.einsum("tnm,tm->tn", push, np.gradient(rates, h, axis=0))
        force[:, loops] += (rates * drive.damping * (1.0 - drive.share))[:, moves]
        force += on_grid(situation.times, robot.pushed, robot.pushes[:, free])
        some = slice(None, None, self.COARSER)
        coarse = np.zeros((3, len(place[some]), len(free)))
        coarse[0, 0] = np.linalg.solve(K[0], force[0])
        mass = robot.mass[both]
        K += _lowered(mass, K, self.COARSER * h)
        arrays = (np.ascontiguousarray(part) for part in (place[some], mass, C, K, force[some]))
        march(self.COARSER * h, *arrays, coarse)
        between = np.arange(len(command)) / self.COARSER
        y = np.stack([at_places(between, part) for part in coarse])
        shown = {}
        for index in {s.index for s in situation.sensors if s.kind != ANGLE and s.index >= 0}:
            by = at_places(place, robot.targets[:, index][:, :, free])
            moved, felt = np.einsum("tin,tn->ti", by, y[0]), np.einsum("tin,tn->ti", by[:, :3], y[2])
            shown[index] = moved[:, :3], felt, np.einsum("tij,tj->ti", situation.axes(index), moved[:, 3:])
        joints = np.zeros_like(command)
        joints[:, moves] = -y[0][:, loops]
        return shown, joints

    def rows(self, situation: Situation, values: Array, sizes: Array) -> tuple[dict[str, Any], ...]:
        """The lowest frequency, and the rest."""
        assert situation.flexible is not None
        lowest = situation.flexible.lowest(situation.healthy.gain, float(values[0]))
        named = (
            ("frequency", lowest, "Hz"),
            ("factor", values[0], "of the model"),
            ("damping_factor", values[1], "of the model"),
        )
        return tuple({"name": n, "path": "", "value": float(v), "unit": u} for n, v, u in named)

    def remedy(self, situation: Situation, parameters: Sequence[Mapping[str, Any]]) -> str:
        """Optimise."""
        rows = {row["name"]: row["value"] for row in parameters}
        told = f"the links swing at {rows['frequency']:.3g} Hz"
        if abs(rows["factor"] - 1.0) <= 0.03:
            return f"{told}: run calmotion optimize, whose curves do not make them swing"
        return (
            f"{told}, {rows['factor']:.3g} times the frequency of the model: run calmotion calibrate, then calmotion "
            "optimize, whose curves do not make them swing"
        )


def _lowered(M: Array, K: Array, h: float) -> Array:
    """What raises the modes below a tenth of the step's rate by as much as the midpoint rule lowers them: a frequency
    w to 2/h atan(w h/2); mass and stiffness of shape [P, n, n]."""
    out = np.zeros_like(K)
    for added, mass, stiffness in zip(out, M, K, strict=True):
        squares, modes = eigh(stiffness, mass) if len(mass) else (np.zeros(0), mass)
        low = np.sqrt(np.maximum(squares, 0.0)) * h < 0.2 * np.pi
        momenta = mass @ modes[:, low]
        added += h**2 / 6.0 * (momenta * squares[low] ** 2) @ momenta.T
    return out


class Base(Structure):
    """A base that rocks: the whole robot turns about its foot, slower the farther it reaches."""

    cause = "base"
    label = "the base or its support"
    tells = "an accelerometer on the base itself, or the motion repeated with the base clamped to a heavy table"
    SIZES = (0.2, 1.3)  # of the rocking, of that of a base without mass

    def parameters(self, situation: Situation) -> tuple[Parameter, ...]:
        """A frequency for each of both level axes, by the largest inertia about one, and a damping ratio."""
        starts = (6.0, 3.5, 10.0)
        own = tuple(Parameter(name, "Hz", starts, 0.8, 40.0, np.inf, True) for name in ("first", "second"))
        return (*own, Parameter("damping", "of critical", (0.05,), 0.002, 0.5, 1.0, True))

    def columns(self, situation: Situation, state: State, values: Array) -> Columns:
        """Rocking about two level axes through the foot."""
        axes, times, inertia, pushes = situation.rocking
        stiffness = (2.0 * np.pi * values[:2]) ** 2 * np.linalg.eigvalsh(inertia).max()
        damping = 2.0 * values[2] * stiffness / (2.0 * np.pi * values[:2])
        place = np.interp(situation.times, times, np.arange(len(times)))
        a = np.zeros((3, *pushes.shape))
        K, C = (np.tile(np.diag(part), (len(times), 1, 1)) for part in (stiffness, damping))
        march(situation.h, place, *(np.ascontiguousarray(part) for part in (inertia, C, K, pushes)), a)
        turned, accelerated = a[0] @ axes, a[2] @ axes
        shown = {}
        for sensor in situation.sensors:
            if sensor.kind != ANGLE and sensor.index >= 0:
                arm = situation.from_foot(sensor.index)
                shown[sensor.index] = np.cross(turned, arm), np.cross(accelerated, arm), turned
        return Columns(self.at_targets(situation, shown)[None], np.array([self.SIZES[0]]), np.array([self.SIZES[1]]))

    def rows(self, situation: Situation, values: Array, sizes: Array) -> tuple[dict[str, Any], ...]:
        """The frequencies."""
        named = (
            ("frequency_1", values[0], "Hz"),
            ("frequency_2", values[1], "Hz"),
            ("damping", values[2], "of critical"),
        )
        return tuple({"name": n, "path": "", "value": float(v), "unit": u} for n, v, u in named)

    def remedy(self, situation: Situation, parameters: Sequence[Mapping[str, Any]]) -> str:
        """Clamp it."""
        told = " and ".join(f"{row['value']:.2g} Hz" for row in parameters if row["name"].startswith("frequency"))
        return (
            f"the base rocks at {told}: tighten its screws, clamp it to something heavy, or put it on feet that do not "
            "give; else model it as a body on a joint with a drive, and calmotion optimize accounts for it"
        )
