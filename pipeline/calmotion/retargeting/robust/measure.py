"""Motor curves on a set of robots: how far their targets are from where they should be."""

from __future__ import annotations

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
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.preparation import prepare
from calmotion.simulation.simulate import Progress, intended_motion
from calmotion.simulation.simulator import Simulator
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
) -> dict[str, Array]:
    """Largest errors of the targets on each robot.

    Args:
        shot: With the animator's curves as the intended ones.
        options: With the time step.
        curves: Tracks of all motors, by the name of the curves.
        progress: Called with a fraction and a message.

    Returns:
        By the name of the curves, shape [S, K] [m]; infinite where a robot cannot be simulated.
    """
    rows: list[dict[str, Array]] = []
    size, targets = _AT_ONCE * processors(), len(shot.character.targets)
    for first in range(0, len(scenarios), size):
        interrupts.check()
        some = scenarios[first : first + size]
        rows += in_parallel(lambda scenario: _on_robot(shot_of(shot, scenario), options, curves), some)
        progress(len(rows) / len(scenarios), f"measuring the curves on {len(scenarios)} robots")
    # of no robot at all as well, one row for each
    return {name: np.array([row[name] for row in rows]).reshape(len(rows), targets) for name in curves}


def _on_robot(shot: CompiledShot, options: RunSettings, curves: Curves) -> dict[str, Array]:
    found = {name: np.full(len(shot.character.targets), np.inf) for name in curves}
    try:
        prepared = prepare(shot, options)
        grid = prepared.grid
        intended = intended_motion(prepared, *sample_tracks(shot.animation.tracks, grid))
        simulator = Simulator(prepared.model, grid.h, prepared.world, grid.cyclic)
    except (ShotError, SimulationFailure):
        return found
    for name, tracks in curves.items():
        try:
            positions = simulator.run(*sample_tracks(tracks, grid)).target_positions
        except SimulationFailure:
            continue
        off = np.linalg.norm((positions - intended.target_positions)[grid.judged], axis=2)
        found[name] = off.max(axis=0, initial=0.0)
    return found


def largest_weighted(shot: CompiledShot, errors: Array) -> Array:
    """The largest error of any target as it weighs, shape [S], of errors of the targets, shape [S, K]."""
    return np.asarray((errors * np.sqrt([t.position_weight for t in shot.character.targets])).max(axis=1))
