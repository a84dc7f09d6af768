"""Commands of a motor controller: what is to be commanded, what a file holds, and how its player interpolates it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Motor

HOLD, LINEAR, CUBIC, QUINTIC, BEZIER, FOLLOW = "hold", "linear", "cubic", "quintic", "bezier", "follow"
LOWEST_RATE, HIGHEST_RATE = 1.0, 1e5  # commands a second [Hz]
INTERPOLATIONS: dict[str, tuple[str, ...]] = {  # with what a player needs beside times and positions
    HOLD: (),
    LINEAR: (),
    CUBIC: ("velocities",),
    QUINTIC: ("velocities", "accelerations"),
    BEZIER: ("handles",),
    FOLLOW: ("follower",),
}
# A held value is a step, which no motor can follow: it gets there at constant speed within this time, or within a
# period where that is shorter [s]. Steps of splines are played within the same time.
SETTLED = 0.01


@dataclass(frozen=True)
class ExportRequest:
    """What the user wants to export.

    Attributes:
        format: Name of the format.
        rate: Commands a second [Hz].
        file: File to write.
    """

    format: str
    rate: float
    file: str


@dataclass(frozen=True, eq=False)
class MotorCurves:
    """The curves of all motors (M), to be sampled at any time.

    Attributes:
        shot: Name of the shot's file.
        end: Length of the shot [s].
        cyclic: Whether it loops.
        motors: The motors.
        names: Names of their joints as a controller knows them.
        limits: Lower and upper limit of each joint [rad or m], shape [M, 2]; infinite where there is none.
        sample: Times within the shot [s], shape [n], and the order of the derivative -> [rad or m, s], shape [n, M].
    """

    shot: str
    end: float
    cyclic: bool
    motors: tuple[Motor, ...]
    names: tuple[str, ...]
    limits: Array
    sample: Callable[[Array, int], Array]

    def at(self, times: Array, order: int = 0) -> Array:
        """The same at any time: a shot that loops goes on, any other holds its last pose, at rest."""
        times = np.asarray(times, np.float64)
        if self.cyclic:
            inside = np.mod(times, self.end)
            values = self.sample(inside, order)
            if order == 0:
                ends = self.sample(np.array([0.0, self.end]), 0)
                values = values + np.floor(times / self.end)[:, None] * (ends[1] - ends[0])
            return values
        values = self.sample(np.clip(times, 0.0, self.end), order)
        return values if order == 0 else np.where((times <= self.end + 1e-9)[:, None], values, 0.0)


@dataclass(frozen=True)
class Follower:
    """How a controller follows the commands that it holds: acceleration = gain (command - q - lookahead velocity).

    Attributes:
        gain: [1/s^2].
        lookahead: [s]; also how much later than its commands a motor at constant speed is.
    """

    gain: float
    lookahead: float


@dataclass(frozen=True, eq=False)
class Commands:
    """Commands for M motors at n instants, in the order of the curves' motors; SI units.

    Attributes:
        interpolation: How the player gets from one to the next, one of `INTERPOLATIONS`; `CUBIC` needs velocities,
            `QUINTIC` accelerations as well, `BEZIER` handles and `FOLLOW` a follower.
        times: [s] after the start, increasing, first 0, shape [n].
        positions: [rad or m], shape [n, M].
        velocities, accelerations: The derivatives, shape [n, M]; None where the format has none.
        start: Pose from which a player that holds its commands sets out, shape [M]; None: the first of them.
        handles: Of cubic Bezier curves between the commands: time and value of the control point after a command,
            relative to it, and of the one before the next command, relative to that, shape [n - 1, M, 4].
        follower: How the controller follows commands that it holds.
    """

    interpolation: str
    times: Array
    positions: Array
    velocities: Array | None = None
    accelerations: Array | None = None
    start: Array | None = None
    handles: Array | None = None
    follower: Follower | None = None

    def fault(self, motors: int) -> str:
        """What keeps a player of M motors from playing them; empty where nothing does."""
        n, needed = len(self.times), INTERPOLATIONS.get(self.interpolation)
        if needed is None:
            return f"the interpolation {self.interpolation!r} is none of {', '.join(INTERPOLATIONS)}"
        if lacking := [name for name in needed if getattr(self, name) is None]:
            return f"the interpolation {self.interpolation} needs {' and '.join(lacking)}"
        if np.ndim(self.times) != 1 or not n or not np.all(np.diff(self.times) > 0.0):
            return "their times do not increase"
        shapes = dict.fromkeys(("positions", "velocities", "accelerations"), (n, motors))
        for name, shape in {**shapes, "start": (motors,), "handles": (n - 1, motors, 4)}.items():
            values = getattr(self, name)
            if values is not None and np.shape(values) != shape:
                return f"{name} have shape {list(np.shape(values))} instead of {list(shape)}"
            if values is not None and not np.all(np.isfinite(values)):
                return f"{name} are not finite"
        return ""


@dataclass(frozen=True, eq=False)
class WrittenCommands:
    """Files of commands.

    Attributes:
        files: Their paths, the one that was asked for first.
        exact: The commands before they were rounded.
        read: The commands as they were read back from the files.
        notes: What the user of the files must know, as sentences.
    """

    files: tuple[str, ...]
    exact: Commands
    read: Commands
    notes: tuple[str, ...] = ()


def instants(curves: MotorCurves, rate: float, fixed_period: bool = False) -> Array:
    """Times of commands from the first frame of a shot to its last [s], shape [n].

    Args:
        curves: Of the shot.
        rate: Commands a second [Hz].
        fixed_period: Whether the last period is as long as the others; the last command then is at or after the last
            frame. Otherwise it is at the last frame.
    """
    periods = max(1, int(np.ceil(curves.end * rate - 1e-6)))
    times = np.arange(periods + 1) / rate
    if not fixed_period:
        times[-1] = curves.end
    return np.asarray(times, np.float64)
