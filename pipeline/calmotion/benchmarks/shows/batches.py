"""Batches on a Dask cluster of this machine: `calmotion bench batch [SHOT] --shots 20`.

Short performances of a robot's shot, each another one, are optimised by `calmotion batch --on dask://...`:

- by one worker, then by two: the speed-up;
- by two, of which one is killed with -9 while it works;
- by two, with a scheduler that is killed with -9 with its workers, and started again;
- by a command that is killed with -9, and given once more.

Nothing may be lost, and all curves must be those of the first run to the last bit. Each worker is bound to one
processor. Where others use the machine, its clock tells little: the balance of the workers is the processor time of all
jobs over that of the worker with the most, the speed-up that free processors would give.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess  # nosec B404  # runs this program
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import markdown
from calmotion.benchmarks.shows.cluster import Cluster
from calmotion.benchmarks.shows.windows import SEED, SHOT, performance
from calmotion.errors import ShotError
from calmotion.usd.writing.performances import write_performance
from calmotion.workflow.shot import Shot

_TICK = 0.1  # between two looks at a batch [s]
_GRACE = 2.0  # between the death of a scheduler and its return [s]


@dataclass(frozen=True)
class BatchRun:
    """One batch.

    Attributes:
        name: What happened in it.
        wall_s, processor_s: Time that it took, and processor time of its jobs [s].
        balance: Processor time of all jobs over that of the worker with the most; NaN where workers came or went.
        done, shots: Jobs that have a result, and all.
        again: Jobs that were begun more than once.
        equal: Whether all curves are those of the first batch to the last bit.
    """

    name: str
    wall_s: float
    processor_s: float
    balance: float
    done: int
    shots: int
    again: int
    equal: bool


def write_shots(shot: Shot, count: int, seconds: float, folder: Path) -> list[Path]:
    """Shots of different performances.

    Args:
        shot: Whose poses they are made of; its motors are animated by drives.
        seconds: Their length [s].
    """
    provenance = replace(shot.provenance, shot=os.path.abspath(shot.path))
    paths = []
    for k in range(count):
        columns = performance(shot, seconds, SEED + k)
        motion = columns["time_s"], np.stack([columns[path] for path in shot.motors], axis=1)
        path = folder / f"take_{k:02d}.usda"
        write_performance(str(path), provenance, shot.character, motion, {})
        paths.append(path)
    return paths


class _Bench:
    """The batches of one measurement."""

    def __init__(self, shots: Sequence[Path], folder: Path, options: Sequence[str], show: Callable[[str], None]):
        self._shots, self._folder, self._options, self._show = shots, folder, options, show
        self._first: dict[str, str] = {}
        self.runs: list[BatchRun] = []

    def run(self, name: str, workers: int, trouble: Callable[[Cluster, _Command], None] | None = None) -> None:
        """A batch on so many workers, in which something happens once a quarter of the shots is done."""
        self._show(name)
        logs = self._folder / f"cluster_{len(self.runs)}"
        logs.mkdir()
        cluster = Cluster(logs, workers)
        try:
            line = [sys.executable, "-m", "calmotion", "batch", *map(str, self._shots), "-o"]
            line += [str(self._folder / f"batch_{len(self.runs)}"), "--on", cluster.address, "--quiet", *self._options]
            begin, command = time.perf_counter(), _Command(line, Path(line[line.index("-o") + 1]))
            command.start()
            if trouble is not None:
                command.wait_for(max(1, len(self._shots) // 4))
                trouble(cluster, command)
            command.wait()
            wall = time.perf_counter() - begin
        finally:
            cluster.close()
        self.runs.append(self._judged(name, wall, command.jobs(), trouble is None))

    def _judged(self, name: str, wall: float, jobs: Sequence[Mapping[str, Any]], whole: bool) -> BatchRun:
        curves = {job["name"]: _hash(job["layer"]) for job in jobs if job["layer"]}
        self._first = self._first or curves
        spent: dict[str, float] = {}
        for job in jobs:
            spent[job["worker"]] = spent.get(job["worker"], 0.0) + (job["processor_s"] or 0.0)
        total, most = sum(spent.values()), max(spent.values(), default=0.0)
        return BatchRun(
            name, wall, total, total / most if whole and most else float("nan"), len(curves), len(self._shots),
            sum(job["attempts"] > 1 for job in jobs), curves == self._first and len(curves) == len(self._shots),
        )  # fmt: skip


class _Command:
    """`calmotion batch`, in a process of its own.

    Args:
        line: The command.
        folder: Of its results.
    """

    def __init__(self, line: Sequence[str], folder: Path):
        self._line, self._folder = line, folder
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        self._process = subprocess.Popen(self._line, stderr=subprocess.PIPE, text=True)  # nosec B603  # no shell

    def jobs(self) -> list[dict[str, Any]]:
        """What its report says of the jobs; nothing as long as there is none."""
        try:
            found: list[dict[str, Any]] = json.loads((self._folder / "batch.json").read_text(encoding="utf-8"))["jobs"]
        except (OSError, ValueError):
            return []
        return found

    def wait_for(self, count: int) -> None:
        """Until so many jobs are done, and another one has begun."""
        assert self._process is not None
        while self._process.poll() is None:
            done = sum(job["outcome"] == "done" for job in self.jobs())
            if done >= count and len(list((self._folder / "logs").glob("*.log"))) > done:
                return
            time.sleep(_TICK)

    def kill(self) -> None:
        """End it with -9."""
        assert self._process is not None
        os.kill(self._process.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
        self._process.wait()

    def wait(self) -> None:
        """Until its end.

        Raises:
            ShotError: It ended otherwise than by a report.
        """
        assert self._process is not None
        text = self._process.communicate()[1]
        if not self.jobs():
            raise ShotError("the batch made no report", path=str(self._folder), found=text.strip()[-500:] or None)


def kill_worker(cluster: Cluster, command: _Command) -> None:
    """End the first worker with -9; nobody takes its place."""
    cluster.kill_worker(0)


def restart_scheduler(cluster: Cluster, command: _Command) -> None:
    """End scheduler and workers with -9, and start others at the same address."""
    cluster.kill_scheduler()
    time.sleep(_GRACE)
    cluster.start()


def repeat_command(cluster: Cluster, command: _Command) -> None:
    """End the command with -9, and give it once more."""
    command.kill()
    command.start()


def _hash(layer: str) -> str:
    return hashlib.sha256(Path(layer).read_bytes()).hexdigest()


def table(runs: Sequence[BatchRun]) -> str:
    """The batches as Markdown."""
    heads = ["batch", "time", "processor time", "balance", "shots done", "begun again", "curves"]
    rows = []
    for run in runs:
        balance = f"{run.balance:.2f}" if np.isfinite(run.balance) else ""
        times = f"{run.wall_s:.0f} s", f"{run.processor_s:.0f} s", balance
        curves = "the same" if run.equal else "DIFFERENT"
        rows.append([run.name, *times, f"{run.done} of {run.shots}", str(run.again), curves])
    return markdown(heads, rows)


def main(arguments: Sequence[str]) -> int:
    """Measure and print; 0 where nothing was lost, and no curve differs."""
    parser = bench_parser("batch", __doc__)
    parser.add_argument("shot", metavar="SHOT", nargs="?", default=SHOT, help=f"USD file (default: {SHOT})")
    parser.add_argument("--shots", type=int, default=20, help="number of performances (default: 20)")
    parser.add_argument("--seconds", type=float, default=2.0, help="their length (default: 2)")
    parser.add_argument("--tolerance", default="1mm")
    output_options(parser)
    args = parser.parse_args(arguments)
    shot = Shot(args.shot).read()

    def show(name: str) -> None:
        print(f"batch: {name}", file=sys.stderr, flush=True)

    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        shots = write_shots(shot, args.shots, args.seconds, folder)
        show("meshes and kernels, once")
        line = [sys.executable, "-m", "calmotion", "optimize", str(shots[0]), "-o", str(folder / "first.usda")]
        subprocess.run([*line, "--quiet", f"--tolerance={args.tolerance}"], check=False)  # nosec B603  # no shell
        bench = _Bench(shots, folder, [f"--tolerance={args.tolerance}"], show)
        bench.run("one worker", 1)
        bench.run("two workers", 2)
        bench.run("one of two killed", 2, kill_worker)
        bench.run("scheduler killed and started again", 2, restart_scheduler)
        bench.run("command killed and given again", 2, repeat_command)
    one, two = bench.runs[:2]
    speedup = one.wall_s / two.wall_s
    if args.json:
        print(json.dumps({"runs": [asdict(run) for run in bench.runs], "speedup": speedup}).replace("NaN", "null"))
    else:
        print(table(bench.runs), end="")
        print(f"two workers are {speedup:.2f} times as fast as one; free processors would give {two.balance:.2f}")
    return 0 if all(run.equal for run in bench.runs) else 1
