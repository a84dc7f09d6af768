"""Long performances: `calmotion bench windows [SHOT] --seconds 10 60 600` optimises them, and prints time and memory.

A performance of a robot's shot is made of its own poses: at random times it moves from one pose of the shot to another,
with short rests. It is varied, not repeated, and a longer one begins as a shorter one does. Each is optimised by
`calmotion optimize` in a process of its own, whose memory is measured. With `--compare SECONDS` a performance of that
length is also optimised by one long search, and the distance of the targets between both is printed, and where it is
largest; a search that did not end by itself is told, as it says nothing about windows. Both end where
a window would gain less than 0.0003 of the tolerance (the one search by a mean over the whole performance, so that it
leaves as little in any second), and what is found does not depend on the windows. With `--single` one search over as
many seconds as a window has is the measure of the longest performance: its processor time times the number of windows.

Processor times are those to look at where others use the machine.
"""

from __future__ import annotations

import csv
import json
import os
import resource
import subprocess  # nosec B404  # runs this program
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import markdown
from calmotion.errors import ShotError
from calmotion.shot.character import Array
from calmotion.shot.curves import held_curve
from calmotion.workflow.shot import Shot

SHOT = "samples/bartender/bartender.usda"
MOVE, REST = (0.5, 1.1), (0.0, 0.5)  # shortest and longest [s]
SEED = 20


@dataclass(frozen=True)
class LongRun:
    """One performance that was optimised.

    Attributes:
        seconds: Its length [s].
        windows: Number of its windows.
        search_s, total_s: Time of the search, and of the whole run [s].
        search_processor_s, processor_s: Processor time of both [s].
        memory_gb: Most that its process had [GB].
        before_mm, after_mm: Largest error of a target.
        rms_mm: Root mean square of the error after, of the target with the largest one.
        kept: Whether the simulation keeps the tolerance.
        stopped: Why the search ended: `converged`, or what ended it before.
    """

    seconds: float
    windows: int
    search_s: float
    total_s: float
    search_processor_s: float
    processor_s: float
    memory_gb: float
    before_mm: float
    after_mm: float
    rms_mm: float
    kept: bool
    stopped: str


def performance(shot: Shot, seconds: float, seed: int = SEED) -> dict[str, Array]:
    """Columns of a motion: times [s] and the value of each motor [rad or m].

    Args:
        shot: Whose poses it is made of.
        seconds: Its length [s].
        seed: Another one is another performance.
    """
    animation = shot.animation
    frames = animation.frame_times
    poses = np.stack([held_curve(track, frames[-1])(frames, 0) for track in animation.tracks], axis=1)
    times = np.arange(round(seconds / frames[1]) + 1) * frames[1]
    random, values = np.random.default_rng(seed), np.tile(poses[0], (len(times), 1))
    pose, start = poses[0], 0.3
    while start < seconds - MOVE[1]:
        length, following = random.uniform(*MOVE), poses[random.integers(len(poses))]
        s = np.clip((times - start) / length, 0.0, 1.0)
        values += (s**3 * (10.0 - 15.0 * s + 6.0 * s * s))[:, None] * (following - pose)
        pose, start = following, start + length + random.uniform(*REST)
    return {"time_s": times} | {path: values[:, k] for k, path in enumerate(shot.motors)}


def write_performance(shot: Shot, seconds: float, folder: Path) -> tuple[Path, Path]:
    """Write a root layer that is as long as a performance, and its motion.

    Raises:
        ShotError: The shot cannot be processed.
    """
    columns, provenance = performance(shot, seconds), shot.provenance
    motion, root = folder / f"motion_{seconds:g}.npz", folder / f"shot_{seconds:g}.usda"
    np.savez(motion, **columns)  # type: ignore[arg-type]
    start = provenance.start_time_code
    end = start + seconds * provenance.time_codes_per_second
    fields = {
        "startTimeCode": f"{start:g}", "endTimeCode": f"{end:g}",
        "timeCodesPerSecond": f"{provenance.time_codes_per_second:g}",
        "framesPerSecond": f"{provenance.frames_per_second:g}",
        "metersPerUnit": f"{provenance.meters_per_unit:g}", "kilogramsPerUnit": f"{provenance.kilograms_per_unit:g}",
        "upAxis": json.dumps(provenance.up_axis), "defaultPrim": json.dumps(provenance.default_prim),
        "subLayers": f"[@{Path(shot.path).resolve()}@]",
    }  # fmt: skip
    lines = "\n".join(f"    {name} = {value}" for name, value in fields.items())
    root.write_text(f"#usda 1.0\n(\n{lines}\n)\n", encoding="utf-8")
    return root, motion


def optimized(root: Path, motion: Path, options: Sequence[str], folder: Path, name: str) -> dict[str, Any]:
    """The object of `calmotion optimize --json`, run in a process of its own.

    Raises:
        ShotError: It failed.
    """
    line = [sys.executable, "-m", "calmotion", "optimize", str(root), "-o", str(folder / f"{name}.usda")]
    line += ["--motion", str(motion), "--csv", str(folder / f"{name}.csv"), "--json", "--quiet", *options]
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(line, capture_output=True, text=True, env=dict(os.environ))  # nosec B603  # no shell
    try:
        report: dict[str, Any] = json.loads(done.stdout)
    except ValueError:
        report = {"error": {"problem": done.stderr.strip() or f"status {done.returncode}"}}
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    report["total_processor_s"] = end.ru_utime - begin.ru_utime + end.ru_stime - begin.ru_stime
    if "error" in report:
        raise ShotError(report["error"]["problem"], path=str(root), found=report["error"].get("found") or None)
    return report


def run_of(seconds: float, report: dict[str, Any]) -> LongRun:
    """What is measured of a run."""
    worst = max(report["targets"], key=lambda row: float(row["max_error_after_m"]))
    return LongRun(
        seconds, max(1, len(report["windows"])), report["wall_s"], report["total_wall_s"],
        report["processor_s"], report["total_processor_s"],
        report["peak_memory_gb"] or float("nan"),
        1e3 * max(row["max_error_before_m"] for row in report["targets"]), 1e3 * worst["max_error_after_m"],
        1e3 * worst["rms_error_after_m"], report["tolerance_kept"], report["stopped"],
    )  # fmt: skip


def exponent(runs: Sequence[LongRun]) -> float:
    """Slope of log(processor time of the search) over log(length); NaN of one run."""
    if len(runs) < 2:
        return float("nan")
    return float(
        np.polyfit(np.log([run.seconds for run in runs]), np.log([run.search_processor_s for run in runs]), 1)[0]
    )


def table(runs: Sequence[LongRun]) -> str:
    """The runs as Markdown."""
    heads = ["length", "windows", "search", "its processor time", "whole run", "processor time", "memory"]
    heads += ["error before", "after", "rms after", "tolerance"]
    rows = [
        [
            f"{run.seconds:g} s", str(run.windows), f"{run.search_s:.1f} s", f"{run.search_processor_s:.1f} s",
            f"{run.total_s:.1f} s", f"{run.processor_s:.1f} s",
            f"{run.memory_gb:.2f} GB", f"{run.before_mm:.1f} mm", f"{run.after_mm:.2f} mm", f"{run.rms_mm:.2f} mm",
            "kept" if run.kept else "missed",
        ]
        for run in runs
    ]  # fmt: skip
    return markdown(heads, rows)


@dataclass(frozen=True)
class Apart:
    """How far two results of the same performance are from each other.

    Attributes:
        distance_m: Largest distance between a target in the one and in the other [m].
        profile_m: Largest difference of the errors of a target [m].
        profile_s: When that is [s].
        profile_rms_m: Root mean square of the difference, of the target with the largest one [m].
    """

    distance_m: float
    profile_m: float
    profile_s: float
    profile_rms_m: float


def apart(one: Path, two: Path) -> Apart:
    """How far two tables are from each other; their steps may differ."""
    first, second = _columns(one), _columns(two)
    at = first["time_s"][first["time_s"] >= -1e-9]
    distance, found = 0.0, Apart(0.0, 0.0, 0.0, 0.0)
    for name in (name for name in first if name.endswith(".error") and not name.endswith("rotation_error")):
        parts = [f"{name.removesuffix('.error')}{axis}" for axis in (".x", ".y", ".z")]
        gaps = [_at(first, part, at) - _at(second, part, at) for part in parts]
        distance = max(distance, float(np.linalg.norm(gaps, axis=0).max()))
        profile = np.abs(_at(first, name, at) - _at(second, name, at))
        k, rms = int(np.argmax(profile)), float(np.sqrt(np.mean(profile**2)))
        found = max(found, Apart(0.0, float(profile[k]), float(at[k]), rms), key=lambda part: part.profile_m)
    return replace(found, distance_m=distance)


def _at(columns: dict[str, Array], name: str, times: Array) -> Array:
    return np.interp(times, columns["time_s"], columns[name])


def _columns(path: Path) -> dict[str, Array]:
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    values = np.array(rows[1:], float)
    return {name: values[:, k] for k, name in enumerate(rows[0])}


def main(arguments: Sequence[str]) -> int:
    """Measure and print; the exit status."""
    parser = bench_parser("windows", __doc__)
    parser.add_argument("shot", metavar="SHOT", nargs="?", default=SHOT, help=f"USD file (default: {SHOT})")
    parser.add_argument("--seconds", nargs="+", type=float, default=[10.0, 20.0, 40.0], help="lengths of performances")
    parser.add_argument("--window", default=None, help="length of the windows (default: automatic)")
    parser.add_argument("--tolerance", default="1mm")
    parser.add_argument("--compare", type=float, metavar="SECONDS", help="also compare with one long search")
    parser.add_argument("--single", action="store_true", help="also search one window's seconds by themselves")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="property of an operator")
    output_options(parser)
    args = parser.parse_args(arguments)
    options = [f"--tolerance={args.tolerance}", *(f"--set={text}" for text in args.set)]
    windows = [] if args.window is None else [f"--window={args.window}"]
    shot = Shot(args.shot).read()
    compared: dict[str, Any] | None = None
    with tempfile.TemporaryDirectory() as temporary:
        folder, runs = Path(temporary), []
        for seconds in args.seconds:
            files = write_performance(shot, seconds, folder)
            runs.append(run_of(seconds, optimized(*files, [*options, *windows], folder, f"windows_{seconds:g}")))
        single = None
        if args.single:
            length = max(args.seconds) / max(1, runs[int(np.argmax(args.seconds))].windows)
            files = write_performance(shot, length, folder)
            single = run_of(length, optimized(*files, [*options, "--window=0"], folder, "single"))
        if args.compare:
            files = write_performance(shot, args.compare, folder)
            both = [[*options, *windows], [*options, "--window=0"]]
            reports = [optimized(*files, o, folder, f"compare_{k}") for k, o in enumerate(both)]
            gap = apart(folder / "compare_0.csv", folder / "compare_1.csv")
            own = [asdict(run_of(args.compare, report)) for report in reports]
            compared = {"windows": own[0], "one_search": own[1], **asdict(gap)}
    found: dict[str, Any] = {"runs": [asdict(run) for run in runs], "exponent": exponent(runs), "compared": compared}
    found["single"] = asdict(single) if single else None
    if args.json:
        print(json.dumps(found))
        return 0
    print(table(runs), f"time of the search grows with length to the power {exponent(runs):.2f}", sep="")
    if single:
        longest = max(runs, key=lambda run: run.seconds)
        ratio = longest.search_processor_s / (longest.windows * single.search_processor_s)
        print(
            f"one search over {single.seconds:.3g} s takes {single.search_processor_s:.1f} s of processor time; "
            f"{longest.seconds:g} s in {longest.windows} windows take {ratio:.2f} times as much as all of them alone"
        )
    if compared:
        print(table([LongRun(**compared["windows"]), LongRun(**compared["one_search"])]), end="")
        print(
            f"{args.compare:g} s in windows and in one search: targets are up to {1e3 * compared['distance_m']:.3f} mm "
            f"apart, their errors differ by up to {1e3 * compared['profile_m']:.3f} mm (at "
            f"{compared['profile_s']:.2f} s), by {1e3 * compared['profile_rms_m']:.3f} mm rms; searches of "
            f"{compared['windows']['search_s']:.1f} s and {compared['one_search']['search_s']:.1f} s"
        )
        for name, row in (("in windows", "windows"), ("over all", "one_search")):
            if (stopped := compared[row]["stopped"]) != "converged":
                print(f"the search {name} did not end by itself ({stopped}): the comparison says little")
    return 0
