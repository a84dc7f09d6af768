"""Offsets and tempo together.

A search finds the offsets that calm the robot at the tempo of its rigid robot, without the limits that a tempo keeps.
Where its curves exceed them, further searches begin from these and keep them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Character, Result
from calmotion.model.curves import commanded_curves, retimed, with_schedules_at
from calmotion.model.limits.use import LimitUse
from calmotion.model.result import Retimed
from calmotion.model.run import RunSettings
from calmotion.model.tempo import TimeMap
from calmotion.retargeting.input_run import with_input_resolved
from calmotion.retargeting.retiming.program import NOTICED
from calmotion.retargeting.retiming.rigid_robot import tempo_input
from calmotion.retargeting.retiming.settings import refuse_tempo
from calmotion.retargeting.retiming.tempo import FoundTempo, TempoInput, find_tempo
from calmotion.retargeting.to_tolerance import continued, optimize_to_tolerance
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.tempo import TEMPO_LIMITS
from calmotion.simulation.simulate import Progress, simulate_shot
from calmotion.tolerance.motors.animation_limits import tempo_limits
from calmotion.tolerance.pod_subspace import ReferenceRun
from calmotion.tolerance.reduced_bodies import RunMemory
from calmotion.tolerance.simulation import found_tracks
from calmotion.tolerance.step_choice import LAST, chooses_step
from calmotion.tolerance.step_error import order_of

LIMITED_SEARCHES = 4  # at most that keep all limits by themselves
COARSE = 5e-3  # excess of an effort between instants from which shorter steps help, and narrower limits bend curves
BETWEEN = 5e-4  # share of a limit by which it counts as kept between the instants of a search
HALVED = 3  # most times that steps are halved for the efforts
FINE = 32  # instants of a frame at which curves are compared with their limits


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
        return optimize_to_tolerance(shot, options, progress, checkpoint, known, memory)
    refuse_tempo(shot.character, shot.animation, settings)
    progress(0.0, "choosing the tempo")
    given = tempo_input(shot, options, shot.animation.tracks)
    found = find_tempo(given, settings, shot.character.path)
    if found.map is None:
        result = optimize_to_tolerance(shot, replace(options, retime=None), progress, checkpoint, known, memory)
        return replace(result, retimed=Retimed(shot.animation, shot.character, found.report))
    searches = _Searches(shot.character, options, progress, checkpoint)
    performance = _Performance.of(shot, given, found)
    kept = False
    if found.excess <= NOTICED:  # where nothing may be slower, limits are no longer left to the tempo
        done = searches.searched(performance.shot, limited_by_tempo=True)
        kept, performance = _excess(performance.used(done)) <= 0.0, performance.with_curves(done)
    if not (kept or searches.interrupted):
        _search_within_limits(performance, searches)
    tracks = found_tracks(searches.done, performance.shot.animation)
    if options.robust is not None and not searches.interrupted:
        searches.searched(performance.shot.with_tracks(tracks), robust=options.robust)
    done = searches.with_input_resolved()
    return replace(done, retimed=performance.retimed)


class _Searches:
    """Searches one after the other, each of almost the motion of the last.

    Attributes:
        done: The result of the last, with the work of all.
    """

    done: Result

    def __init__(self, character: Character, options: RunSettings, progress: Progress, checkpoint: Path | None):
        self._character, self._options = character, replace(options, robust=None)
        self._progress, self._checkpoint, self._memory, self._count = progress, checkpoint, RunMemory(), 0

    @property
    def interrupted(self) -> bool:
        """Whether the user ended one of them."""
        return self._count > 0 and self.done.interrupted

    def searched(self, shot: CompiledShot, **options: Any) -> Result:
        """The result of one more, with other settings."""
        latest = optimize_to_tolerance(
            shot, replace(self._options, **options), self._progress, self._checkpoint, memory=self._memory
        )
        self.done = continued(self.done, latest) if self._count else latest
        self._count += 1
        return self.done

    def with_half_the_step(self) -> bool:
        """Let further searches have half the step of the last, and whether they have: not where the user chose it."""
        chosen = chooses_step(self._character, self._options) and self.done.step_s > LAST
        if chosen:
            self._memory.step = 0.5 * self.done.step_s
        return chosen

    def with_input_resolved(self) -> Result:
        """The result, whose input is simulated as well as that of a single search, with the bodies of the last one."""
        shot = self._memory.searched
        if shot is None or self._count == 1 or self.interrupted or not chooses_step(shot.character, self._options):
            return self.done
        return with_input_resolved(self.done, shot.with_tracks(shot.animation.tracks), self._options)


def _search_within_limits(performance: _Performance, searches: _Searches) -> None:
    """Search with all limits. Those that curves exceed between the instants of a search are narrowed by the excess;
    efforts that these instants have far too low, by shorter steps."""
    shot = performance.shot
    shares = {name: np.ones(len(shot.character.motors)) for name in TEMPO_LIMITS}
    for _ in range(LIMITED_SEARCHES):
        done = searches.searched(shot, narrowed=tuple((name, tuple(share.tolist())) for name, share in shares.items()))
        used = performance.used(done)
        if done.interrupted or _excess(used) <= BETWEEN:
            break
        over = {name: np.maximum(1.0, used[name]) for name in shares}
        if np.max(over["effort"]) > 1.0 + COARSE and searches.with_half_the_step():
            over["effort"] = shares["effort"]
        shares = {name: share / over[name] for name, share in shares.items()}
        shot = shot.with_tracks(found_tracks(done, shot.animation))
    searches.done = replace(searches.done, limits=told_between(searches.done.limits, used)).with_limits_told()


def told_between(limits: Sequence[LimitUse], used: dict[str, Array]) -> tuple[LimitUse, ...]:
    """The use of limits as the curves have it between the instants of a search, where they exceed one there.

    Args:
        used: Largest shares of the limits that curves reach anywhere, by quantity, shape [M] each.
    """
    told = []
    for use in limits:
        share = float(used[use.quantity][use.motor]) if use.quantity in used else 0.0
        beyond = share - 1.0 > max(NOTICED, use.excess)
        value = float(np.copysign(share * use.limit, use.after))
        told.append(replace(use, after=value, excess=share - 1.0) if beyond else use)
    return tuple(told)


def _excess(used: dict[str, Array]) -> float:
    return max(float(np.max(share, initial=0.0)) for share in used.values()) - 1.0


@dataclass(frozen=True, eq=False)
class _Performance:
    """A shot at a tempo.

    Attributes:
        character: Of the shot as it was made.
        retimed: The performance.
        shot: The same to be searched.
    """

    character: Character
    retimed: Retimed
    shot: CompiledShot

    @classmethod
    def of(cls, made: CompiledShot, given: TempoInput, found: FoundTempo) -> _Performance:
        """A shot at a tempo that was found for it."""
        tempo = found.map or TimeMap(given.times, given.times)
        frames = np.arange(found.frames, dtype=np.float64) * given.frame
        performed = retimed(made.animation, tempo, frames)
        performance = Retimed(performed, with_schedules_at(made.character, tempo.performed), found.report)
        return cls(made.character, performance, made.at(performance))

    def with_curves(self, result: Result) -> _Performance:
        """The shot with the curves of a result, from which another search begins."""
        return replace(self, shot=self.shot.with_tracks(found_tracks(result, self.shot.animation)))

    def used(self, result: Result) -> dict[str, Array]:
        """Largest values of what a tempo limits, as shares of the limits, by name, shape [M] each.

        Curves are compared on finer instants than those of the search.
        """
        assert result.after is not None
        limits, animation = tempo_limits(self.character), self.retimed.animation
        frames = animation.frame_times
        times = np.linspace(0.0, frames[-1], FINE * (len(frames) - 1) + 1)
        curves = commanded_curves(self.character, replace(animation, current=animation.tracks), result)
        used = {
            name: np.max(np.abs(curves(times, order)), axis=0, initial=0.0) / getattr(limits, name)
            for order, name in enumerate(TEMPO_LIMITS[:3], 1)
        }
        return used | {TEMPO_LIMITS[3]: self._used_efforts(result, limits.effort)}

    def _used_efforts(self, result: Result, limits: Array) -> Array:
        """Largest efforts as ever shorter steps have them, as shares of the limits, shape [M].

        A chosen step has positions right to the tolerance, and peaks of efforts to one or two hundredths. Steps are
        halved until what they change is no more than counts; not where the search's own instants are far beyond.
        """
        assert result.after is not None
        own = result.after.motion.motor_efforts[result.after.motion.judged]
        used: Array = np.max(np.abs(own), axis=0, initial=0.0) / limits
        if not np.any(np.isfinite(limits)) or np.max(used) > 1.0 + COARSE or result.interrupted:
            return used
        shot = self.with_curves(result).shot
        coarse = self._efforts_at(shot, result.step_s, result.pre_roll_s)
        for halved in range(1, HALVED + 1):
            fine = self._efforts_at(shot, 0.5**halved * result.step_s, result.pre_roll_s)
            limit = fine[::2] + (fine[::2] - coarse) / (2.0 ** order_of(shot.character) - 1.0)
            last, used = used, np.max(np.abs(np.concatenate([fine, limit])), axis=0) / limits
            if halved > 1 and np.all(np.abs(used - last) <= np.maximum(BETWEEN, 1.0 - used)):
                break
            coarse = fine
        return used

    def _efforts_at(self, shot: CompiledShot, step: float, pre_roll: float) -> Array:
        options = RunSettings(step=step, pre_roll=pre_roll)
        motion = simulate_shot(shot, options, lambda fraction, message: None).before.motion
        return motion.motor_efforts[motion.judged]
