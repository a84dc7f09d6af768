"""Where the time of a run goes: `calmotion bench speed [SHOT ...]` optimises shots and prints a table.

Each shot is optimised as by `calmotion optimize`, with the caches as they are. Times are processor times of this
process and those that it started, as other work on the machine changes them least; compiling is counted by itself.
`single simulations` is the time of the search over that of one simulation by the same step.
"""

from __future__ import annotations

import tempfile
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from calmotion import ShotError
from calmotion.host import OperatorResult
from calmotion.model import OutputPaths, RunSettings
from calmotion.support import compiling
from calmotion.tolerance import simulate_at
from calmotion.workflow import optimize

from ..common.parsers import bench_parser, shots_argument
from ..common.shots import SAMPLES, load
from ..common.tables import markdown
from ..common.timing import processor_time

STAGES = ("read", "analyse", "mesh", "reduce", "search", "write", "compile")
_TIMES = 3
# what is named nowhere here is `other`
OPERATORS = {
    "bvh.read": "read", "motion.read": "read", "usd.read": "read", "accuracy.analyse": "analyse", "fe.mesh": "mesh",
    "fem.reduce": "reduce", "accuracy.refine": "reduce", "dynamics.compile": "reduce", "retarget.optimize": "search",
    "usd.write": "write",
}  # fmt: skip


@dataclass(frozen=True)
class Stages:
    """Processor time of a run by what it did [s].

    Attributes:
        shot: Name of the shot.
        used: Time of each stage, without compiling.
        wall_s: The whole run by the clock.
        simulations: Simulated and linearised sweeps of the search.
        single_s: Processor time of one simulation by the step of the search, with all coordinates.
    """

    shot: str
    used: Mapping[str, float]
    wall_s: float
    simulations: int
    single_s: float

    @property
    def singles(self) -> float:
        """The search in single simulations."""
        return self.used.get("search", 0.0) / self.single_s


def measure(path: str) -> Stages:
    """Optimise a shot.

    Raises:
        ShotError: It cannot be processed.
    """
    already = compiling.seconds
    used: defaultdict[str, float] = defaultdict(float)
    state = {"cpu": processor_time(), "compile": already}

    def done(result: OperatorResult) -> None:
        now, compiled = processor_time(), compiling.seconds
        used[OPERATORS.get(result.idname, "other")] += now - state["cpu"] - (compiled - state["compile"])
        state.update({"cpu": now, "compile": compiled})

    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        found = optimize(path, outputs=OutputPaths(layer=str(Path(folder) / "layer.usda")), on_operator=done).result
    used["compile"] = compiling.seconds - already
    sweeps = found.search.forward_simulations + found.search.linearized_sweeps
    wall = time.perf_counter() - begin
    return Stages(Path(path).stem, dict(used), wall, sweeps, _single_simulation(path, found.step_s))


def _single_simulation(path: str, step: float) -> float:
    """Processor time of a simulation of a shot as it is searched, the least of three [s]."""
    shot, times = load(path, rigid=True), []
    for _ in range(1 + _TIMES):  # the first one may compile
        begin = time.process_time()
        simulate_at(shot, RunSettings(), step)
        times.append(time.process_time() - begin)
    return min(times[1:])


def table(runs: Sequence[Stages]) -> str:
    """The runs as Markdown."""
    heads = ["shot", *STAGES, "other", "processor time [s]", "by the clock [s]", "sweeps", "single simulations"]
    rows = []
    for run in runs:
        times = [run.used.get(stage, 0.0) for stage in (*STAGES, "other")]
        numbers = [*times, sum(times), run.wall_s]
        rows.append([run.shot, *(f"{value:.2f}" for value in numbers), str(run.simulations), f"{run.singles:.0f}"])
    return markdown(heads, rows, "---:")


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure shots and print the table."""
    parser = bench_parser("speed", __doc__)
    shots_argument(parser, SAMPLES)
    options = parser.parse_args(arguments)
    try:
        print(table([measure(path) for path in options.shots]))
    except ShotError as error:
        parser.exit(1, f"error: {error}\n")
    return 0
