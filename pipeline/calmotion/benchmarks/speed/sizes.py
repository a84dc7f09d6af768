"""Growth of whole runs: `calmotion bench sizes` optimises shots of ever more bodies, motors and frames.

Each shot has small arms of five flexible links on one base (`scenes.many_arms`) and is optimised as by `calmotion
optimize`, each in a process of its own with empty caches of meshes and reductions. Processor times of its stages and
the peak of its memory must grow no faster than what grows: exit status 1 when the exponent between the last two sizes
exceeds 1.15 where both take more than a second.
"""

from __future__ import annotations

import json
import os
import subprocess  # nosec B404  # runs this program
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import markdown
from calmotion.benchmarks.scenes.many_arms import write_many_arms
from calmotion.benchmarks.speed.stages import STAGES
from calmotion.support.caching.cache_folder import MESHES, REDUCTIONS, cache_folder

EXPONENT, LEAST = 1.15, 1.0  # largest growth that counts as linear, and shortest times that are compared [s]
# What grows, and the bodies, motors and frames of its shots.
LAWS: dict[str, tuple[tuple[int, int, int], ...]] = {
    "bodies and motors": tuple((count, count, 24) for count in (10, 25, 50, 100, 200)),
    "motors": tuple((50, count, 24) for count in (10, 25, 50)),
    "frames": tuple((5, 5, count) for count in (48, 192, 768, 3072)),
}
QUICK: dict[str, tuple[tuple[int, int, int], ...]] = {"bodies and motors": ((1, 1, 12), (2, 2, 12))}
_RUN = (
    "import json, sys\n"
    "from calmotion.benchmarks.speed.stages import measure\n"
    "found = measure(sys.argv[1])\n"
    "with open('/proc/self/status') as status:\n"
    "    peak = next((int(line.split()[1]) / 1e3 for line in status if line.startswith('VmHWM')), 0.0)\n"
    "print(json.dumps([dict(found.used), found.simulations, peak]))\n"
)


@dataclass(frozen=True)
class Run:
    """An optimisation.

    Attributes:
        law: What grows.
        bodies, motors, frames: Of the shot.
        used: Processor time of its stages, without compiling [s].
        sweeps: Simulated and linearised sweeps of the search.
        memory_mb: Peak of its process [MB].
    """

    law: str
    bodies: int
    motors: int
    frames: int
    used: dict[str, float]
    sweeps: int
    memory_mb: float

    @property
    def total(self) -> float:
        """Processor time of the run [s]."""
        return sum(self.used.values())

    @property
    def size(self) -> int:
        """What grows."""
        return {"bodies and motors": self.bodies, "motors": self.motors, "frames": self.frames}[self.law]


def measured(law: str, bodies: int, motors: int, frames: int) -> Run:
    """Optimise a shot in a process of its own, with empty caches of meshes and reductions.

    Raises:
        CalledProcessError: The run fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        shot = write_many_arms(Path(folder) / "arms.usda", bodies, motors, frames)
        caches = Path(folder) / "cache"
        caches.mkdir()
        for kept in cache_folder().iterdir():  # kernels would be compiled for minutes
            if kept.name not in (MESHES, REDUCTIONS):
                (caches / kept.name).symlink_to(kept)
        done = subprocess.run(  # nosec B603  # no shell
            [sys.executable, "-c", _RUN, str(shot)], stdout=subprocess.PIPE, text=True, check=True,
            env=os.environ | {"CALMOTION_CACHE": str(caches)},
        )  # fmt: skip
    used, sweeps, memory = json.loads(done.stdout.splitlines()[-1])
    return Run(law, bodies, motors, frames, {k: v for k, v in used.items() if k != "compile"}, sweeps, memory)


def exponents(runs: Sequence[Run]) -> dict[str, float]:
    """Growth between the last two sizes of a law, of the stages that take long enough, and of the whole."""
    if len(runs) < 2:
        return {}
    first, last = runs[-2:]
    ratio = np.log(last.size / first.size)
    pairs = {name: (first.used.get(name, 0.0), last.used.get(name, 0.0)) for name in (*STAGES, "other")}
    pairs["all"] = (first.total, last.total)
    return {name: float(np.log(more / less) / ratio) for name, (less, more) in pairs.items() if min(less, more) > LEAST}


def table(runs: Sequence[Run]) -> str:
    """The runs and their exponents as Markdown."""
    stages = [name for name in STAGES if name != "compile"]
    heads = ["bodies", "motors", "frames", *stages, "all [s]", "sweeps", "memory [MB]"]
    rows = []
    for law in dict.fromkeys(run.law for run in runs):
        chosen = [run for run in runs if run.law == law]
        for run in chosen:
            times = [f"{run.used.get(name, 0.0):.1f}" for name in stages]
            sizes = [str(run.bodies), str(run.motors), str(run.frames)]
            rows.append([*sizes, *times, f"{run.total:.1f}", str(run.sweeps), f"{run.memory_mb:.0f}"])
        found = exponents(chosen)
        if found:
            grown = [f"{found[name]:.2f}" if name in found else "" for name in (*stages, "all")]
            rows.append([f"exponent of {law}", "", "", *grown, "", ""])
    return markdown(heads, rows, "---:")


def _runs(laws: dict[str, tuple[tuple[int, int, int], ...]]) -> Iterator[Run]:
    for law, sizes in laws.items():
        for size in sizes:
            yield measured(law, *size)


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when the cost grows faster than the problem."""
    parser = bench_parser("sizes", __doc__)
    output_options(parser)
    parser.add_argument("--quick", action="store_true", help="two small shots")
    parser.add_argument("--only", choices=tuple(LAWS), action="append", help="what grows (default: all)")
    options = parser.parse_args(arguments)
    laws = QUICK if options.quick else {law: LAWS[law] for law in options.only or LAWS}
    runs = []
    for run in _runs(laws):
        runs.append(run)
        print(f"{run.bodies} bodies, {run.frames} frames: {run.total:.1f} s", file=sys.stderr, flush=True)
    grown = {law: exponents([run for run in runs if run.law == law]) for law in laws}
    if options.json:
        print(json.dumps({"runs": [asdict(run) for run in runs], "exponents": grown}))
    else:
        print(table(runs))
    return int(any(value > EXPONENT for found in grown.values() for value in found.values()))


if __name__ == "__main__":
    sys.exit(main())
