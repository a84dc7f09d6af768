"""What a robot does when a player plays commands, against what it does with the smooth curves that they stand for."""

from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.model import RunSettings, Sample
from calmotion.multibody import SimulationFailure, Workspace
from calmotion.simulation import (
    MAX_STEP,
    CompiledShot,
    Prepared,
    SteadyState,
    TimeGrid,
    failure_error,
    pre_roll_weights,
    prepare,
    refuse_half_turns,
    run_forward,
)

from .commands import Commands, MotorCurves
from .players import played

STEPS = 8  # of a simulation within a period of the commands, whose corners it must resolve
SHORTEST = 2.5e-4  # step for such corners [s]; those of faster commands are far above what moves a robot


@dataclass(frozen=True, eq=False)
class Loss:
    """How far the targets are from where the smooth curves bring them, at their worst.

    Attributes:
        distances: [m], shape [K].
        angles: [rad], shape [K].
    """

    distances: Array
    angles: Array

    @property
    def largest(self) -> float:
        """The largest distance [m]."""
        return float(self.distances.max(initial=0.0))


@dataclass(frozen=True, eq=False)
class _Targets:
    """Positions [m], shape [T, K, 3], and unit quaternions, [T, K, 4], while the shot plays."""

    positions: Array
    rotations: Array


class Playback:
    """Plays commands on the simulated robot of a shot.

    Motions are simulated by BDF2, which follows the angles of motors at its instants whatever their rates, so that
    corners of a command do no harm. Both motions of a comparison have the same steps, so that the error of the steps
    cancels.

    Args:
        shot: The compiled shot.
        options: Settings of the simulation.
        curves: The smooth curves of its motors.
    """

    def __init__(self, shot: CompiledShot, options: RunSettings, curves: MotorCurves):
        self._shot, self._curves = shot, curves
        self._options = RunSettings(pre_roll=options.pre_roll)
        self._step = options.step or shot.character.retarget.time_step or MAX_STEP
        self._workspace = Workspace.for_system(shot.model.system)
        self._smooth: dict[float, tuple[Prepared, _Targets]] = {}
        self.simulations = 0

    def step_for(self, period: float) -> float:
        """Step for commands with a period [s]: half or a quarter ... of the shot's own, so that few are needed."""
        wanted, step = max(period / STEPS, min(SHORTEST, self._step)), self._step
        while step > 1.001 * wanted:
            step *= 0.5
        return step

    def loss(self, commands: Commands, step: float, delay: float = 0.0) -> Loss:
        """The loss by commands.

        Args:
            commands: As their player plays them.
            step: Of the simulations [s].
            delay: How late the player starts [s].

        Raises:
            ShotError: They cannot be simulated.
        """
        if step not in self._smooth:
            prepared = prepare(self._shot, replace(self._options, step=step))
            self._smooth[step] = prepared, self._simulated(prepared, self._curves.at)
        prepared, smooth = self._smooth[step]
        found = self._simulated(prepared, played(commands, self._curves.cyclic), delay)
        off = np.linalg.norm(found.positions - smooth.positions, axis=2)
        angles = _angles(found.rotations, smooth.rotations)
        return Loss(np.max(off, axis=0), np.max(angles, axis=0))

    def fastest(self, step: float) -> Array:
        """Largest speed of each target with the smooth curves [m/s], shape [K]: what a second of delay costs."""
        prepared, smooth = self._smooth[step]
        speeds = np.linalg.norm(np.diff(smooth.positions, axis=0), axis=2) / prepared.grid.h
        return np.asarray(np.max(speeds, axis=0, initial=0.0), np.float64)

    def _simulated(self, prepared: Prepared, curve: Sample, delay: float = 0.0) -> _Targets:
        grid, model, world = prepared.grid, prepared.model, prepared.world
        angles, rates = (over_playing(grid, curve, self._curves, delay, order) for order in (0, 1))
        refuse_half_turns(prepared.character, grid, angles)
        steady = SteadyState(model, world, grid.h, self._workspace) if grid.cyclic else None
        self.simulations += 1
        try:
            run = run_forward(model, self._workspace, angles, rates, grid.h, world, steady=steady)
        except SimulationFailure as failure:
            raise failure_error(prepared, failure) from failure
        return _Targets(run.target_positions[grid.judged], run.target_rotations[grid.judged])


def over_playing(grid: TimeGrid, curve: Sample, smooth: MotorCurves, delay: float, order: int) -> Array:
    """Angles (or their derivative) of the motors at all instants of a grid while a player plays, shape [T, M].

    Before it starts, the robot eases into the smooth curves where the grid has a pre-roll, and waits in their first
    pose otherwise.

    Args:
        grid: The instants.
        curve: What is played from the start on.
        smooth: The smooth curves.
        delay: How late the start is [s].
        order: Of the derivative: 0 or 1.
    """
    times = grid.times - delay
    if grid.cyclic:
        return curve(times, order)
    before = times < -1e-9
    values = curve(np.where(before, 0.0, times), order)
    if before.any():
        meet = np.stack([smooth.at(np.zeros(1), k)[0] for k in range(3)])
        if grid.pre_roll > 0.0:
            weights = pre_roll_weights(np.maximum(times[before], -grid.pre_roll), grid.pre_roll)
            values[before] = weights[order] @ meet
        else:
            values[before] = meet[0] if order == 0 else 0.0
    return values


def _angles(one: Array, other: Array) -> Array:
    """Angles between rotations [rad], shape [T, K], from unit quaternions of shape [T, K, 4]."""
    apart = np.minimum(np.linalg.norm(one - other, axis=2), np.linalg.norm(one + other, axis=2))
    return np.asarray(4.0 * np.arcsin(np.minimum(0.5 * apart, 1.0)), np.float64)
