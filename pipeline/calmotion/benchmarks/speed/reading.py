"""Which shots of a folder load, and why the others do not.

`calmotion bench reading FOLDER ... [-o table.md]` reads every USD file as `calmotion inspect` does; for a skinned
character without physics it first makes a robot (`calmotion rig`). Files that another file beside or above
them opens as payload, reference or sublayer are parts, not shots, and are skipped.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

from calmotion.benchmarks.common.parsers import bench_parser
from calmotion.errors import ShotError, each
from calmotion.host import Host, open_host
from calmotion.shot import Animation, Character
from calmotion.shot.outputs import Rig
from calmotion.shot.run import OutputPaths, Source

LOADS, RIGGED, REFUSED = "loads", "loads as a robot", "refused"
_EXTENSIONS = (".usd", ".usda", ".usdc", ".usdz")


@dataclass(frozen=True)
class Row:
    """One file.

    Attributes:
        file: Relative to its folder.
        outcome: `LOADS`, `RIGGED` or `REFUSED`.
        bodies, joints, motors, frames: What is in it.
        seconds: It took [s].
        reason: Why it is refused, or what animates its motors.
    """

    file: str
    outcome: str
    bodies: int
    joints: int
    motors: int
    frames: int
    seconds: float
    reason: str


def shots_in(folder: Path) -> list[Path]:
    """The USD files of a folder but for those that one beside or above them opens."""
    from calmotion.usd import stages

    files = sorted(path for path in folder.rglob("*") if path.suffix in _EXTENSIONS)
    parts: set[Path] = set()
    for path in files:
        named = (Path(name).resolve() for name in stages.files_named_by(str(path)))
        parts |= {file for file in named if file.is_relative_to(path.resolve().parent)}
    return [path for path in files if path.resolve() not in parts]


def study(folder: Path) -> Iterator[Row]:
    """One row for each shot of a folder."""
    host = open_host([])
    for path in shots_in(folder):
        start = time.perf_counter()
        name = path.relative_to(folder).as_posix()
        try:
            outcome, character, animation = _read(host, path)
        except ShotError as error:
            reason = "; ".join(one.message() for one in each(error)).replace(f"{folder}/", "")
            yield Row(name, REFUSED, 0, 0, 0, 0, time.perf_counter() - start, reason)
            continue
        sources = sorted({motor.source for motor in character.motors})
        frames = len(animation.frame_times)
        yield Row(
            name, outcome, len(character.bodies), len(character.joints), len(character.motors), frames,
            time.perf_counter() - start, f"motors by {', '.join(sources)}" if frames > 1 else "no animation",
        )  # fmt: skip


def _read(host: Host, path: Path) -> tuple[str, Character, Animation]:
    try:
        return LOADS, *_loaded(host, path)
    except ShotError as error:
        if "calmotion rig" not in error.remedy:
            raise
    with tempfile.TemporaryDirectory() as folder:
        layer = Path(folder) / "rig.usda"
        _carried_out(host, [Source(path=str(path), command="rig"), OutputPaths(layer=str(layer))], [Rig])
        return RIGGED, *_loaded(host, layer)


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
    names = [field.name for field in fields(Row)]
    lines = [f"| {' | '.join(names)} |", f"|{' --- |' * len(names)}"]
    for row in rows:
        cells = [f"{cell:.2f}" if isinstance(cell, float) else str(cell) for cell in astuple(row)]
        lines.append(f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |")
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str]) -> int:
    """The benchmark's command line."""
    parser = bench_parser("reading", "Which shots of a folder load, and why the others do not.")
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER", help="folder with USD files")
    parser.add_argument("-o", "--output", type=Path, help="file for the table (Markdown)")
    args = parser.parse_args(arguments)
    rows: list[Row] = []
    for folder in args.folders:
        for row in study(folder):
            rows.append(row)
            print(f"{row.file}: {row.outcome} ({row.reason})", file=sys.stderr, flush=True)
    text = table(rows)
    if args.output:
        args.output.write_text(text, encoding="utf-8")
    print(text, end="")
    return 0
