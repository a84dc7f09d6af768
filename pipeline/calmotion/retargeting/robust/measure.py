"""Motor curves on a set of robots: where their targets are, and how far from where they should be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.model.robust.robots import Scenario
from calmotion.model.run import RunSettings
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
Found = TypeVar("Found")
_AT_ONCE = 4  # robots for each processor between two reports of progress


def silent(fraction: float, message: str) -> None:
    """Progress that nobody is told."""


def errors_on(
    shot: CompiledShot, options: RunSettings, curves: Curves, scenarios: Sequence[Scenario],
    progress: Progress = silent,
) -> dict[str, Array]:  # fmt: skip
    """Largest errors of the targets on each robot.

    Args:
        shot: With the animator's curves as the intended ones.
        options: With the time step.
        curves: Tracks of all motors, by the name of the curves.
        scenarios: The robots.
        progress: Called with a fraction and a message.

    Returns:
        By the name of the curves, shape [S, K] [m]; infinite where a robot cannot be simulated.
    """
    unknown = np.full(len(shot.character.targets), np.inf)

    def largest(off: Array | None) -> Array:
        return unknown if off is None else largest_of(off)

    found = deviations_on(shot, options, curves, scenarios, largest, progress)
    # of no robot at all as well, one row for each
    return {name: np.array([robot[name] for robot in found]).reshape(len(found), len(unknown)) for name in curves}


def largest_of(deviations: Array) -> Array:
    """The largest deviation of each target, shape [K] [m], of shape [T, K, 3]."""
    return np.asarray(np.linalg.norm(deviations, axis=2).max(axis=0, initial=0.0))


def deviations_on(
    shot: CompiledShot, options: RunSettings, curves: Curves, scenarios: Sequence[Scenario],
    of: Callable[[Array | None], Found], progress: Progress = silent,
) -> list[dict[str, Found]]:  # fmt: skip
    """A function of the targets' deviations from the intended motion, for all curves on each robot.

    Args:
        shot, options, curves, scenarios, progress: As of `errors_on`.
        of: Of the deviations at the judged instants [m], shape [T, K, 3]; None where a robot cannot be simulated.
    """
    rows: list[dict[str, Found]] = []
    size = _AT_ONCE * processors()
    for first in range(0, len(scenarios), size):
        interrupts.check()
        some = scenarios[first : first + size]
        rows += in_parallel(lambda scenario: _on_robot(shot_of(shot, scenario), options, curves, of), some)
        progress(len(rows) / len(scenarios), f"measuring the curves on {len(scenarios)} robots")
    return rows


def _on_robot(
    shot: CompiledShot, options: RunSettings, curves: Curves, of: Callable[[Array | None], Found]
) -> dict[str, Found]:
    try:
        prepared = prepare(shot, options)
        grid = prepared.grid
        intended = intended_motion(prepared, *sample_tracks(shot.animation.tracks, grid))
        simulator = Simulator(prepared.model, grid.h, prepared.world, grid.cyclic)
    except (ShotError, SimulationFailure):
        return {name: of(None) for name in curves}
    found = {}
    for name, tracks in curves.items():
        try:
            positions = simulator.run(*sample_tracks(tracks, grid)).target_positions
            found[name] = of((positions - intended.target_positions)[grid.judged])
        except SimulationFailure:
            found[name] = of(None)
    return found
