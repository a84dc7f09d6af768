"""Offsets and tempo together.

A search finds the offsets that calm the robot at the tempo of its rigid robot, without the limits that a tempo keeps.
Where its curves exceed them, further searches begin from these and keep them.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from calmotion.model import Result
from calmotion.model.curves import retimed, with_schedules_at
from calmotion.model.result import Retimed
from calmotion.model.run import RunSettings
from calmotion.model.tempo import TimeMap
from calmotion.retargeting.retiming.program import NOTICED
from calmotion.retargeting.retiming.rigid_robot import tempo_input
from calmotion.retargeting.retiming.settings import refuse_tempo
from calmotion.retargeting.retiming.tempo import FoundTempo, TempoInput, find_tempo
from calmotion.retargeting.within_limits import Between, Searches, keep_limits, optimize_within_limits
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.simulate import Progress
from calmotion.tolerance.pod_subspace import ReferenceRun
from calmotion.tolerance.reduced_bodies import RunMemory


def optimize_with_tempo(
    shot: CompiledShot, options: RunSettings, progress: Progress, checkpoint: Path | None = None,
    known: ReferenceRun | None = None, memory: RunMemory | None = None,
) -> Result:  # fmt: skip
    """As `optimize_to_tolerance`, at a tempo at which the robot can perform the shot, where that is asked for.

    Raises:
        ShotError: Pinned times and limits contradict each other, or the shot cannot be processed.
    """
    settings = options.retime
    if settings is None:
        return optimize_within_limits(shot, options, progress, checkpoint, known, memory)
    refuse_tempo(shot.character, shot.animation, settings)
    progress(0.0, "choosing the tempo")
    given = tempo_input(shot, options, shot.animation.tracks)
    found = find_tempo(given, settings, shot.character.path)
    if found.map is None:
        options = replace(options, retime=None)
        result = optimize_within_limits(shot, options, progress, checkpoint, known, memory)
        return replace(result, retimed=Retimed(shot.animation, shot.character, found.report))
    performance, searches = _performed(shot, given, found), Searches(options, progress, checkpoint)
    slower, between = shot.at(performance), None
    if found.excess <= NOTICED:  # where nothing may be slower, limits are no longer left to the tempo
        searches.searched(slower, limited_by_tempo=True)
        between = searches.between(slower)
    if between is None or (between.excess > 0.0 and not searches.interrupted):
        # what exceeds limits that were left to the tempo does not tell by how much they are to be narrowed
        keep_limits(slower, searches, Between({}, None if between is None else between.efforts))
    if options.robust is not None and not searches.interrupted:
        searches.searched(slower, robust=options.robust)
    return replace(searches.with_input_resolved(), retimed=performance)


def _performed(shot: CompiledShot, given: TempoInput, found: FoundTempo) -> Retimed:
    """A shot at a tempo that was found for it."""
    tempo = found.map or TimeMap(given.times, given.times)
    frames = np.arange(found.frames, dtype=np.float64) * given.frame
    performed = retimed(shot.animation, tempo, frames)
    return Retimed(performed, with_schedules_at(shot.character, tempo), found.report)
