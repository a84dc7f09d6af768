"""What came of a batch, as an object for programs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from calmotion.version import __version__

from .jobs import Job

OUTCOMES = DONE, KEPT, FAILED, DIED, WAITING = "done", "kept", "failed", "died", "not run"


@dataclass(frozen=True)
class JobResult:
    """What came of one job.

    Attributes:
        job: The job.
        outcome: `done`; `kept` (done earlier, and nothing has changed); `failed` for a reason that another attempt
            would meet too; `died` (its process or worker, at every attempt); `not run`.
        attempts: How often it was begun.
        wall_s: Of its last attempt [s].
        problem: Why it failed or died, or None: `problem`, `path`, `attribute`, `found`, `remedy`.
        report: The object of `--json`, or None.
        host: Where it ran, or empty.
        processor_s: Processor time of its last attempt [s]; None where that is unknown.
        worker: The worker of a cluster that ran it, or empty.
    """

    job: Job
    outcome: str
    attempts: int = 0
    wall_s: float = 0.0
    problem: dict[str, Any] | None = None
    report: dict[str, Any] | None = None
    host: str = ""
    processor_s: float | None = None
    worker: str = ""

    @property
    def has_result(self) -> bool:
        """Whether its files are there."""
        return self.outcome in (DONE, KEPT)

    def as_dict(self) -> dict[str, Any]:
        """Its row in the object of `--json`."""
        report = (self.report if self.has_result else None) or {}
        targets = report.get("targets") or []
        errors = {
            name: max((row[name] for row in targets if row.get(name) is not None), default=None)
            for name in ("max_error_before_m", "max_error_after_m", "max_error_m")
        }
        return {
            "shot": self.job.shot,
            "name": self.job.name,
            "outcome": self.outcome,
            "attempts": self.attempts,
            "wall_s": self.wall_s,
            "processor_s": self.processor_s,
            "layer": self.job.layer if self.has_result else None,
            "root_layer": report.get("root_layer"),
            "manifest": self.job.manifest if self.has_result else None,
            "log": self.job.log,
            "host": self.host,
            "worker": self.worker,
            "tolerance_kept": report.get("tolerance_kept"),
            "improved": report.get("improved"),
            **{key: value for key, value in errors.items() if value is not None},
            "problem": self.problem,
        }


@dataclass(frozen=True)
class BatchResult:
    """What came of a batch.

    Attributes:
        folder: Of the results.
        command: `optimize` or `simulate`.
        on: Where it ran.
        jobs: One for each shot, in their order.
        wall_s: Time of the batch [s].
        interrupted: Whether the user stopped it; the same call goes on.
    """

    folder: str
    command: str
    on: str
    jobs: Sequence[JobResult]
    wall_s: float
    interrupted: bool = False

    @property
    def successful(self) -> bool:
        """Whether every job has its result."""
        return all(job.has_result for job in self.jobs)

    def report(self) -> dict[str, Any]:
        """The object of `--json`."""
        worked = sum(job.wall_s for job in self.jobs if job.outcome == DONE)
        return {
            "command": "batch",
            "version": __version__,
            "of": self.command,
            "folder": self.folder,
            "on": self.on,
            "wall_s": self.wall_s,
            "jobs_wall_s": worked,
            "html": None,  # a page has words of this report, and is written after it
            "interrupted": self.interrupted,
            "outcomes": self.outcomes,
            "jobs": [job.as_dict() for job in self.jobs],
        }

    @property
    def outcomes(self) -> dict[str, int]:
        """The outcomes that there are, and how many jobs have each."""
        counts = {name: sum(job.outcome == name for job in self.jobs) for name in OUTCOMES}
        return {name: count for name, count in counts.items() if count}
