"""Offsets and tempo together.

A search finds the offsets that calm the robot at the tempo of its rigid robot, without the limits that a tempo keeps.
The tempo follows anew from these curves and efforts, and the offsets are moved to it, until the curves keep the limits.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from calmotion.model import Result, Track
from calmotion.model.curves import Sample, commanded_curves
from calmotion.model.retiming.performance import retimed, with_contacts_at
from calmotion.model.retiming.retimed import Retimed
from calmotion.model.retiming.tempo import TimeMap
from calmotion.model.run import RunSettings
from calmotion.retargeting.retiming.rigid_robot import tempo_input
from calmotion.retargeting.retiming.settings import refuse_tempo
from calmotion.retargeting.retiming.tempo import FoundTempo, TempoInput, find_tempo
from calmotion.retargeting.to_tolerance import continued, optimize_to_tolerance
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.tempo import TEMPO_LIMITS, MotorEfforts, TempoLimits
from calmotion.simulation.simulate import Progress
from calmotion.tolerance.motors.animation_limits import tempo_limits
from calmotion.tolerance.pod_subspace import ReferenceRun
from calmotion.tolerance.reduced_bodies import RunMemory

ROUNDS = 4  # searches at most, of which the last keeps all limits by itself
KEPT = 1e-3  # share of a limit by which it counts as kept
ROOM = 5e-3  # share of a limit by which the tempo stays further within it once offsets are known
FINE = 8  # instants of a frame at which curves are compared with their limits


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
    given = tempo_input(shot, plain, shot.animation.tracks)
    found = find_tempo(given, settings, shot.character.path)
    if found.map is None:
        result = optimize_to_tolerance(shot, plain, progress, checkpoint, known, memory)
        return replace(result, retimed=Retimed(shot.animation, shot.character, found.report))
    performance, done = _Performance.of(shot, given, found), None
    for number in range(1, ROUNDS + 1):
        last = number == ROUNDS or found.excess > KEPT
        latest = optimize_to_tolerance(
            performance.shot, replace(plain, limited_by_tempo=not last), progress, checkpoint
        )  # fmt: skip
        done = latest if done is None else continued(done, latest)
        if last or done.interrupted or performance.excess(latest) <= KEPT:
            break
        progress(0.0, "choosing the tempo for the curves that were found")
        report = found.report
        found = find_tempo(performance.input(latest, number * ROOM), settings, shot.character.path)
        report = replace(found.report, uniform_added=report.uniform_added, lower_bound=report.lower_bound)
        performance = performance.moved(latest, replace(found, report=report))
    assert done is not None
    return replace(done, retimed=performance.retimed)


@dataclass(frozen=True, eq=False)
class _Performance:
    """A shot at a tempo.

    Attributes:
        made: The shot at its own tempo.
        given: What the tempo of its rigid robot follows from.
        tempo, retimed: Of the performance.
        shot: The performance.
    """

    made: CompiledShot
    given: TempoInput
    tempo: TimeMap
    retimed: Retimed
    shot: CompiledShot

    @classmethod
    def of(cls, made: CompiledShot, given: TempoInput, found: FoundTempo) -> _Performance:
        """A shot at a tempo that was found for it."""
        tempo = found.map or TimeMap(given.times, given.times)
        frames = np.arange(found.frames, dtype=np.float64) * given.frame
        performed = retimed(made.animation, tempo, frames)
        performance = Retimed(performed, with_contacts_at(made.character, tempo), found.report)
        return cls(made, given, tempo, performance, made.at(performance))

    def moved(self, result: Result, found: FoundTempo) -> _Performance:
        """The shot at another tempo, with the offsets of a result where the animation is at the same time."""
        other = _Performance.of(self.made, self.given, found)
        frames = other.retimed.animation.frame_times
        before = self.tempo.performed(other.tempo.animated(frames))
        offsets = self._curves(result)(before, 0) - self._curves(None)(before, 0)
        values = other._curves(None)(frames, 0) + offsets
        return replace(other, shot=other.shot.with_tracks([Track(frames, column) for column in values.T]))

    def excess(self, result: Result) -> float:
        """The largest excess of the limits that a tempo keeps, as a share of them, on finer instants than those of the
        search."""
        assert result.after is not None
        limits, frames = tempo_limits(self.made.character), self.retimed.animation.frame_times
        times = np.linspace(0.0, frames[-1], FINE * (len(frames) - 1) + 1)
        curves, motion = self._curves(result), result.after.motion
        values = [curves(times, 1), curves(times, 2), curves(times, 3), motion.motor_efforts[motion.judged]]
        bounds = [getattr(limits, name) for name in TEMPO_LIMITS]
        return max(float(np.max(np.abs(v) / most, initial=0.0)) for v, most in zip(values, bounds, strict=True)) - 1.0

    def input(self, result: Result, room: float) -> TempoInput:
        """What the tempo follows from with the curves of a result.

        Args:
            room: Share of the limits by which they are narrower.
        """
        times, limits = self.given.times, self.given.limits
        path = CubicSpline(times, self._curves(result)(self.tempo.performed(times), 0))
        narrow = TempoLimits(**{name: (1.0 - room) * getattr(limits, name) for name in TEMPO_LIMITS})
        return replace(self.given, curves=path, limits=narrow, efforts=self._efforts(result))

    def _efforts(self, result: Result) -> MotorEfforts | None:
        """Those of the rigid robot, and what the motion of a result takes beside them, by the square of the tempo."""
        efforts, times = self.given.efforts, self.given.times
        if efforts is None:
            return None
        assert result.after is not None
        motion, h = result.after.motion, 1e-6
        stretch = self.tempo.stretch(times)[:, None]
        slope = (self.tempo.stretch(times + h) - self.tempo.stretch(times - h))[:, None] / (2.0 * h)
        told = efforts.at_rest + efforts.by_square / stretch**2 - efforts.by_change * slope / stretch**3
        taken = CubicSpline(motion.times, motion.motor_efforts)(self.tempo.performed(times))
        return replace(efforts, by_square=efforts.by_square + (taken - told) * stretch**2)

    def _curves(self, result: Result | None) -> Sample:
        """The motors' curves in a result, or as they were animated."""
        animation = self.retimed.animation
        return commanded_curves(self.made.character, replace(animation, current=animation.tracks), result)
