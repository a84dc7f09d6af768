"""Repertoires: `calmotion bench sequence SHOTS... --clips 10` cuts shots of one robot into clips, and joins them.

The clips are parts of equal length, spread over the shots; the time within each is eased, so that it begins and ends at
rest. `calmotion sequence` then retargets them with the transitions between any two, in one command, whose table,
failures, time and processor time are printed.
"""

from __future__ import annotations

import json
import os
import subprocess  # nosec B404  # runs this program
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.errors import ShotError
from calmotion.shot.character import Array
from calmotion.shot.curves import held_curve
from calmotion.usd.writing.performances import write_performance
from calmotion.workflow.shot import Shot


def clip_of(shot: Shot, start: float, length: float, slower: float = 1.0) -> tuple[Array, Array]:
    """A part of a shot that begins and ends at rest for two frames: its time is eased by a quintic, and nearly
    twice as fast in the middle.

    Args:
        shot: Animated by drives.
        start: Where it begins [s].
        length: Of the part [s]; the clip is four frames longer.
        slower: How many times as long the clip takes: its middle is nearly twice as fast as the shot.

    Returns:
        Times [s], shape [f], and values of the motors [rad or m], shape [f, M].
    """
    frames = shot.animation.frame_times
    moving = max(4, round(slower * length / frames[1]))
    times = np.arange(moving + 5) * frames[1]
    s = np.clip((times / frames[1] - 2.0) / moving, 0.0, 1.0)
    within = start + length * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    values = [held_curve(track, frames[-1])(within, 0) for track in shot.animation.tracks]
    return times, np.stack(values, axis=1)


def write_clips(shots: Sequence[Shot], count: int, length: float, folder: Path, slower: float = 1.0) -> Path:
    """Write clips of shots, and the file that lists them.

    Args:
        shots: Of one robot.
        count: Number of clips; each shot has as many as the others, or one more.
        length: Of the part of the shot that a clip is [s].
        slower: As of `clip_of`.

    Raises:
        ShotError: A shot is too short.
    """
    lines = ["[clips]"]
    for k, shot in enumerate(shots):
        own, end = len(range(k, count, len(shots))), float(shot.animation.frame_times[-1])
        if own * length > end:
            raise ShotError(
                f"the shot is too short for {own} clips of {length:g} s", path=shot.path, found=f"{end:.3g} s",
                remedy="Use fewer or shorter clips",
            )  # fmt: skip
        provenance = replace(shot.provenance, shot=os.path.abspath(shot.path))
        for n, start in enumerate(np.linspace(0.0, end - length, own)):
            name = f"{chr(ord('a') + k)}{n}"
            motion = clip_of(shot, float(start), length, slower)
            write_performance(str(folder / f"{name}.usda"), provenance, shot.character, motion, {})
            lines.append(f'{name} = "{name}.usda"')
    path = folder / "clips.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def made(clips: Path, output: Path, options: Sequence[str]) -> dict[str, Any]:
    """The object of `calmotion sequence --json`, with its processor time.

    Raises:
        ShotError: It was refused.
    """
    line = [sys.executable, "-m", "calmotion", "sequence", str(clips), "-o", str(output), "--json", "--quiet", *options]
    begin = time.perf_counter()
    done = subprocess.run(line, capture_output=True, text=True, check=False)  # nosec B603  # no shell
    try:
        report: dict[str, Any] = json.loads(done.stdout)
    except ValueError:
        report = {"error": {"problem": done.stderr.strip()[-500:] or f"status {done.returncode}"}}
    if "error" in report:
        raise ShotError(report["error"]["problem"], path=report["error"].get("path") or str(clips))
    jobs = json.loads((output / "batch.json").read_text(encoding="utf-8"))["jobs"]
    spent = [job["processor_s"] or 0.0 for job in jobs]
    return report | {"total_wall_s": time.perf_counter() - begin, "processor_s": sum(spent)}


def summary(report: dict[str, Any]) -> str:
    """What came of it, one line each."""
    members = [*report["clips"], *report["transitions"]]
    errors = [member["error_m"] for member in members if member["error_m"] is not None]
    before = [member["error_before_m"] for member in members if member["error_before_m"] is not None]
    bad = [member for member in members if not member["good"]]
    lines = [
        f"{len(report['clips'])} clips and {len(report['transitions'])} transitions in {report['total_wall_s']:.0f} s, "
        f"{report['processor_s']:.0f} s of processor time",
        f"largest error {1e3 * max(before, default=0.0):.2f} mm before, {1e3 * max(errors, default=0.0):.2f} mm after",
        f"{len(members) - len(bad)} of {len(members)} within tolerance and limits, and joined",
    ]
    for member in bad:
        reasons = [] if member["within_tolerance"] else ["tolerance missed"]
        reasons += [f"exceeds {limit}" for limit in member["exceeded_limits"]]
        reasons += [] if member["joined"] else ["ends changed"]
        problem = (member["problem"] or {}).get("problem")
        lines.append(f"  {member['name']}: {problem or ', '.join(reasons)}")
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> int:
    """Measure and print; 0 where every clip may follow every other one."""
    parser = bench_parser("sequence", __doc__)
    parser.add_argument("shots", metavar="SHOTS", nargs="+", help="USD files of one robot, animated by drives")
    parser.add_argument("--clips", type=int, default=10, help="number of clips (default: 10)")
    parser.add_argument("--seconds", type=float, default=1.0, help="length of their parts of the shots (default: 1)")
    parser.add_argument("--slower", type=float, default=1.0, help="how many times as long a clip takes (default: 1)")
    parser.add_argument("--workers", type=int, default=2, help="of `calmotion sequence` (default: 2)")
    parser.add_argument("--tolerance", default="1mm")
    parser.add_argument("--step", help="fixed time step, such as 5ms (default: automatic)")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="property of an operator")
    parser.add_argument("--keep", metavar="DIR", help="folder for clips and results (default: a temporary one)")
    output_options(parser)
    args = parser.parse_args(arguments)
    options = [f"--tolerance={args.tolerance}", f"--workers={args.workers}", *(f"--set={text}" for text in args.set)]
    options += [f"--step={args.step}"] if args.step else []
    shots = [Shot(path).read() for path in args.shots]
    with nullcontext(args.keep) if args.keep else tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        folder.mkdir(parents=True, exist_ok=True)
        report = made(write_clips(shots, args.clips, args.seconds, folder, args.slower), folder / "repertoire", options)
    if args.json:
        print(json.dumps({key: value for key, value in report.items() if key != "page"}))
    else:
        print(report["page"], summary(report), sep="\n")
    return 0 if report["good"] else 1
