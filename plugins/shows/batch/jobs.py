"""The jobs of a batch: which command makes which files of which shot, and whether that is done already."""

import contextlib
import hashlib
import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from calmotion.errors import ShotError
from calmotion.support import write_text
from calmotion.version import __version__
from calmotion.workflow import changed_files, read_manifest, sha256_of

COMMANDS = {"optimize": "calm", "simulate": "simulated"}  # and what is added to the names of their files
LOGS = "logs"
EXTRAS = {"csv": "csv", "rrd": "rrd", "video": "webp", "figures": ""}  # outputs beside the layer, and their extensions


@dataclass(frozen=True)
class Job:
    """One run of the command line.

    Attributes:
        name: Of its files; distinct in a batch.
        shot: Path of the shot, absolute.
        folder: Of the results, absolute.
        command: `optimize` or `simulate`.
        arguments: Options of the command, without outputs.
        extras: Further outputs, of `EXTRAS`.
        environment: Variables of its process, beside those of the worker.
    """

    name: str
    shot: str
    folder: str
    command: str
    arguments: tuple[str, ...] = ()
    extras: tuple[str, ...] = ()
    environment: Mapping[str, str] = field(default_factory=dict)

    @property
    def stem(self) -> str:
        """Path of its files without what follows the name."""
        return os.path.join(self.folder, f"{self.name}_{COMMANDS[self.command]}")

    @property
    def layer(self) -> str | None:
        """The layer that it writes; None for a simulation, which changes no curve."""
        return f"{self.stem}.usda" if self.command == "optimize" else None

    @property
    def manifest(self) -> str:
        """The manifest that it writes."""
        return f"{self.stem}.manifest.json"

    @property
    def log(self) -> str:
        """What the command prints while it runs."""
        return self._beside("log")

    @property
    def report(self) -> str:
        """The JSON object that the command prints."""
        return self._beside("json")

    def _beside(self, extension: str) -> str:
        return os.path.join(self.folder, LOGS, f"{self.name}_{COMMANDS[self.command]}.{extension}")

    @property
    def line(self) -> list[str]:
        """The arguments of `calmotion`."""
        outputs = [] if self.layer is None else ["-o", self.layer]
        for extra in self.extras:
            outputs += [f"--{extra}", f"{self.stem}.{EXTRAS[extra]}" if EXTRAS[extra] else f"{self.stem}_{extra}"]
        outputs += ["--manifest", self.manifest]
        return [self.command, self.shot, *self.arguments, *outputs, "--json", "--quiet"]

    @property
    def request(self) -> str:
        """Hash of everything that is asked for, but not of the files that are read."""
        return hashlib.sha256(json.dumps([__version__, self.line], sort_keys=True).encode()).hexdigest()


def jobs_for(
    shots: Sequence[str | os.PathLike[str]], folder: str | os.PathLike[str], command: str,
    arguments: Sequence[str] = (), extras: Sequence[str] = (), environment: Mapping[str, str] | None = None,
) -> list[Job]:  # fmt: skip
    """One job for each shot.

    Raises:
        ShotError: There are no shots, a shot is named twice, or it lies in the folder of the results under the name of
            a result.
    """
    paths = [os.path.abspath(os.fspath(shot)) for shot in shots]
    if not paths:
        raise ShotError("there are no shots", path="SHOTS", remedy="Name one or more USD files")
    if command not in COMMANDS:
        raise ShotError("a batch cannot run this command", found=command, remedy=f"Use {' or '.join(COMMANDS)}")
    real: dict[str, str] = {}
    for path in paths:
        if (other := real.setdefault(os.path.realpath(path), path)) is not path:
            raise ShotError("this shot is named twice", path=path, found=other, remedy="Name it once")
    target, names = os.path.abspath(os.fspath(folder)), _names(paths)
    given = tuple(arguments), tuple(extras), dict(environment or {})
    jobs = [Job(names[path], path, target, command, *given) for path in paths]
    for job in jobs:
        if job.layer is not None and os.path.realpath(job.layer) in real:
            raise ShotError(
                "the result would be written over a shot of the batch", path=job.layer, remedy="Choose another folder"
            )
    return jobs


def _names(paths: Sequence[str]) -> dict[str, str]:
    """A name for the files of each shot, of as few of its folders as tell it apart from the others."""
    parts = {path: [*Path(path).parts[1:-1], Path(path).stem] for path in paths}
    count = 1
    while True:
        names = {path: re.sub(r"[^\w.-]+", "_", "_".join(found[-count:])) for path, found in parts.items()}
        if len({name.casefold() for name in names.values()}) == len(paths):
            return names
        if count > max(map(len, parts.values())):  # the same file with two extensions
            return {path: f"{name}_{Path(path).suffix[1:]}_{k}" for k, (path, name) in enumerate(names.items())}
        count += 1


def mark_done(job: Job) -> None:
    """Say beside its log that a job is done, and with which manifest."""
    content = {"request": job.request, "manifest": sha256_of(job.manifest)}
    write_text(_mark(job), json.dumps(content) + "\n")


def is_done(job: Job) -> bool:
    """Whether the files of a job are there, whole, for the same request and the same inputs."""
    try:
        mark = json.loads(Path(_mark(job)).read_text(encoding="utf-8"))
        if mark != {"request": job.request, "manifest": sha256_of(job.manifest)}:
            return False
        manifest = read_manifest(job.manifest)
    except (OSError, ValueError, ShotError):
        return False
    return not changed_files(manifest, job.folder)


def forget(job: Job) -> None:
    """Remove what earlier runs said about a job; its results stay until new ones replace them."""
    for path in (_mark(job), job.log, job.report):
        with contextlib.suppress(OSError):
            os.unlink(path)


def _mark(job: Job) -> str:
    return job._beside("done.json")
