"""Limits that curves keep between the instants of a search as well.

A search judges limits at its own instants. Curves may exceed them between these, and peaks of efforts are one or two
hundredths too low by a step that has positions right to the tolerance: finer samples and steps tell by how much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from calmotion.arrays import Array
from calmotion.errors import IntegrationError
from calmotion.model import Result
from calmotion.model.curves import commanded_curves
from calmotion.model.limits.use import LimitUse, is_kept
from calmotion.model.run import RunSettings
from calmotion.retargeting.found_curves import best_so_far
from calmotion.retargeting.input_run import with_input_resolved
from calmotion.retargeting.problem.robot import EFFORT
from calmotion.retargeting.to_tolerance import continued, optimize_to_tolerance
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.tempo import TEMPO_LIMITS, TempoLimits
from calmotion.simulation.inputs.time_grid import make_grid
from calmotion.simulation.simulate import Progress
from calmotion.tolerance.motors.animation_limits import tempo_limits
from calmotion.tolerance.pod_subspace import ReferenceRun
from calmotion.tolerance.reduced_bodies import RunMemory
from calmotion.tolerance.simulation import found_tracks
from calmotion.tolerance.step_choice import LAST, chooses_step
from calmotion.tolerance.step_error import efforts_by, order_of

LIMITED_SEARCHES = 4  # at most, one after the other
ENOUGH = 5e-4  # share of a limit by which it counts as kept between the instants of a search
COARSE = 2e-3  # excess of an effort that is left though finer steps were known, from which the step is halved
SPARED = 5e-4  # share of the efforts that searches leave, since what finer steps have more is that of curves nearby
FINE = 32  # instants of a frame at which curves are compared with their limits
HALVED = 3  # most times that steps are halved for the efforts
OF_FINER = 1.25e-3  # estimated error of efforts by these steps, as a share of their limits, before it is extrapolated


def optimize_within_limits(
    shot: CompiledShot, options: RunSettings, progress: Progress, checkpoint: Path | None = None,
    known: ReferenceRun | None = None, memory: RunMemory | None = None,
) -> Result:  # fmt: skip
    """As `optimize_to_tolerance`, with limits that the curves keep between the instants of the search as well.

    Where a search cannot keep its limits at its own instants, what is exceeded between them is told alone.
    """
    searches = Searches(options, progress, checkpoint, known, memory)
    done = searches.searched(shot, robust=options.robust)
    if options.robust is not None or done.interrupted:
        return done
    found = searches.between(shot)
    if found.excess <= ENOUGH or not options.max_iterations or not all(map(is_kept, done.limits)):
        return found.told(done)
    keep_limits(shot, searches, found)
    return searches.with_input_resolved()


def keep_limits(shot: CompiledShot, searches: Searches, found: Between) -> None:
    """Search until curves keep their limits between the instants of the last search, too.

    Efforts of each instant are raised by what finer steps have more, then limits narrowed by what is still exceeded:
    other efforts after each search exceeded their limits now here, now there.

    Args:
        shot: The shot.
        found: What is known of curves nearby.
    """
    shares, efforts = {name: np.ones(len(shot.character.motors)) for name in TEMPO_LIMITS}, None
    shares[EFFORT] -= SPARED
    for _ in range(LIMITED_SEARCHES):
        over = {name: np.maximum(1.0, used) for name, used in found.used.items()}
        if efforts is None and found.efforts is not None:
            efforts, over[EFFORT] = found.efforts, np.ones(len(shot.character.motors))
        shares = {name: share / over.get(name, 1.0) for name, share in shares.items()}
        narrowed = tuple((name, tuple(share.tolist())) for name, share in shares.items())
        done = searches.searched(shot, narrowed=narrowed, between=efforts)
        found = searches.between(shot)
        if done.interrupted or found.excess <= ENOUGH:
            break
        if EFFORT in found.used and np.max(found.used[EFFORT]) > 1.0 + COARSE and searches.with_half_the_step():
            found, efforts, shares[EFFORT] = searches.between(shot), None, np.full_like(shares[EFFORT], 1.0 - SPARED)
    searches.done = found.told(done)


class Searches:
    """Searches one after the other, each of almost the motion of the last.

    Attributes:
        done: The result of the last, with the work of all.
    """

    done: Result

    def __init__(
        self, options: RunSettings, progress: Progress, checkpoint: Path | None = None,
        known: ReferenceRun | None = None, memory: RunMemory | None = None,
    ):  # fmt: skip
        self._options, self._progress, self._checkpoint = options, progress, checkpoint
        self._known, self._memory, self._count = known, memory or RunMemory(), 0

    @property
    def interrupted(self) -> bool:
        """Whether the user ended one of them."""
        return self._count > 0 and self.done.interrupted

    def searched(self, shot: CompiledShot, **options: Any) -> Result:
        """The result of one more, with other settings, from the curves of the last."""
        begun = shot.with_tracks(found_tracks(self.done, shot.animation)) if self._count else shot
        latest = optimize_to_tolerance(
            begun, replace(self._options, **{"robust": None, **options}), self._progress, self._checkpoint,
            None if self._count else self._known, self._memory,
        )  # fmt: skip
        self.done = continued(self.done, latest) if self._count else latest
        self._count += 1
        return self.done

    def with_half_the_step(self) -> bool:
        """Let further searches have half the step of the last, and whether they have: not where the user chose it."""
        shot = self._memory.searched
        chosen = shot is not None and chooses_step(shot.character, self._options) and self.done.step_s > LAST
        if chosen:
            self._memory.step = 0.5 * self.done.step_s
        return chosen

    def between(self, shot: CompiledShot) -> Between:
        """What the curves of the last do between its instants.

        Efforts are those of finer steps, beside what the step of the next search has; those of the last where they are
        so far within all limits that their estimated error does not matter.

        Args:
            shot: As it was searched.
        """
        result, limits, animation = self.done, tempo_limits(shot.character), shot.animation
        assert result.after is not None
        used = _used_by_curves(shot, result, limits)
        if not np.any(np.isfinite(limits.effort)):
            return Between(used)
        own, played = result.after.motion.motor_efforts[result.after.motion.judged], found_tracks(result, animation)
        used[EFFORT] = np.max(np.abs(own), axis=0, initial=0.0) / limits.effort
        known = None if result.accuracy is None else result.accuracy.efforts
        errors = np.where(np.isfinite(limits.effort), np.inf, 0.0) if known is None else known / limits.effort
        near = used[EFFORT] + errors > 1.0
        if result.interrupted or not np.any(near):
            return Between(used)
        options = RunSettings(pre_roll=result.pre_roll_s)
        step = make_grid(animation.frame_times, self._memory.step or result.step_s, 0.0).h
        order, error = order_of(shot.character), max(float(np.max(errors[near])), ENOUGH)
        parts = 2 ** min(max(1, int(np.ceil(np.log2(error / OF_FINER) / order))), HALVED)
        try:
            if not np.isclose(step, result.step_s) and self._memory.projected is not None:
                own = efforts_by(self._memory.projected.shot.with_tracks(played), options, step)
            fine = efforts_by(shot.with_tracks(played), options, step / parts)
        except IntegrationError:
            return Between(used)
        except KeyboardInterrupt:
            self.done = best_so_far(result)
            return Between(used)
        fine = _extrapolated(fine, own, parts, order)
        used[EFFORT] = np.max(np.abs(fine), axis=0) / limits.effort
        return Between(used, _largest_near(fine, parts) - own)

    def with_input_resolved(self) -> Result:
        """The result, whose input is simulated as well as that of a single search, with the bodies of the last one."""
        shot = self._memory.searched
        if shot is None or self._count == 1 or self.interrupted or not chooses_step(shot.character, self._options):
            return self.done
        return with_input_resolved(self.done, shot.with_tracks(shot.animation.tracks), self._options)


@dataclass(frozen=True, eq=False)
class Between:
    """What curves do between the instants of the search that found them.

    Attributes:
        used: Largest values of what a tempo limits, as shares of the limits, by name, shape [M] each.
        efforts: As `RunSettings.between`; None where no finer steps were needed.
    """

    used: dict[str, Array]
    efforts: Array | None = None

    @property
    def excess(self) -> float:
        """By how much any limit is exceeded, as a share of it; negative where all are kept."""
        return max((float(np.max(share, initial=0.0)) for share in self.used.values()), default=0.0) - 1.0

    def told(self, result: Result) -> Result:
        """The result with the use of its limits as the curves have it."""
        return replace(result, limits=told_between(result.limits, self.used)).with_limits_told()


def told_between(limits: Sequence[LimitUse], used: dict[str, Array]) -> tuple[LimitUse, ...]:
    """The use of limits as the curves have it between the instants of a search, where they exceed one there.

    Args:
        used: Largest shares of the limits that curves reach anywhere, by quantity, shape [M] each.
    """
    told = []
    for use in limits:
        share = float(used[use.quantity][use.motor]) if use.quantity in used else 0.0
        between = replace(use, after=float(np.copysign(share * use.limit, use.after)), excess=share - 1.0)
        told.append(use if is_kept(between) or between.excess <= use.excess else between)
    return tuple(told)


def _used_by_curves(shot: CompiledShot, result: Result, limits: TempoLimits) -> dict[str, Array]:
    """Largest shares of the limits of curves, at finer instants than those of a search, shape [M] each."""
    frames = shot.animation.frame_times
    times = np.linspace(0.0, frames[-1], FINE * (len(frames) - 1) + 1)
    curves = commanded_curves(shot.character, replace(shot.animation, current=shot.animation.tracks), result)
    return {
        name: np.max(np.abs(curves(times, order)), axis=0, initial=0.0) / getattr(limits, name)
        for order, name in enumerate(TEMPO_LIMITS[:3], 1)
        if np.any(np.isfinite(getattr(limits, name)))
    }


def _extrapolated(fine: Array, coarse: Array, parts: int, order: int) -> Array:
    """Values by a step by Richardson's extrapolation from one that is as many times longer, interpolated between the
    instants of that, shape [T, M]."""
    late, at = (fine[::parts] - coarse) / (float(parts) ** order - 1.0), np.arange(len(fine)) / parts
    extrapolated: Array = fine + np.stack([np.interp(at, np.arange(len(coarse)), column) for column in late.T], axis=1)
    return extrapolated


def _largest_near(values: Array, parts: int) -> Array:
    """Of each part-th value and those up to half a distance from it, the one of the largest size, shape [T, M]."""
    half = parts // 2
    windows = sliding_window_view(np.pad(values, ((half, half), (0, 0)), "edge"), 2 * half + 1, axis=0)[::parts]
    at = np.argmax(np.abs(windows), axis=2)
    return np.asarray(np.take_along_axis(windows, at[..., None], axis=2)[..., 0])
