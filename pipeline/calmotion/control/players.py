"""What a player makes of commands: it holds them, or interpolates by lines, cubics or quintics."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PPoly

from calmotion.control.commands import CUBIC, HOLD, QUINTIC, SETTLED, Commands
from calmotion.shot.character import Array
from calmotion.shot.curves import Sample


def played(commands: Commands, cyclic: bool = False) -> Sample:
    """What the player of commands plays, at times from its start on [s]: values and derivatives, shape [n, M].

    Args:
        commands: The commands.
        cyclic: Whether they are played again from the first when the last is reached; otherwise the last is held.
    """
    curve = curve_of_commands(commands)
    first, last = curve.x[0], curve.x[-1]

    def sample(times: Array, order: int) -> Array:
        if cyclic:
            # the last command is the first of the next loop, and whole turns add up
            values = np.asarray(curve(np.mod(times, last), order))
            loops = np.floor(times / last)[:, None]
            return values + loops * (curve(last) - curve(first)) if order == 0 else values
        values = np.asarray(curve(np.clip(times, first, last), order))
        return values if order == 0 else np.where(((times < first) | (times > last))[:, None], 0.0, values)

    return sample


def curve_of_commands(commands: Commands) -> PPoly:
    """The curve through commands that their player follows.

    A held command is reached at constant speed within `SETTLED`, or within its period where that is shorter, since no
    motor can jump.
    """
    times, positions = commands.times, commands.positions
    if commands.interpolation == HOLD:
        return _held(times, positions, positions[0] if commands.start is None else commands.start)
    if len(times) == 1:
        return PPoly(positions[None], np.array([times[0], times[0] + 1.0]))
    velocities = commands.velocities
    if commands.interpolation == CUBIC and velocities is not None:
        return CubicHermiteSpline(times, positions, velocities)
    if commands.interpolation == QUINTIC and velocities is not None and commands.accelerations is not None:
        return _quintic(times, positions, velocities, commands.accelerations)
    return _lines(times, positions)


def _lines(times: Array, positions: Array) -> PPoly:
    return PPoly(np.stack([np.diff(positions, axis=0) / np.diff(times)[:, None], positions[:-1]]), times)


def _held(times: Array, positions: Array, start: Array) -> PPoly:
    periods = np.diff(times, append=times[-1] + (times[-1] - times[-2] if len(times) > 1 else SETTLED))
    reached = times + np.minimum(SETTLED, periods)
    knots = np.stack([times, reached], axis=1).ravel()
    values = np.stack([np.concatenate([start[None], positions[:-1]]), positions], axis=1).reshape(-1, len(start))
    # where a command is reached as the next one comes, two knots are one
    apart = np.concatenate([[True], np.diff(knots) > 1e-9])
    return _lines(knots[apart], values[apart])


def _quintic(times: Array, p: Array, v: Array, a: Array) -> PPoly:
    """Quintic pieces through positions, velocities and accelerations."""
    h = np.diff(times)[:, None]
    d, v0, v1, a0, a1 = np.diff(p, axis=0), v[:-1], v[1:], a[:-1], a[1:]
    c3 = (20.0 * d - (8.0 * v1 + 12.0 * v0) * h - (3.0 * a0 - a1) * h**2) / (2.0 * h**3)
    c4 = (-30.0 * d + (14.0 * v1 + 16.0 * v0) * h + (3.0 * a0 - 2.0 * a1) * h**2) / (2.0 * h**4)
    c5 = (12.0 * d - 6.0 * (v1 + v0) * h - (a0 - a1) * h**2) / (2.0 * h**5)
    return PPoly(np.stack([c5, c4, c3, 0.5 * a0, v0, p[:-1]]), times)
