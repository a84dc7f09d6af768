"""What a hostile user does: a command on a broken, extreme or contradictory shot, and what must come of it.

A case is data: what it writes into a folder, the command line, the exit statuses that are right, and what the messages
must hold. The judge sees what no case may do: end in a traceback, tell numbers that are none, change or half-write a
file, give an error without its place and remedy, or tell a verdict that its own numbers do not support.
"""

import contextlib
import hashlib
import io
import json
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import small_shots as shots
from pxr import Sdf, Usd

Edit = Callable[[Usd.Stage], None]
DONE, REFUSED, USAGE, EITHER = (0,), (1,), (2,), (0, 1)
SHOT = "{shot}"  # stands for the file that a case has made
SECONDS = 30.0  # processor time that a case may take, kernels read from the cache


@dataclass(frozen=True)
class Case:
    """One hostile command.

    Attributes:
        make: Writes files into the folder in which the command runs; may return the shot.
        command: Arguments; in words.
        statuses: Exit statuses that are right.
        told: Alternatives are separated by `|`; each text must be in what is printed.
        outputs: Names that a run that is done may leave beside its inputs.
        seconds: Largest processor time [s].
        judge: A further check of the report of a run that is done; a fault or "".
        kept: Whether a refusal leaves the outputs as well: the reports of a batch.
    """

    make: Callable[[Path], Path | None]
    command: tuple[str, ...]
    statuses: tuple[int, ...] = REFUSED
    told: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ("out.usda", "out_root.usda")
    seconds: float = SECONDS
    judge: Callable[[dict], str] | None = None
    kept: bool = False


@dataclass(frozen=True)
class Ending:
    """How a command ended: its status, what it printed, and the processor time [s]."""

    status: int
    out: str
    err: str
    seconds: float


def arm(*edits: Edit, name: str = "shot.usda", target: bool = True) -> Callable[[Path], None]:
    """Writes the arm with a target, and with edits."""

    def make(folder: Path) -> None:
        def edit(stage: Usd.Stage) -> None:
            if target:
                shots.make_target(stage)
            for one in edits:
                one(stage)

        shots.write_arm(folder / name, edit)

    return make


def layer(*changes: Callable[[Sdf.Layer], None], **files: str) -> Callable[[Path], None]:
    """Writes the arm with changes of its layer, which need not compose, and further files by stem."""

    def make(folder: Path) -> None:
        arm()(folder)
        for stem, text in files.items():
            (folder / f"{stem}.usda").write_text(text)
        own = Sdf.Layer.OpenAsAnonymous(str(folder / "shot.usda"))
        for change in changes:
            change(own)
        own.Export(str(folder / "shot.usda"))

    return make


def simulate(
    statuses: tuple[int, ...], *parts: Edit | str, command: str = "simulate",
    make: Callable[[Path], None] | None = None,
    target: bool = True, args: str = "", seconds: float = SECONDS, judge: Callable[[dict], str] | None = None,
) -> Case:  # fmt: skip
    """`calmotion simulate` on the arm.

    Args:
        statuses: Those that are right.
        parts: Edits of the arm, and texts that must be told.
        command: Another command.
        make: Makes the shot in place of the arm.
        target: Whether the arm has a target.
        args: Further words of the command line.
        seconds, judge: See `Case`.
    """
    edits, told = ([part for part in parts if isinstance(part, str) == text] for text in (False, True))
    words = (command, "shot.usda", "-o", "out.usda", "--json", *args.split())
    return Case(make or arm(*edits, target=target), words, statuses, tuple(told), seconds=seconds, judge=judge)


optimize = partial(simulate, command="optimize", seconds=2 * SECONDS)


def state(folder: Path) -> dict[str, str]:
    """Hashes of all regular files below a folder, and where links lead."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_symlink():
            found[name] = f"link to {os.readlink(path)}"
        elif path.is_file():
            with contextlib.suppress(PermissionError):
                found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


@contextlib.contextmanager
def _inside(folder: Path) -> Iterator[tuple[io.StringIO, io.StringIO]]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
            yield out, err
    finally:
        os.chdir(before)


def run(case: Case, folder: Path) -> tuple[Ending, list[str]]:
    """Run a case in a folder of its own, in this process; its ending, and what is wrong with it."""
    from calmotion.cli.main import main

    made = case.make(folder)
    words = [made.name if word == SHOT and made else word for word in case.command]
    before, begin = state(folder), time.process_time()
    with _inside(folder) as (out, err):
        status = main(words)
    ending = Ending(status, out.getvalue(), err.getvalue(), time.process_time() - begin)
    return ending, faults_of(case, ending, before, state(folder)) + faults_of_time(case, ending)


def faults_of(case: Case, ending: Ending, before: dict[str, str], after: dict[str, str]) -> list[str]:
    """What is wrong with how a case ended."""
    text, found = ending.out + ending.err, []
    if "Traceback" in text:
        found.append("a traceback")
    if ending.status not in case.statuses:
        found.append(f"exit status {ending.status} instead of {' or '.join(map(str, case.statuses))}")
    for told in case.told:
        if not any(part in text or part in _unescaped(ending.out) for part in told.split("|")):
            found.append(f"does not tell {told!r}")
    changed = [name for name, digest in before.items() if after.get(name) != digest]
    if changed and not set(changed) <= set(case.outputs):
        found.append(f"changes {changed}")
    made = sorted(set(after) - set(before))
    unwanted = [name for name in made if (ending.status != 0 and not case.kept) or not _allowed(name, case.outputs)]
    if unwanted and ending.status != 130:
        found.append(f"leaves {unwanted}")
    if "--json" in case.command:
        found += _faults_of_report(case, ending)
    elif ending.status in (1, 2) and not {"error:", "usage:"} & set(text.split()):
        found.append("no error is printed")
    return found


def faults_of_time(case: Case, ending: Ending) -> list[str]:
    """Whether a case takes longer than it may, where kernels are read from the cache."""
    slow = ending.seconds > case.seconds
    return [f"takes {ending.seconds:.0f} s, stated are {case.seconds:.0f} s"] if slow else []


def _allowed(name: str, outputs: tuple[str, ...]) -> bool:
    return any(name == output or name.startswith(f"{output}/") for output in outputs)


def _unescaped(text: str) -> str:
    with contextlib.suppress(ValueError):
        return json.dumps(json.loads(text), ensure_ascii=False)
    return text


def _faults_of_report(case: Case, ending: Ending) -> list[str]:
    if not ending.out.strip():
        return [] if ending.status == 2 and "usage:" in ending.err else ["no JSON object is printed"]
    try:
        report = json.loads(ending.out)
    except ValueError:
        return ["what is printed is no JSON object"]
    if ending.status in (1, 2):
        return faults_of_error(report.get("error") or {}) if "error" in report or ending.status == 2 else []
    found = faults_of_verdict(report) if "max_error_m" in report else []
    if case.judge is not None and (fault := case.judge(report)):
        found.append(fault)
    return found


def faults_of_error(error: dict) -> list[str]:
    """An error has a problem, a remedy and a place."""
    found = [f"the error has no {name}" for name in ("problem", "remedy") if not error.get(name)]
    if not any(error.get(name) for name in ("path", "attribute", "found")):
        found.append("the error has no place")
    return found


def faults_of_verdict(report: dict) -> list[str]:
    """The verdict of a simulation agrees with its numbers: the estimate, the limits, the errors of the targets."""
    found = []
    bad = [name for name, value in _numbers(report) if not math.isfinite(value)]
    if bad:
        found.append(f"numbers that are none: {bad[:3]}")
    error, tolerance = report.get("simulation_error_m"), report.get("tolerance_m")
    if report.get("tolerance_kept") and error is not None and tolerance is not None and error > 1.01 * tolerance:
        found.append(f"kept, although {error} > {tolerance}")
    largest = max((target["max_error_m"] or 0.0 for target in report["targets"]), default=0.0)
    if largest > 1.0001 * report["max_error_m"] + 1e-12:
        found.append("a target's error is larger than the largest")
    for use in report.get("limits") or ():
        if use["after"] is not None and _beyond(use) and not use["exceeded"]:
            found.append(f"a limit that is exceeded is not said to be: {use}")
    return found


def _beyond(use: dict) -> bool:
    """Whether a velocity, acceleration or effort, which are limited on both sides, is beyond its limit."""
    return use["quantity"] != "position" and abs(use["after"]) > 1.001 * abs(use["limit"])


def _numbers(value: object, name: str = "") -> Iterator[tuple[str, float]]:
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _numbers(item, f"{name}.{key}")
    elif isinstance(value, list):
        for item in value:
            yield from _numbers(item, name)
    elif isinstance(value, float):
        yield name, value
