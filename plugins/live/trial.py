"""A motion as a stream, and what its commands leave of the shake of the whole simulated robot."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.multibody import POSITION_GAIN, Model, Workspace
from calmotion.simulation import (
    CompiledShot,
    Prepared,
    rigid_motion,
    run_forward,
    sample_curves,
    static_motion,
)
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from .session import Live
from .settings import LiveSettings


class Trial:
    """A robot on which commands are tried.

    Args:
        prepared: The robot and the motion that is intended, on a time grid.
        frequencies: Those of the robot, over those of the model. Its sag, which no command removes, is its own.
    """

    def __init__(self, prepared: Prepared, frequencies: float = 1.0):
        system, self._grid, self._world = prepared.model.system, prepared.grid, prepared.world
        square, servo = frequencies**2, system.servo.copy()
        servo[:, POSITION_GAIN] *= square
        stiffer = system._replace(stiffness=square * system.stiffness, data=square * system.data, servo=servo)
        self._model: Model = replace(prepared.model, system=stiffer)
        self.curves = sample_curves(prepared.shot.animation.current, prepared.grid)
        angles, rates = self.curves.angles, self.curves.rates
        rigid = rigid_motion(self._model, angles, rates, self._grid.h, self._world, False)
        always = np.ones(len(self._grid.times), bool)
        intended = static_motion(self._model, rigid, angles, always, self._world).target_positions
        self._intended = CubicSpline(self._grid.times, intended)

    def left(self, angles: Array, rates: Array, delay: float | None) -> tuple[float, Array]:
        """What commands leave; see `compared`.

        Args:
            angles, rates: At the instants of the grid, shape [T, M].
        """
        return self.compared(self.played(angles, rates), delay)

    def played(self, angles: Array, rates: Array) -> Array:
        """Places of the targets at the instants of the grid, shape [T, K, 3] [m]; commands as of `left`."""
        workspace = Workspace.for_system(self._model.system)
        found: Array = run_forward(self._model, workspace, angles, rates, self._grid.h, self._world).target_positions
        return found

    def compared(self, positions: Array, delay: float | None) -> tuple[float, Array]:
        """How far a motion of the targets is from the intended one.

        Args:
            positions: At the instants of the grid [m], shape [T, K, 3].
            delay: Of the motion [s]; None: the one with which the mean square is least.

        Returns:
            The delay [s], and distances from the delayed intended motion with the sag of each pose [m], shape
            [judged T, K].
        """
        grid = self._grid
        found = positions[grid.judged]

        def distances(late: float) -> Array:
            wanted = self._intended(np.maximum(grid.times[grid.judged] - late, grid.times[0]))
            return np.asarray(np.linalg.norm(found - wanted, axis=2))

        if delay is None:
            delay = _lowest(lambda late: float(np.sum(distances(late) ** 2)))
        return delay, distances(delay)

    def streamed(self, shot: CompiledShot, settings: LiveSettings) -> tuple[Array, Array, dict[str, Any]]:
        """The motion as a stream: commands and rates at the instants of the grid, shape [T, M], and the report."""
        times, tick = self._grid.times, 1.0 / settings.rate
        motion = CubicSpline(times, self.curves.angles)
        ticks = np.arange(times[0], times[-1] + tick, tick)
        with Live(shot, replace(settings, background=False)) as live:
            live.reset(motion(times[0]))
            found = np.array([live.step(instant, motion(min(instant, times[-1]))) for instant in ticks])
            report = live.report()
        played = CubicSpline(ticks, found)
        return played(times), played(times, 1), report


def _lowest(error: Callable[[float], float]) -> float:
    """The delay of least error [s]: the best of some, and then the lowest point next to it."""
    apart, longest = 5e-3, 0.6
    best = min(np.arange(0.0, longest, apart).tolist(), key=error)
    return float(minimize_scalar(error, bounds=(max(best - apart, 0.0), best + apart), method="bounded").x)
