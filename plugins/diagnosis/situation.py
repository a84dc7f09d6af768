"""What was commanded and recorded, on one clock, and what a healthy robot would have done."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.recordings import ACCELEROMETER, ANGLE, MARKER
from scipy.ndimage import uniform_filter1d

from .kernels import follow
from .mechanics import FlexibleRobot, Mechanics
from .signals import HEALTHY, STRIBECK, Drive, Joint, Sensor, on_grid

CLOSED = (
    "joints close chains or move freely: inertias and loads are not known, so that links, base and backlash cannot be "
    "told from other causes"
)


@dataclass(frozen=True, eq=False)
class Situation:
    """A motion that was commanded, what was recorded of it, and the model of the robot, where there is one.

    Attributes:
        h: Step of the grid [s]; its first instant is 0.
        command: Intended, shape [T, M].
        sent: As it was sent, where that differs, shape [T, M].
        near: Motion along which the mechanics are, shape [T, M].
        joints: M of them.
        sensors: What was recorded.
        mechanics: The rigid robot; None without a model.
        flexible: The robot with its links; None where none bends.
        known: Whether inertias and loads are known.
        notes: What was noticed on the way here.
    """

    STIFF = 25.0  # frequency of a loop of which nothing is known [Hz]
    POSES = 200  # in which the inertia about the foot is taken
    SLOW = 0.3  # time over which velocities from accelerometers are averaged to find what is slow [s]
    PIECE = 0.4  # length of the pieces, of which every third is held out [s]
    # what a model of a real robot leaves unexplained, of the standard deviation of the signal
    FLOOR = {ANGLE: 0.002, MARKER: 0.002, ACCELEROMETER: 0.02}

    h: float
    command: Array
    sent: Array | None
    near: Array
    joints: tuple[Joint, ...]
    sensors: tuple[Sensor, ...]
    mechanics: Mechanics | None = None
    flexible: FlexibleRobot | None = None
    known: bool = True
    notes: tuple[str, ...] = ()
    _held: dict[str, Array] = field(default_factory=dict, repr=False)

    @property
    def times(self) -> Array:
        """Of the grid [s], shape [T]."""
        return np.asarray(self.h * np.arange(len(self.command)), float)

    @cached_property
    def rates(self) -> Array:
        """Of the intended command, shape [T, M]."""
        return np.gradient(self.command, self.h, axis=0)

    @cached_property
    def encoders(self) -> dict[int, int]:
        """Number of the sensor that reads a motor's joint, by motor."""
        return {s.index: k for k, s in enumerate(self.sensors) if s.kind == ANGLE and s.index >= 0}

    @cached_property
    def healthy(self) -> Drive:
        """Loops of the gains that are known, damped so that they do not ring, without friction and delay. What is
        damped more multiplies the command's rate, too, so that a loop lags as the shot's own does."""
        gain = np.array([joint.gain or np.inf for joint in self.joints])
        damping = np.array([max(j.damping, HEALTHY * j.critical(j.gain)) for j in self.joints])
        on_joint = [(1.0 - j.share) * j.damping for j in self.joints]
        share = 1.0 - np.divide(on_joint, damping, out=np.ones(len(gain)), where=damping > 0.0)
        none = np.zeros(len(gain))
        return Drive(gain, damping, share, none, none, none)

    def moved(self, drive: Drive, command: Array | None = None, only: int | None = None) -> Array:
        """Motion of the joints: values, rates and accelerations, shape [3, T, M], or of one of them, [3, T, 1]."""
        command = self.command if command is None else command
        which = range(len(self.joints)) if only is None else (only,)
        out = np.zeros((3, len(command), len(which)))
        for column, m in enumerate(which):
            joint = self.joints[m]
            own = command[:, m]
            if drive.delay[m]:
                own = np.interp(self.times - drive.delay[m], self.times, own)
            rate = np.gradient(own, self.h)
            if not np.isfinite(drive.gain[m]):
                out[:, :, column] = own, rate, np.gradient(rate, self.h)
                continue
            gains = np.array(
                [drive.gain[m], drive.damping[m], drive.share[m], drive.friction[m], drive.excess[m], STRIBECK]
            )
            one = np.zeros((3, len(own)))
            follow(
                self.h,
                np.ascontiguousarray(own),
                rate,
                joint.inertia,
                joint.load,
                joint.slope,
                self.near[:, m].copy(),
                gains,
                one,
            )
            out[:, :, column] = one
        return out

    def finite(self, drive: Drive) -> tuple[Array, Array]:
        """Gains and dampings, shape [M] each; those of a loop of `STIFF` Hz where a joint follows exactly."""
        stiff = [(2.0 * np.pi * self.STIFF) ** 2 * joint.middle for joint in self.joints]
        gain = np.where(np.isfinite(drive.gain), drive.gain, stiff)
        firm = np.array([HEALTHY * j.critical(g) for j, g in zip(self.joints, stiff, strict=True)])
        return gain, np.where(np.isfinite(drive.gain), drive.damping, firm)

    def equivalent(self, motion: Array, drive: Drive) -> Array:
        """The commands under which loops without friction would move as the joints do, shape [T, M]."""
        none = np.zeros(len(self.joints))
        linear = replace(drive, friction=none, excess=none)
        rest = motion - self.moved(linear)
        gain, damping = self.finite(drive)
        inertia = np.stack([joint.inertia for joint in self.joints], axis=1)
        more = rest[0] + np.where(np.isfinite(drive.gain), (inertia * rest[2] + damping * rest[1]) / gain, 0.0)
        late = [np.interp(self.times - d, self.times, c) for d, c in zip(drive.delay, self.command.T, strict=True)]
        return np.asarray(np.stack(late, axis=1) + more)

    @cached_property
    def motion(self) -> Array:
        """Of the joints of a healthy robot, shape [3, T, M]."""
        return self.moved(self.healthy)

    @cached_property
    def _grid(self) -> dict[str, Array]:
        """Quantities of the rigid robot on the grid."""
        mechanics = self.mechanics
        assert mechanics is not None
        names = ("levers", "turns", "axes", "positions", "felt")
        found = {name: on_grid(self.times, mechanics.times, getattr(mechanics, name)) for name in names}
        found["slide"] = np.gradient(found["levers"], self.h, axis=0)
        return found

    def of_joints(self, deviation: Array, encoders: bool = True) -> Array:
        """What the sensors show of a deviation of the joints, shape [3, T, M], as a weighted vector.

        Args:
            encoders: Whether encoders see it.
        """
        rows: list[Array | None] = []
        for sensor in self.sensors:
            if sensor.index < 0 or (sensor.kind == ANGLE and not encoders):
                rows.append(None)
            elif sensor.kind == ANGLE:
                rows.append(deviation[0][:, sensor.index, None])
            elif self.mechanics is None:
                rows.append(None)
            else:
                grid, k = self._grid, sensor.index
                L, S, W = (grid[name][:, k] for name in ("levers", "slide", "turns"))
                x, turn = np.einsum("tim,tm->ti", L, deviation[0]), np.einsum("tim,tm->ti", W, deviation[0])
                a = np.einsum("tim,tm->ti", L, deviation[2]) + 2.0 * np.einsum("tim,tm->ti", S, deviation[1])
                rows.append(self.at_target(sensor, x, a, turn))
        return self.vector(rows)

    def at_target(self, sensor: Sensor, moved: Array, accelerated: Array, turned: Array) -> Array:
        """What a sensor at a target shows of its displacement, the second derivative of that, and its turn, world."""
        if sensor.kind == MARKER:
            return moved
        grid, k = self._grid, sensor.index
        felt = accelerated - np.cross(turned, grid["felt"][:, k])
        return np.asarray(np.einsum("tji,tj->ti", grid["axes"][:, k], felt))

    def vector(self, rows: Sequence[Array | None]) -> Array:
        """Signals on the grid, shape [T, c] for each sensor, at its samples, weighted, as one vector."""
        parts = []
        for sensor, row, weight in zip(self.sensors, rows, self.weights, strict=True):
            if row is None:
                parts.append(np.zeros(sensor.values.size))
                continue
            row = row if row.shape[1] == 1 else row[:, list(sensor.components)]
            at = np.clip(sensor.times / self.h, 0.0, len(self.command) - 1.000001)
            first = at.astype(int)
            share = (at - first)[:, None]
            sampled = (1.0 - share) * row[first] + share * row[first + 1]
            parts.append(weight * self.processed(sensor, sampled).T.ravel())
        return np.concatenate(parts)

    @cached_property
    def blocks(self) -> list[slice]:
        """Of each component of each sensor in the vector."""
        found, start = [], 0
        for sensor in self.sensors:
            for _ in range(sensor.values.shape[1]):
                found.append(slice(start, start + len(sensor.times)))
                start += len(sensor.times)
        return found

    @cached_property
    def blocks_of(self) -> list[list[int]]:
        """Blocks of each sensor."""
        counts = np.cumsum([0, *(sensor.values.shape[1] for sensor in self.sensors)])
        return [list(range(counts[k], counts[k + 1])) for k in range(len(self.sensors))]

    def processed(self, sensor: Sensor, rows: Array) -> Array:
        """Samples as they are compared, shape [n, c]: less their mean, since offsets tell nothing; accelerations
        integrated to velocities without what is slow, as knocks come some milliseconds earlier or later than a model
        says, and gravity turns in a sensor whose link sags."""
        if sensor.kind == ACCELEROMETER:
            period = np.ptp(sensor.times) / max(len(sensor.times) - 1, 1)
            width = max(1, round(self.SLOW / period))
            rows = np.cumsum(rows - rows.mean(axis=0), axis=0) * period
            rows = rows - uniform_filter1d(uniform_filter1d(rows, width, axis=0), width, axis=0)
        return np.asarray(rows - rows.mean(axis=0))

    @cached_property
    def noises(self) -> list[float]:
        """Standard deviation of the noise of the samples that are compared."""
        periods = [np.ptp(s.times) / max(len(s.times) - 1, 1) for s in self.sensors]
        return [
            s.noise * (np.sqrt(0.5 * self.SLOW * h) if s.kind == ACCELEROMETER else 1.0)
            for s, h in zip(self.sensors, periods, strict=True)
        ]

    @cached_property
    def weights(self) -> list[float]:
        """One over the noise, and what models leave unexplained, of each sensor."""
        found = []
        for sensor, noise in zip(self.sensors, self.noises, strict=True):
            spread = float(np.sqrt(np.mean(np.var(self.processed(sensor, sensor.values), axis=0))))
            found.append(1.0 / max(np.hypot(noise, self.FLOOR[sensor.kind] * spread), 1e-12))
        return found

    @cached_property
    def fitted(self) -> BoolArray:
        """Samples that are fitted; the others are held out."""
        rows = [np.tile((s.times / self.PIECE).astype(int) % 3 != 1, s.values.shape[1]) for s in self.sensors]
        return np.concatenate(rows)

    @cached_property
    def error(self) -> Array:
        """The recordings less what the healthy robot would have shown, as a weighted vector."""
        parts = [w * self.processed(s, s.values).T.ravel() for s, w in zip(self.sensors, self.weights, strict=True)]
        measured = np.concatenate(parts)
        rows: list[Array | None] = []
        for sensor in self.sensors:
            if sensor.index < 0:
                rows.append(None)
            elif sensor.kind == ANGLE:
                rows.append(self.near[:, sensor.index, None])
            elif self.mechanics is None:
                rows.append(None)
            elif sensor.kind == MARKER:
                rows.append(self._grid["positions"][:, sensor.index])
            else:
                k = sensor.index
                rows.append(np.einsum("tji,tj->ti", self._grid["axes"][:, k], self._grid["felt"][:, k]))
        rates = np.gradient(self.near, self.h, axis=0)
        near = np.stack([self.near, rates, np.gradient(rates, self.h, axis=0)])
        return measured - self.vector(rows) - self.of_joints(self.motion - near)

    def axes(self, target: int) -> Array:
        """Rotation matrices of a target, shape [T, 3, 3]."""
        return self._grid["axes"][:, target]

    def from_foot(self, target: int) -> Array:
        """A target's place from the robot's foot, world [m], shape [T, 3]."""
        assert self.mechanics is not None
        return np.asarray(self._grid["positions"][:, target] - self.mechanics.foot)

    @cached_property
    def rocking(self) -> tuple[Array, Array, Array, Array]:
        """Two level axes, shape [2, 3], times of poses, shape [P], inertia about the axes in these, shape [P, 2, 2],
        and what turns the foot about them, shape [T, 2]."""
        mechanics = self.mechanics
        assert mechanics is not None
        up = -mechanics.gravity if np.any(mechanics.gravity) else np.array([0.0, 0.0, 1.0])
        first = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
        axes = np.stack([first, np.cross(up, first)])
        axes = axes / np.linalg.norm(axes, axis=1)[:, None]
        some = slice(None, None, max(1, len(mechanics.times) // self.POSES))
        inertia = np.einsum("tij,ai,bj->tab", mechanics.mass[some], axes, axes)
        return axes, mechanics.times[some], inertia, on_grid(self.times, mechanics.times, mechanics.pushes @ axes.T)
