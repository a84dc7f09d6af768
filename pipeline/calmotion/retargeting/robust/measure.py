"""Motor curves on a set of robots: how far their targets are from where they should be."""

from collections.abc import Mapping, Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.model.run import RunSettings
from calmotion.model.uncertainty import Scenario
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.parallel import in_parallel
from calmotion.multibody.sensitivity.linearization import processors
from calmotion.retargeting.robust.scenarios import shot_of
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulate import Progress, intended_motion
from calmotion.simulation.simulator import Simulator
from calmotion.simulation.target_errors import Objective, rotation_errors
from calmotion.support import interrupts

Curves = Mapping[str, Sequence[Track]]
_AT_ONCE = 4  # robots for each processor between two reports of progress


def silent(fraction: float, message: str) -> None:
    """Progress that nobody is told."""


def errors_on(
    shot: CompiledShot,
    options: RunSettings,
    curves: Curves,
    scenarios: Sequence[Scenario],
    progress: Progress = silent,
    weighted: bool = False,
) -> dict[str, Array]:
    """Largest errors of positions and rotations of the targets on each robot.

    Args:
        shot: With the animator's curves as the intended ones.
        options: With the time step.
        curves: Tracks of all motors, by the name of the curves.
        progress: Called with a fraction and a message.
        weighted: Whether an error is multiplied by the root of its weight at its instant.

    Returns:
        By the name of the curves, shape [S, K, 2] [m, rad], or all [m] where weighted; infinite where a robot cannot be
        simulated.
    """
    rows: list[dict[str, Array]] = []
    size, targets = _AT_ONCE * processors(), len(shot.character.targets)
    for first in range(0, len(scenarios), size):
        interrupts.check()
        some = scenarios[first : first + size]
        rows += in_parallel(lambda scenario: _on_robot(shot_of(shot, scenario), options, curves, weighted), some)
        progress(len(rows) / len(scenarios), f"measuring the curves on {len(scenarios)} robots")
    # of no robot at all as well, one row for each
    return {name: np.array([row[name] for row in rows]).reshape(len(rows), targets, 2) for name in curves}


def _on_robot(shot: CompiledShot, options: RunSettings, curves: Curves, weighted: bool) -> dict[str, Array]:
    found = {name: np.full((len(shot.character.targets), 2), np.inf) for name in curves}
    try:
        prepared = prepare(shot, options)
        grid = prepared.grid
        intended = intended_motion(prepared, *sample_tracks(shot.animation.tracks, grid))
        objective = Objective.over(prepared.model, intended, grid, shot.animation.weights)
        simulator = Simulator(prepared.model, grid.h, prepared.world, grid.cyclic)
    except (ShotError, SimulationFailure):
        return found
    for name, tracks in curves.items():
        try:
            run = simulator.run(*sample_tracks(tracks, grid))
        except SimulationFailure:
            continue
        found[name] = largest_errors(objective, grid, run, weighted)
    return found


def largest_errors(objective: Objective, grid: TimeGrid, run: ForwardRun, weighted: bool) -> Array:
    """Largest errors of positions [m] and rotations [rad] over the judged time, shape [K, 2].

    Args:
        weighted: Whether each is multiplied by the root of its weight at that instant, which makes all of them metres.
    """
    turned, _ = rotation_errors(objective.intended.target_rotations, run.target_rotations)
    moved = run.target_positions - objective.intended.target_positions
    lengths = np.linalg.norm(np.stack([moved, turned], axis=2), axis=3)[grid.judged]
    if weighted:
        lengths *= objective.weights[grid.judged, :, ::3] / np.sqrt(grid.quadrature[grid.judged])[:, None, None]
    return np.asarray(lengths.max(axis=0, initial=0.0))
