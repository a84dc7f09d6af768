"""Curves sampled for players."""

from __future__ import annotations

import numpy as np
from calmotion.control.commands import CUBIC, HOLD, QUINTIC, SETTLED, Commands, MotorCurves, instants


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
