"""What a player makes of commands: it holds or follows them, or interpolates by lines, cubics, quintics or Beziers."""

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Sample
from scipy.interpolate import CubicHermiteSpline, PPoly
from scipy.linalg import expm

from .commands import BEZIER, CUBIC, FOLLOW, HOLD, QUINTIC, SETTLED, Commands, Follower

_CYCLE = 0.002  # between the values of a motion that follows commands [s]; its frequencies are a few hertz
_PIECES = 16  # of a Bezier curve, each a cubic in time
_BISECTIONS = 50  # for the parameter of a Bezier curve at a time


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
    if commands.interpolation == FOLLOW and commands.follower is not None:
        return _followed(times, positions, commands.start, commands.follower)
    if len(times) == 1:
        return PPoly(positions[None], np.array([times[0], times[0] + 1.0]))
    if commands.interpolation == BEZIER and commands.handles is not None:
        return _beziers(times, positions, commands.handles)
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


def _beziers(times: Array, positions: Array, handles: Array) -> PPoly:
    """Cubic Bezier curves in time and value, each as cubics in time between `_PIECES` + 1 of its points.

    Where the control points lie at thirds of the time, these are the curves themselves; otherwise they differ by the
    fourth power of a piece's length.
    """
    h = np.diff(times)[:, None, None]
    share = np.linspace(0.0, 1.0, _PIECES + 1)[None, None]
    after, before = handles[..., 0, None] / h, 1.0 + handles[..., 2, None] / h
    low, high = np.zeros(np.broadcast_shapes(after.shape, share.shape)), np.ones(1)
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        early = _bezier(middle, 0.0, after, before, 1.0)[0] < share
        low, high = np.where(early, middle, low), np.where(early, high, middle)
    u = 0.5 * (low + high)
    first, last = positions[:-1, :, None], positions[1:, :, None]
    values, rises = _bezier(u, first, first + handles[..., 1, None], last + handles[..., 3, None], last)
    _, passed = _bezier(u, 0.0, after, before, 1.0)
    # where a control point lies at its end, the curve may begin with any speed
    chords = np.gradient(values, axis=2) * _PIECES / h
    rates = np.where(passed > 1e-3, rises / np.maximum(passed * h, 1e-12), chords)
    # a common end of two curves has both of their slopes, so that each curve has pieces of its own
    x = (times[:-1, None] + share[0] * np.diff(times)[:, None])[:, :-1].ravel()
    d = np.repeat(np.diff(times) / _PIECES, _PIECES)[:, None]
    y0, y1, v0, v1 = (_by_piece(a) for a in (values[..., :-1], values[..., 1:], rates[..., :-1], rates[..., 1:]))
    slope = (y1 - y0) / d
    c3, c2 = (v0 + v1 - 2.0 * slope) / d**2, (3.0 * slope - 2.0 * v0 - v1) / d
    return PPoly(np.stack([c3, c2, v0, y0]), np.append(x, times[-1]))


def _by_piece(values: Array) -> Array:
    """Values of shape [n - 1, M, pieces] as [(n - 1) pieces, M]."""
    return np.asarray(np.moveaxis(values, 1, 2).reshape(-1, values.shape[1]))


def _bezier(u: Array, p0: Array | float, p1: Array, p2: Array, p3: Array | float) -> tuple[Array, Array]:
    """A cubic Bezier curve and its derivative."""
    w = 1.0 - u
    value = w**3 * p0 + 3.0 * w**2 * u * p1 + 3.0 * w * u**2 * p2 + u**3 * p3
    rate = 3.0 * (w**2 * (p1 - p0) + 2.0 * w * u * (p2 - p1) + u**2 * (p3 - p2))
    return np.asarray(value), np.asarray(rate)


def _followed(times: Array, positions: Array, start: Array | None, follower: Follower) -> PPoly:
    """What a motor does that follows held commands, from rest: the exact solution of its linear law."""
    law = np.array([[0.0, 1.0], [-follower.gain, -follower.gain * follower.lookahead]])
    state = np.stack([positions[0] if start is None else start, np.zeros(positions.shape[1])])
    steps: dict[float, Array] = {}
    knots, states = [times[0]], [state]
    # the last command is held for as long as the one before
    for period, command in zip(np.diff(times, append=2.0 * times[-1] - times[-2]), positions, strict=True):
        pieces = max(1, int(np.ceil(period / _CYCLE - 1e-6)))
        d = period / pieces
        step = steps.setdefault(round(d, 12), expm(law * d))
        rest = np.stack([command, np.zeros_like(command)])
        for _ in range(pieces):
            state = rest + step @ (state - rest)
            knots.append(knots[-1] + d)
            states.append(state)
    values = np.stack(states)
    return CubicHermiteSpline(np.array(knots), values[:, 0], values[:, 1])
