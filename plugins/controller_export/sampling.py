"""Curves sampled for players."""

import numpy as np

from .commands import (
    BEZIER,
    CUBIC,
    FOLLOW,
    HOLD,
    QUINTIC,
    SETTLED,
    Commands,
    Follower,
    MotorCurves,
    instants,
)

_SETTLES = 8.0  # lags of a controller after which it stands at its last command


def smooth_commands(curves: MotorCurves, rate: float, interpolation: str) -> Commands:
    """Commands for a player that interpolates, with the derivatives that it needs."""
    times = instants(curves, rate)
    velocities = curves.sample(times, 1) if interpolation in (CUBIC, QUINTIC) else None
    accelerations = curves.sample(times, 2) if interpolation == QUINTIC else None
    return Commands(interpolation, times, curves.sample(times, 0), velocities, accelerations)


def held_commands(curves: MotorCurves, rate: float) -> Commands:
    """Commands for a player that holds each of them.

    A held command is late by half a period, and by half of the time in which the motor gets there. Each is taken from
    the curve by so much later, so that the motion is on time.
    """
    times, period = instants(curves, rate, fixed_period=True), 1.0 / rate
    early = 0.5 * (period + min(period, SETTLED))
    return Commands(HOLD, times, curves.at(times + early), start=curves.at(np.zeros(1))[0])


def bezier_commands(curves: MotorCurves, rate: float) -> Commands:
    """Keyframes with the slopes of the curves, control points at thirds of the time between them."""
    times = instants(curves, rate)
    positions, thirds = curves.sample(times, 0), np.diff(times)[:, None] / 3.0
    slopes = curves.sample(times, 1)
    over = np.broadcast_to(thirds, (len(times) - 1, positions.shape[1]))
    handles = np.stack([over, over * slopes[:-1], -over, -over * slopes[1:]], axis=2)
    return Commands(BEZIER, times, positions, handles=handles)


def followed_commands(curves: MotorCurves, rate: float, cycle: float, follower: Follower) -> Commands:
    """Held commands for a controller that follows them late.

    Each is taken from the curve by so much later as the controller is at constant speed, and by half a period, so that
    the motion is on time. They go on after the shot until the motors stand.

    Args:
        curves: The curves.
        rate: Commands a second [Hz].
        cycle: Of the controller [s]: instants of commands are whole numbers of it.
        follower: How it follows.
    """
    lag = follower.lookahead
    after = 0.0 if curves.cyclic else _SETTLES * max(lag, follower.gain**-0.5)
    count = int(np.ceil((curves.end + after) * rate - 1e-6))
    times = np.unique(np.round(np.arange(count + 1) / rate / cycle)) * cycle
    return Commands(
        FOLLOW, times, curves.at(times + lag + 0.5 / rate), start=curves.at(np.zeros(1))[0], follower=follower
    )
