"""Makes a repertoire: its clips and all transitions between them, each retargeted from rest to rest, and checked."""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.model import held_curve
from calmotion.support import write_text
from calmotion.usd import write_performance
from calmotion.version import __version__
from calmotion.workflow import Progress, Shot, plain

from ..batch.jobs import Job, jobs_for
from ..batch.report import BatchResult, JobResult
from ..batch.run import run_jobs
from ..batch.workers import LOCAL
from .clips import Clip, Plan, pace_of, read_clips, read_plan, transition

SHOTS, REPORT = "shots", "sequence.json"
ENDPOINTS, REFERENCE = "calm:retarget:endpoints", "calm:retarget:reference"
SEAM = 1e-5  # largest gap of a motor where a clip and a transition meet [rad or m]


@dataclass(frozen=True)
class Member:
    """A clip or a transition of a repertoire.

    Attributes:
        name: Of its files.
        start, end: Clips that it leads from and to; the clip itself in both.
        seconds: Its length [s].
        outcome: Of its job, see `JobResult`.
        error_before_m, error_m: Largest error of a target, as planned and retargeted [m]; None without a result.
        within_tolerance: Whether the simulation keeps the tolerance.
        within_goal: Whether the error is one that is accepted: not larger than the goal, by default the tolerance.
        exceeded_limits: Limits of motors that it exceeds, as `path quantity`.
        joined: Whether its ends are the poses as animated, where it meets the others.
        layer: Its layer, or None.
        problem: Why it has none.
    """

    name: str
    start: str
    end: str
    seconds: float
    outcome: str
    error_before_m: float | None
    error_m: float | None
    within_tolerance: bool
    within_goal: bool
    exceeded_limits: tuple[str, ...]
    joined: bool
    layer: str | None
    problem: dict[str, Any] | None = None

    @property
    def good(self) -> bool:
        """Whether it may be played."""
        return self.error_m is not None and not _faults(self)


@dataclass(frozen=True)
class Repertoire:
    """A repertoire that was made.

    Attributes:
        folder: Of its files.
        clips, transitions: Its members.
        wall_s: Time that it took [s].
        interrupted: Whether the user stopped it; the same call goes on.
    """

    folder: str
    clips: Sequence[Member]
    transitions: Sequence[Member]
    wall_s: float
    interrupted: bool = False

    @property
    def good(self) -> bool:
        """Whether every clip may follow every other one."""
        return all(member.good for member in (*self.clips, *self.transitions))

    @property
    def verdict(self) -> str:
        """That, as a sentence."""
        return _TOLD[self.good]

    def report(self) -> dict[str, Any]:
        """The object of `--json`."""
        rows = {"clips": self.clips, "transitions": self.transitions}
        listed = {
            key: [asdict(member) | {"good": member.good, "may_be_played": _verdict(member)} for member in value]
            for key, value in rows.items()
        }
        head = {"command": "sequence", "version": __version__, "folder": self.folder, "wall_s": self.wall_s}
        made: dict[str, Any] = plain(
            head | {"interrupted": self.interrupted, "good": self.good, "verdict": self.verdict} | listed
        )
        return made


_TOLD = {True: "Every clip may follow every other one.", False: "Not every clip may follow every other one."}


def sequence(
    plan: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    arguments: Sequence[str] = (),
    plugins: Sequence[str] = (),
    on: str = LOCAL,
    workers: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Repertoire:
    """Make a repertoire: its clips, and the transitions between any two of them.

    First and last poses are kept (`calm:retarget:endpoints`), so that the curves of whatever follows meet; each member
    begins and ends at rest. The same call goes on after an interruption, and makes again only what has changed.

    Args:
        plan: TOML file with a table `[clips]`.
        folder: Of the results.
        arguments: Options of `calmotion optimize` for all members.
        plugins: Folders with more plugins, for reading the clips.
        on, workers, progress, cancel: As of `batch`.

    Raises:
        ShotError: The file, a clip or the pair of two clips cannot be processed.
    """
    known, target = read_plan(plan), os.path.abspath(os.fspath(folder))
    clips = read_clips(known, plugins)
    lengths, jobs = _written(known, clips, target, arguments)
    result = run_jobs(jobs, target, "optimize", on, workers, progress, cancel)
    made = _repertoire(clips, lengths, result)
    write_text(os.path.join(target, REPORT), json.dumps(made.report(), indent=2) + "\n")
    return made


def _written(
    plan: Plan, clips: Sequence[Clip], folder: str, arguments: Sequence[str]
) -> tuple[dict[str, float], list[Job]]:
    """Write the shots of all members; their lengths [s], and their jobs."""
    settings = {ENDPOINTS: "kept"} | ({REFERENCE: plan.reference} if plan.reference else {})
    pace, shots = pace_of(clips, clips[0].shot.character), Path(folder) / SHOTS
    lengths: dict[str, float] = {}

    def add(name: str, clip: Clip, motion: tuple[Array, Array] | None) -> None:
        provenance = replace(clip.shot.provenance, shot=os.path.abspath(clip.shot.path))
        write_performance(str(shots / f"{name}.usda"), provenance, clip.shot.character, motion, settings)
        lengths[name] = float(clip.shot.animation.frame_times[-1] if motion is None else motion[0][-1])

    for clip in clips:
        add(clip.name, clip, None)
    for one in clips:
        for two in clips:
            if one is not two:
                add(f"{one.name}_to_{two.name}", one, transition(one, two, pace, plan.shortest))
    return lengths, jobs_for([shots / f"{name}.usda" for name in lengths], folder, "optimize", arguments)


def _repertoire(clips: Sequence[Clip], lengths: Mapping[str, float], result: BatchResult) -> Repertoire:
    by_name = {job.job.name: job for job in result.jobs}
    ends = {clip.name: (clip.start, clip.end) for clip in clips}

    def member(name: str, start: str, end: str) -> Member:
        first, last = (ends[start][0], ends[end][1]) if start == end else (ends[start][1], ends[end][0])
        return _member(by_name[name], start, end, lengths[name], (first, last))

    names = [clip.name for clip in clips]
    singles = [member(name, name, name) for name in names]
    pairs = [member(f"{one}_to_{two}", one, two) for one in names for two in names if one != two]
    return Repertoire(result.folder, singles, pairs, result.wall_s, result.interrupted)


def _member(job: JobResult, start: str, end: str, seconds: float, poses: tuple[Any, Any]) -> Member:
    row, report = job.as_dict(), job.report or {}
    error = row.get("max_error_after_m")
    limits = tuple(f"{use['path']} {use['quantity']}" for use in report.get("limits", []) if use["exceeded"])
    accurate = bool(report.get("tolerance_kept"))
    accepted = error is not None and error <= (report.get("goal_m") or report["tolerance_m"])
    return Member(
        job.job.name, start, end, seconds, job.outcome, row.get("max_error_before_m"), error, accurate, accepted,
        limits, error is not None and _is_joined(job, poses), row["layer"], job.problem,
    )  # fmt: skip


def _is_joined(job: JobResult, poses: tuple[Any, Any]) -> bool:
    """Whether the written curves begin and end in some poses, at rest."""
    root = (job.report or {}).get("root_layer")
    if not root:
        return False
    animation = Shot(root).read().animation
    end = float(animation.frame_times[-1])
    for track, first, last in zip(animation.current, *poses, strict=True):
        curve = held_curve(track, end)
        if np.max(np.abs(curve(np.array([0.0, end]), 0) - [first, last])) > SEAM:
            return False
    return True


def _verdict(member: Member) -> str:
    if member.error_m is None:
        return "no"
    return f"no: {', '.join(faults)}" if (faults := _faults(member)) else "yes"


def _faults(member: Member) -> list[str]:
    """Why a member that has a result may not be played."""
    faults = [] if member.within_tolerance else ["tolerance missed"]
    faults += [] if member.within_goal else ["error above the goal"]
    faults += [f"exceeds {limit}" for limit in member.exceeded_limits]
    return faults + ([] if member.joined else ["ends changed"])
