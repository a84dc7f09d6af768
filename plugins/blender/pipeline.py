# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs calmotion in a separate process: commands, progress, cancelling. Does not import bpy."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import subprocess
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ENDED = {0: "done", 130: "interrupted"}
PROGRESS = "progress\t"
_PATIENCE = 20.0  # wait after a request to stop [s]
_NO_CONSOLE = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # on Windows a window would open with it


def words_of(command: str, windows: bool = os.name == "nt") -> list[str]:
    """The words of a command as a person writes it: a path with spaces may stand in quotes, or be all there is.

    Args:
        command: From the preferences, or the environment.
        windows: Whether a backslash parts folders; elsewhere it takes the meaning from the next character.
    """
    text = command.strip()
    if shutil.which(text) is not None:
        return [text]
    words = shlex.split(text, posix=not windows)
    return [word.strip("\"'") for word in words] if windows else words


@dataclass(frozen=True)
class Job:
    """What is run.

    Attributes:
        commands: One after the other, each the words of a process.
        root: The layer that opens the result with its shot.
        table: Places and errors of the targets over time.
    """

    commands: tuple[tuple[str, ...], ...]
    root: Path
    table: Path


def job_for(
    command: Sequence[str], shot: Path, folder: Path, *, robot: str, material: str, flexible: str, tolerance: float
) -> Job:
    """The commands for an exported character.

    Args:
        command: The words that start calmotion.
        shot: The exported character.
        folder: Where layers go.
        robot: Layer with a robot; empty: a robot is made from the skin or the parts.
        material, flexible: Of a robot that is made.
        tolerance: [m].
    """
    rigged, result, table = folder / "robot.usda", folder / "calm.usda", folder / "errors.csv"
    commands: list[tuple[str, ...]] = []
    if robot:
        rigged.write_text(composed(robot, shot, rigged), encoding="utf-8")
    else:
        commands.append(
            (*command, "rig", str(shot), "-o", str(rigged), "--progress", "--json", "--set",
             f"rig.skeleton.material={material}", "--set", f"rig.skeleton.flexible={flexible.replace(' ', '')}")
        )  # fmt: skip
    commands.append(
        (*command, "optimize", str(rigged), "-o", str(result), "--csv", str(table), "--progress", "--json",
         "--tolerance", f"{tolerance:g}m")
    )  # fmt: skip
    return Job(tuple(commands), folder / "calm_root.usda", table)


def composed(robot: str, shot: Path, target: Path) -> str:
    """The text of a layer that puts a robot over an exported character, with its rates and units."""
    head = [
        line.strip()
        for line in shot.read_text(encoding="utf-8").splitlines()[:40]
        if line.strip().split("=")[0].strip() in ("metersPerUnit", "upAxis", "timeCodesPerSecond", "startTimeCode",
                                                  "endTimeCode", "framesPerSecond", "defaultPrim")
    ]  # fmt: skip
    names = ",\n        ".join(
        f"@{_seen_from(target.parent.resolve(), Path(path).resolve())}@" for path in (robot, shot)
    )
    lines = [*head, f"subLayers = [\n        {names}\n    ]"]
    return "#usda 1.0\n(\n    " + "\n    ".join(lines) + "\n)\n"


def _seen_from(folder: Path, file: Path) -> str:
    """A file as seen from a folder; the whole path where that is on another drive."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        return file.as_posix()


class PipelineRun:
    """A job that runs in the background."""

    def __init__(self, job: Job):
        self.job = job
        self.fraction, self.message = 0.0, "starting"
        self.outcome: str | None = None
        self.errors: list[str] = []
        self.report: dict = {}
        self._process: subprocess.Popen[str] | None = None
        self._cancelled = False
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> PipelineRun:
        """Begin; returns itself."""
        self._thread.start()
        return self

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        return self._thread.is_alive()

    def wait(self, seconds: float | None = None) -> None:
        """Wait until it has ended."""
        self._thread.join(seconds)

    def cancel(self) -> None:
        """Ask the process to stop, and kill it if it does not."""
        self._cancelled = True
        process = self._process
        if process is None or process.poll() is not None:
            return
        # Windows interrupts only who shares a console; what is ended at once leaves whole files, and no process
        process.send_signal(signal.SIGINT if os.name != "nt" else signal.SIGTERM)
        threading.Timer(_PATIENCE, process.kill).start()

    def _run(self) -> None:
        for number, command in enumerate(self.job.commands):
            if self._cancelled or not self._carry_out(command, number):
                break
        else:
            self.fraction, self.message = 1.0, "done"
        if self._cancelled:
            self.outcome = "cancelled"
        elif self.outcome is None:
            self.outcome = "failed" if self.errors else "done"

    def _carry_out(self, command: Sequence[str], number: int) -> bool:
        """Run one command; whether to go on."""
        environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONHOME", "PYTHONPATH")}
        environment["PYTHONIOENCODING"] = "utf-8"  # Windows would have its own
        try:
            self._process = subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8",
                errors="replace", env=environment, creationflags=_NO_CONSOLE,
            )  # fmt: skip
        except OSError as error:
            self.errors.append(f"{command[0]} cannot be started: {error.strerror}")
            return False
        assert self._process.stdout is not None and self._process.stderr is not None
        out: list[str] = []
        reader = threading.Thread(target=lambda: out.append(self._process.stdout.read()), daemon=True)
        reader.start()
        for line in self._process.stderr:
            self._take(line, number)
        status = self._process.wait()
        reader.join()
        return self._conclude(status, out[0] if out else "")

    def _take(self, line: str, number: int) -> None:
        """Progress comes as lines `progress<tab>stage<tab>fraction<tab>message`."""
        if line.startswith(PROGRESS):
            _, stage, fraction, message = (*line.rstrip("\n").split("\t"), "", "", "")[:4]
            done = float(fraction or 0.0)
            self.fraction = (number + done) / len(self.job.commands)
            self.message = f"{stage}: {message}" if message else stage

    def _conclude(self, status: int, printed: str) -> bool:
        try:
            self.report = json.loads(printed)
        except ValueError:
            self.report = {}
        for error in self.report.get("errors", ()):
            place = ".".join(filter(None, (error.get("path"), error.get("attribute"))))
            self.errors.append(f"{place}: {error.get('problem')}. {error.get('remedy')}".strip())
        if status not in ENDED and not self.errors:
            self.errors.append(f"calmotion ended with status {status}")
        return status == 0
