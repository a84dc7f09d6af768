"""Long performances: `calmotion bench windows [SHOT] --seconds 10 60 600` optimises them, and prints time and memory.

A performance of a robot's shot is made of its own poses: at random times it moves from one pose of the shot to another,
with short rests. It is varied, not repeated, and a longer one begins as a shorter one does. Each is optimised by
`calmotion optimize` in a process of its own, whose memory is measured. With `--compare SECONDS` a performance of that
length is also optimised by one long search, and the distance of the targets between both is printed, and where it is
largest; a search that did not end by itself is told, as it says nothing about windows. Both end where
a window would gain less than 0.0001 of the tolerance (the one search by a mean over the whole performance, so that it
leaves as little in any second), and what is found does not depend on the windows. With `--single` one search over as
many seconds as a window has is the measure of the longest performance: its processor time times the number of windows.

Processor times are those to look at where others use the machine.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess  # nosec B404  # runs this program
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import markdown
from calmotion.benchmarks.shows.profiles import TargetErrors, apart, errors_table, target_errors
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
        targets: Their errors.
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
    targets: tuple[TargetErrors, ...]
    kept: bool
    stopped: str

    @property
    def worst(self) -> TargetErrors:
        """The target with the largest error after."""
        return max(self.targets, key=lambda target: target.after_mm)


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


def run_of(seconds: float, report: dict[str, Any], csv_file: Path) -> LongRun:
    """What is measured of a run, by its report and the table that it wrote."""
    return LongRun(
        seconds, max(1, len(report["windows"])), report["wall_s"], report["total_wall_s"],
        report["processor_s"], report["total_processor_s"],
        report["peak_memory_gb"] or float("nan"),
        target_errors(report, csv_file), report["tolerance_kept"], report["stopped"],
    )  # fmt: skip


def exponent(runs: Sequence[LongRun]) -> float:
    """Slope of log(processor time of the search) over log(length); NaN of one run."""
    if len(runs) < 2:
        return float("nan")
    return float(
        np.polyfit(np.log([run.seconds for run in runs]), np.log([run.search_processor_s for run in runs]), 1)[0]
    )


def table(runs: Sequence[LongRun]) -> str:
    """The runs as Markdown, with the target that is farthest off."""
    heads = ["length", "windows", "search", "its processor time", "whole run", "processor time", "memory"]
    heads += ["error before", "after", "rms after", "target", "tolerance"]
    rows = [
        [
            f"{run.seconds:g} s", str(run.windows), f"{run.search_s:.1f} s", f"{run.search_processor_s:.1f} s",
            f"{run.total_s:.1f} s", f"{run.processor_s:.1f} s", f"{run.memory_gb:.2f} GB",
            f"{run.worst.before_mm:.1f} mm", f"{run.worst.after_mm:.2f} mm", f"{run.worst.rms_mm:.2f} mm",
            run.worst.path.rpartition("/")[2], "kept" if run.kept else "missed",
        ]
        for run in runs
    ]  # fmt: skip
    return markdown(heads, rows)


def longest_of(runs: Sequence[LongRun]) -> LongRun:
    """The run of the longest performance."""
    return max(runs, key=lambda run: run.seconds)


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
    single, compared, gap = None, [], None
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)

        def measured(seconds: float, name: str, own: Sequence[str]) -> LongRun:
            files = write_performance(shot, seconds, folder)
            report = optimized(*files, [*options, *own], folder, name)
            return run_of(seconds, report, folder / f"{name}.csv")

        runs = [measured(seconds, f"windows_{seconds:g}", windows) for seconds in args.seconds]
        longest = longest_of(runs)
        if args.single:
            single = measured(longest.seconds / longest.windows, "single", ["--window=0"])
        if args.compare:
            compared = [measured(args.compare, *one) for one in (("parts", windows), ("whole", ["--window=0"]))]
            gap = apart(folder / "parts.csv", folder / "whole.csv")
    if args.json:
        found: dict[str, Any] = {"runs": [asdict(run) for run in runs], "exponent": exponent(runs)}
        found["single"] = asdict(single) if single else None
        pair = dict(zip(("windows", "one_search"), map(asdict, compared), strict=True)) if gap else {}
        print(json.dumps(found | {"compared": pair | asdict(gap) if gap else None}))
        return 0
    print(table(runs), f"time of the search grows with length to the power {exponent(runs):.2f}", sep="")
    print(f"errors over {longest.seconds:g} s:", errors_table(longest.targets), sep="\n", end="")
    if single:
        ratio = longest.search_processor_s / (longest.windows * single.search_processor_s)
        print(
            f"one search over {single.seconds:.3g} s takes {single.search_processor_s:.1f} s of processor time; "
            f"{longest.seconds:g} s in {longest.windows} windows take {ratio:.2f} times as much as all of them alone"
        )
    if gap:
        print(table(compared), end="")
        print(
            f"{args.compare:g} s in windows and in one search: targets are up to {1e3 * gap.distance_m:.3f} mm apart, "
            f"their errors differ by up to {1e3 * gap.profile_m:.3f} mm (at {gap.profile_s:.2f} s), by "
            f"{1e3 * gap.profile_rms_m:.3f} mm rms; searches of {compared[0].search_s:.1f} s and "
            f"{compared[1].search_s:.1f} s"
        )
        for name, run in zip(("in windows", "over all"), compared, strict=True):
            if run.stopped != "converged":
                print(f"the search {name} did not end by itself ({run.stopped}): the comparison says little")
    return 0
