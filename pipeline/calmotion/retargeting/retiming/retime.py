"""Offsets and tempo together: the tempo of the rigid robot first, then offsets at that tempo, under all limits."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from calmotion.model import Result
from calmotion.model.retiming.performance import retimed, with_contacts_at
from calmotion.model.retiming.retimed import Retimed
from calmotion.model.run import RunSettings
from calmotion.retargeting.retiming.rigid_robot import tempo_input
from calmotion.retargeting.retiming.settings import refuse_tempo
from calmotion.retargeting.retiming.tempo import find_tempo
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
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
    settings, plain = options.retime, replace(options, retime=None)
    if settings is None:
        return optimize_to_tolerance(shot, plain, progress, checkpoint, known, memory)
    refuse_tempo(shot.character, shot.animation, settings)
    progress(0.0, "choosing the tempo")
    found = find_tempo(tempo_input(shot, plain, shot.animation.tracks), settings, shot.character.path)
    if found.map is None:
        result = optimize_to_tolerance(shot, plain, progress, checkpoint, known, memory)
        return replace(result, retimed=Retimed(shot.animation, shot.character, found.report))
    frames = np.arange(found.frames) * (shot.animation.frame_times[1] - shot.animation.frame_times[0])
    performance = Retimed(
        retimed(shot.animation, found.map, frames), with_contacts_at(shot.character, found.map), found.report
    )  # fmt: skip
    result = optimize_to_tolerance(shot.at(performance), plain, progress, checkpoint)
    return replace(result, retimed=performance)
