"""Which robots and characters of a folder load, and why the others do not.

`calmotion bench reading FOLDER ... [-o PAGE.md]` reads every USD file as `calmotion inspect` does; for a skinned
character without physics it first makes a robot (`calmotion rig`), and with `--import` it imports URDF and MJCF robots
(`calmotion import`), with the material ABS for links without inertia. Files that another file beside or above them
opens as payload, reference or sublayer are parts, not shots, and are skipped.
"""

from __future__ import annotations

import re
import shlex
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calmotion.benchmarks.common.parsers import bench_parser
from calmotion.benchmarks.speed.robot_files import descriptions_in, shots_in
from calmotion.errors import ShotError, each
from calmotion.host import Host, open_host
from calmotion.shot import Animation, Character
from calmotion.shot.outputs import Rig
from calmotion.shot.run import OutputPaths, Source

LOADS, RIGGED, IMPORTED, REFUSED = "loads", "loads as a robot", "is imported", "refused"
SOLID = "abs"  # material of links without inertia, where an import needs one
_COLUMNS = ("file", "outcome", "bodies", "motors", "targets", "frames", "line, or what to change")


@dataclass(frozen=True)
class Row:
    """One file.

    Attributes:
        file: Relative to its folder.
        outcome: `LOADS`, `RIGGED`, `IMPORTED` or `REFUSED`.
        bodies, motors, targets, frames: What is in it.
        seconds: It took [s].
        reason: Why it is refused, or what animates its motors.
        line: The command that does the same; empty where it is refused.
    """

    file: str
    outcome: str
    bodies: int
    motors: int
    targets: int
    frames: int
    seconds: float
    reason: str
    line: str = ""


def study(folder: Path, imports: bool = False, known: Mapping[str, Row] | None = None) -> Iterator[Row]:
    """One row for each shot of a folder, and with `imports` for each URDF and MJCF robot.

    Args:
        folder: With robots and characters.
        imports: Whether URDF and MJCF robots are imported.
        known: Rows by file that need not be made again.
    """
    host = open_host([])
    shots = shots_in(folder)
    for path in [*shots, *(descriptions_in(folder) if imports else ())]:
        start = time.perf_counter()
        name = path.relative_to(folder).as_posix()
        if known is not None and name in known:
            yield known[name]
            continue
        try:
            read = _read(host, path, name) if path in shots else _imported(path, name)
            outcome, character, animation, line = read
        except ShotError as error:
            told = "; ".join(one.message() for one in each(error))
            # not where a package has the name of the folder
            reason = without_folders(re.sub(rf"(?<![\w:/]){re.escape(str(folder))}/", "", told))
            yield Row(name, REFUSED, 0, 0, 0, 0, time.perf_counter() - start, reason)
            continue
        sources = sorted({motor.source for motor in character.motors})
        frames = len(animation.frame_times)
        yield Row(
            name, outcome, sum(not body.between for body in character.bodies), len(character.motors),
            len(character.targets), frames, time.perf_counter() - start,
            f"motors by {', '.join(sources)}" if frames > 1 else "no animation", line,
        )  # fmt: skip


def without_folders(text: str) -> str:
    """A text without the folders of files of this machine; prim paths stay."""
    return re.sub(r"(?<![\w@])/(?:tmp|home|work|root|var|mnt|opt|Users)/(?:[^\s;)\"']*/)?", "", text)


def _imported(path: Path, name: str) -> tuple[str, Character, Animation, str]:
    from calmotion.workflow.importing.robot import import_robot

    with tempfile.TemporaryDirectory() as folder:
        layer = Path(folder) / "robot.usda"
        try:
            made, more = import_robot(path, layer=layer), ""
        except ShotError as error:
            if "--solid" not in error.remedy:
                raise
            made, more = import_robot(path, layer=layer, solid=SOLID), f" --solid {SOLID}"
    return IMPORTED, made.character, made.animation, f"calmotion import {shlex.quote(name)}{more} -o robot.usda"


def _read(host: Host, path: Path, name: str) -> tuple[str, Character, Animation, str]:
    try:
        character, animation = _loaded(host, path)
        command = "optimize" if len(animation.frame_times) > 1 else "inspect"
        output = " -o calm.usda" if command == "optimize" else ""
        return LOADS, character, animation, f"calmotion {command} {shlex.quote(name)}{output}"
    except ShotError as error:
        if "calmotion rig" not in error.remedy:
            raise
    with tempfile.TemporaryDirectory() as folder:
        layer = Path(folder) / "rig.usda"
        _carried_out(host, [Source(path=str(path), command="rig"), OutputPaths(layer=str(layer))], [Rig])
        return RIGGED, *_loaded(host, layer), f"calmotion rig {shlex.quote(name)} -o robot.usda"


def _loaded(host: Host, path: Path) -> tuple[Character, Animation]:
    data = _carried_out(host, [Source(path=str(path), command="inspect")], [Character, Animation])
    return data[Character], data[Animation]


def _carried_out(host: Host, given: list[object], wanted: list[type]) -> Any:
    run = host.run(given, wanted).finish()
    for failure in run.failures():
        raise failure.error or ShotError(failure.reason)
    return run.data


def table(rows: Sequence[Row]) -> str:
    """Rows as Markdown."""
    lines = [f"| {' | '.join(_COLUMNS)} |", f"|{' --- |' * len(_COLUMNS)}"]
    for row in rows:
        counts = [str(n) if row.line else "" for n in (row.bodies, row.motors, row.targets, row.frames)]
        told = f"`{row.line}`" if row.line else row.reason.replace("|", "/")
        lines.append(f"| {' | '.join([f'`{row.file}`', row.outcome, *counts, told])} |")
    return "\n".join(lines) + "\n"


def page(rows: Sequence[Row], titles: Sequence[str], command: str) -> str:
    """A page with a table, and the command that makes it."""
    loaded = sum(bool(row.line) for row in rows)
    summary = (
        f"These are {len(rows)} files of robots and characters that others made; {loaded} of them load. Where one is "
        "refused, the message names what to change. None of them is part of this repository. "
        "Two of them move in the [gallery](gallery.md#robots-that-others-built). "
        "What becomes of their links is on [another page](meshing.md)."
    )
    paths = f"Paths are those in {', '.join(titles)}. The page is made by"
    return f"# Robots and characters\n\n{summary}\n\n{paths}\n\n    {command}\n\n{table(rows)}"


def loaded_rows(text: str) -> dict[str, Row]:
    """The rows of a page of files that load, by file; their times are not in the page."""
    rows = {}
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if len(cells) == len(_COLUMNS) and cells[-1].startswith("`calmotion "):
            file, outcome, *counts, told = cells
            bodies, motors, targets, frames = map(int, counts)
            name = file.strip("`")
            rows[name] = Row(name, outcome, bodies, motors, targets, frames, 0.0, "known", told.strip("`"))
    return rows


def main(arguments: Sequence[str]) -> int:
    """The benchmark's command line."""
    parser = bench_parser("reading", "Which robots and characters of a folder load, and why the others do not.")
    parser.add_argument("folders", nargs="*", type=Path, metavar="FOLDER", help="folder with robots and characters")
    parser.add_argument("--import", dest="imports", action="store_true", help="also import URDF and MJCF robots")
    parser.add_argument("-o", "--output", type=Path, help="page to write (Markdown)")
    parser.add_argument("--again", action="store_true", help="keep what loads by the page, and try the rest again")
    parser.add_argument("--prims", type=int, metavar="N", help="read --shot with a set of so many prims around it")
    parser.add_argument("--shot", type=Path, default=Path("samples/drummer/drummer.usda"), help="shot of --prims")
    args = parser.parse_args(arguments)
    if args.prims:
        from calmotion.benchmarks.speed.large_stages import compare

        print(compare(args.shot, args.prims), end="")
        return 0
    if not args.folders:
        parser.error("name a folder, or --prims")
    known = loaded_rows(args.output.read_text(encoding="utf-8")) if args.again and args.output else {}
    rows: list[Row] = []
    for folder in args.folders:
        for row in study(folder, args.imports, known):
            rows.append(row)
            print(f"{row.file}: {row.outcome} ({row.reason}), {row.seconds:.2f} s", file=sys.stderr, flush=True)
    if args.output:
        names = [folder.name or folder.resolve().name for folder in args.folders]
        command = f"calmotion bench reading{' --import' if args.imports else ''} {' '.join(names)} -o {args.output}"
        args.output.write_text(page(rows, [f"`{name}`" for name in names], command), encoding="utf-8")
    print(table(rows), end="")
    return 0
