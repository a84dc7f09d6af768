"""Gain of each model simplification: pairs of runs with and without it, their times and the error that it adds.

`calmotion bench simplification [--csv FILE]` runs synthetic shots, each of which allows one simplification, and
two of them (one without rotating bodies, one without closed chains) with all simplifications
switched off. A time is the median of alternating runs; an error is the largest distance of any target, at any
frame, between the two runs of a pair.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from calmotion.accuracy.simplification.analysis import analyse
from calmotion.accuracy.simulate_to_tolerance import simulate_to_tolerance
from calmotion.accuracy.step_error import StepRun, distance, frames_of
from calmotion.benchmarks.accuracy.work_precision import machine
from calmotion.benchmarks.common.fresh_cache import fresh_cache
from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import write_rows
from calmotion.benchmarks.scenes.simplification_shots import (
    SimplificationShot,
    arm_with_head,
    clevis_arm,
    firm_arm,
    gantry,
    held_arm,
    plastic_arm,
)
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.shot import Result
from calmotion.shot.model_choice import KINDS, ON
from calmotion.shot.run import RunSettings
from calmotion.simulation.body_reduction import reduced_shot

REPEATS = 3


@dataclass(frozen=True)
class Pair:
    """One shot with something and without.

    Attributes:
        kind: What is left out.
        shot: Name.
        command: `simulate` or `optimize`.
        with_s, without_s: Time of the simulation or the search [s].
        all_with_s, all_without_s: The same with the analysis and the reduction of all bodies [s].
        error_m: Distance between the results of the two [m].
        estimated_m: Of the one without, of all that it does without: what the program estimates [m].
    """

    kind: str
    shot: str
    command: str
    with_s: float
    without_s: float
    all_with_s: float
    all_without_s: float
    error_m: float
    estimated_m: float

    @property
    def ratio(self) -> float:
        """How much longer it takes with it."""
        return self.with_s / self.without_s

    @property
    def ratio_in_all(self) -> float:
        """The same with analysis and reduction."""
        return self.all_with_s / self.all_without_s


@dataclass(frozen=True, eq=False)
class Outcome:
    """One run: its result where the targets are at the frames, its times [s], and what was estimated [m]."""

    run: StepRun
    wall_s: float
    all_s: float
    estimated_m: float


def run(shot: SimplificationShot, command: str, forced: Mapping[str, str], options: RunSettings) -> Outcome:
    """Analyse, reduce, and simulate or optimise a shot."""
    begin = time.perf_counter()
    optimizes = command == "optimize"
    choices = analyse(shot.character, shot.animation, options, forced, optimizes)
    options = replace(
        options,
        ranges=choices.choice("ranges"),
        motors=choices.choice("motors"),
        directions=choices.choice("directions"),
    )
    # finite elements anew each time, as for a user who comes with a new character
    with fresh_cache():
        compiled = reduced_shot(choices.character, shot.animation, shot.meshes, replace(options, tolerance=None))
    work: Callable[..., Result] = optimize_to_tolerance if optimizes else simulate_to_tolerance
    result = work(compiled, options, lambda fraction, message: None)
    whole = time.perf_counter() - begin
    estimated = sum(row.estimated_error_m or 0.0 for row in (*choices.left_out, *result.left_out))
    return Outcome(frames_of(result, shot.animation.frame_times), result.wall_s, whole, estimated)


def pair(
    kind: str, shot: SimplificationShot, command: str, forced: Mapping[str, str], repeats: int = REPEATS,
    given: RunSettings | None = None, more: RunSettings | None = None,
) -> Pair:  # fmt: skip
    """A shot as it is and with something forced on.

    Args:
        forced: Kinds that are forced, in the run that has them.
        given: RunSettings of both.
        more: RunSettings of the run that has it, where these make it.
    """
    options = given or RunSettings()
    lean = partial(run, shot, command, {}, options)
    full = partial(run, shot, command, forced, more or options)
    full(), lean()  # compile
    pairs = [(full(), lean()) for _ in range(repeats)]
    times = np.median([[a.wall_s, b.wall_s, a.all_s, b.all_s] for a, b in pairs], axis=0).tolist()
    one, other = pairs[0]
    error = distance(one.run.positions, other.run.positions)
    return Pair(kind, shot.name, command, times[0], times[1], times[2], times[3], error, other.estimated_m)


def pairs(repeats: int = REPEATS) -> list[partial[Pair]]:
    """Every pair, one kind of thing each, and then everything, to be measured when called."""
    finest, finer_steps = RunSettings(knot_spacing=1.0 / 60.0), RunSettings(step=1.0 / 3840.0)
    everything = dict.fromkeys(KINDS, ON)
    return [
        partial(pair, "turning", gantry(), "simulate", {"turning": ON}, repeats),
        partial(pair, "loops", clevis_arm(), "simulate", {"loops": ON}, repeats),
        partial(pair, "modes", firm_arm(), "simulate", {"modes": ON}, repeats),
        partial(pair, "directions", plastic_arm(), "optimize", {"directions": ON}, repeats),
        partial(pair, "elasticity", firm_arm(), "simulate", {"elasticity": ON}, repeats),
        partial(pair, "motors", arm_with_head(6), "optimize", {"motors": ON}, repeats),
        partial(pair, "ranges", held_arm(), "optimize", {"ranges": ON}, repeats),
        partial(pair, "knots", plastic_arm(60.0), "optimize", {}, repeats, None, finest),
        partial(pair, "step", firm_arm(), "simulate", {}, repeats, None, finer_steps),
        partial(pair, "everything", gantry(), "simulate", everything, repeats),
        partial(pair, "everything", firm_arm(), "simulate", everything, repeats),
    ]


def print_pairs(found: Sequence[Pair]) -> None:
    """The table for a person."""
    from calmotion.cli.quantities import length
    from calmotion.cli.tables import console_on, print_table

    heads = ["left out", "shot", "run", "with", "without", "ratio", "in all", "error", "estimate"]
    cells = [
        [
            p.kind, p.shot, p.command, f"{p.with_s:.3f} s", f"{p.without_s:.3f} s", f"{p.ratio:.2f}",
            f"{p.ratio_in_all:.2f}", length(p.error_m), length(p.estimated_m),
        ]
        for p in found
    ]  # fmt: skip
    print_table(console_on(sys.stdout), "With something that a shot does not need, and without", heads, cells, texts=3)


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("simplification", __doc__)
    output_options(parser, csv="a table")
    parser.add_argument(
        "--only", metavar="KIND", action="append", help="only this kind of simplification; may be repeated"
    )
    parser.add_argument("--repeats", type=int, default=REPEATS, help="repetitions; times are medians")
    options = parser.parse_args(arguments)
    chosen = [make for make in pairs(options.repeats) if not options.only or make.args[0] in options.only]
    found = [make() for make in chosen]
    if options.csv:
        write_rows(options.csv, Pair, found)
    if options.json:
        rows = [asdict(p) | {"ratio": p.ratio, "ratio_in_all": p.ratio_in_all} for p in found]
        print(json.dumps({"machine": machine(), "pairs": rows}))
    else:
        print_pairs(found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
