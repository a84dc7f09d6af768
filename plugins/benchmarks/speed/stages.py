"""Where the time of a run goes: `calmotion bench speed [SHOT ...]` optimises shots and prints a table.

Each shot is optimised as by `calmotion optimize`, with the caches as they are. Times are processor times of this
process and those that it started, as other work on the machine changes them least; compiling is counted by itself.
`single simulations` is the time of the search over that of one simulation by the same step.
"""

import tempfile
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from calmotion.host import OperatorResult
from calmotion.model import OutputPaths, RunSettings
from calmotion.support import compiling
from calmotion.tolerance import simulate_at
from calmotion.workflow import optimize

from ..common.reporting import bench_parser, finish, keep
from ..common.shots import SAMPLES, load
from ..common.timing import processor_time

REPEATS = 3  # of the single simulation; the fastest counts
# the stages of operators; what is named nowhere here is `other`
OPERATORS = {
    "usd.read": "read",
    "bvh.read": "read",
    "motion.read": "read",
    "accuracy.analyse": "analyse",
    "fe.mesh": "mesh",
    "fem.reduce": "reduce",
    "accuracy.refine": "refine",
    "dynamics.compile": "refine",
    "retarget.optimize": "search",
    "usd.write": "write",
}


@dataclass(frozen=True)
class Stages:
    """Processor time of a run by what it did [s].

    Attributes:
        shot: Name of the shot.
        read_s, analyse_s, mesh_s, reduce_s, refine_s, search_s, write_s, other_s: Of each stage, without compiling.
        compile_s: Of compiling.
        wall_s: The whole run by the clock.
        sweeps: Simulated and linearised sweeps of the search.
        single_simulations: The search in simulations by its step, with all coordinates.
    """

    shot: str
    read_s: float
    analyse_s: float
    mesh_s: float
    reduce_s: float
    refine_s: float
    search_s: float
    write_s: float
    other_s: float
    compile_s: float
    wall_s: float
    sweeps: int
    single_simulations: float


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
    wall, compiled = time.perf_counter() - begin, compiling.seconds - already
    stages = {f"{stage}_s": used[stage] for stage in (*OPERATORS.values(), "other")}
    sweeps = found.search.forward_simulations + found.search.linearized_sweeps
    singles = used["search"] / _single_simulation(path, found.step_s)
    return Stages(Path(path).stem, **stages, compile_s=compiled, wall_s=wall, sweeps=sweeps, single_simulations=singles)


def _single_simulation(path: str, step: float) -> float:
    """Processor time of a simulation of a shot as it is searched [s]."""
    shot, times = load(path, rigid=True), []
    for _ in range(1 + REPEATS):  # the first one may compile
        begin = time.process_time()
        simulate_at(shot, RunSettings(), step)
        times.append(time.process_time() - begin)
    return min(times[1:])


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure shots and print the table."""
    options = bench_parser("speed", __doc__, SAMPLES).parse_args(arguments)
    rows = []
    for path in options.shots:
        rows.append(measure(path))
        keep(options, Stages, rows)
    finish(options, "Processor time by stage", rows)
    return 0
