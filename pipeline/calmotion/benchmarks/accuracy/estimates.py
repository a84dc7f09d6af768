"""How honest the estimated errors are: random shots, each simulated to a tolerance and compared with a finer run.

`calmotion bench estimates [--count N] [--first K] [--csv FILE [--resume]]` draws arms of one or two slender links with
a load, of random size, material and motion, simulates each to a random tolerance as the program chooses, and
measures the result against a simulation with meshes of eight times the nodes or more, until these are known to a fifth
of the estimate, a reduction to a thirtieth of the tolerance, and a step that is extrapolated to zero. Shot number K is
the same on every machine; `--resume` goes on with the shots that the CSV file does not have. The table counts the shots
by their error over their estimate: below one the estimate is on the safe side.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from calmotion.accuracy.converged_reduction import converged_reduction
from calmotion.accuracy.integrator_choice import by_fast_scheme
from calmotion.accuracy.mesh_budget import mesh_error
from calmotion.accuracy.pod_subspace import project_to_subspace
from calmotion.accuracy.simulate_to_tolerance import simulate_to_tolerance
from calmotion.accuracy.step_error import StepRun, distance, frames_of, simulate_at
from calmotion.benchmarks.common.finer_meshes import TIMES, with_more_nodes
from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import markdown, resumed_rows, write_rows
from calmotion.benchmarks.scenes.beam_arm import beam_arm, quintic, shot_of
from calmotion.errors import ShotError
from calmotion.reduction.mesh_refinement import Effort, refined_for_frequencies
from calmotion.shot import Animation, Character, FEMeshes
from calmotion.shot.character import Array
from calmotion.shot.run import RunSettings
from calmotion.simulation.body_reduction import BodyReduction, reduction_for
from calmotion.simulation.compiled_shot import CompiledShot, compile_shot

EDGES = (0.0, 0.05, 0.1, 0.2, 0.5, 1.0, 1.5, np.inf)  # of the classes of error over estimate
FINER = 1.0 / 30.0  # tolerance of the reference's reduction over that of the result
MESH_ACCURACY, MAX_NODES = 0.01, 15_000  # of the first meshes, as of the mesher
HELD = 1e-3  # of the tolerance: what POD subspaces of the reference may change
STEPS = (0.25, 0.125)  # of the reference over that of the result
KNOWN, MORE, MOST = 0.2, 3.0, 20_000  # error of the reference's meshes over the estimate; by how many times the nodes
# they are refined until then, and from how many on no more


@dataclass(frozen=True, eq=False)
class Drawn:
    """A random shot, its meshes, and the tolerance that it is simulated to [m]."""

    character: Character
    animation: Animation
    meshes: FEMeshes
    tolerance: float


@dataclass(frozen=True)
class Judged:
    """One shot.

    Attributes:
        shot: Its number.
        tolerance_m: Asked for [m].
        estimated_m, mesh_m: What the program estimates, and the part of the meshes [m].
        error_m: Distance to the reference [m].
        reference_m: Estimated error of the meshes of the reference [m].
        nodes, reference_nodes: Of the meshes.
    """

    shot: int
    tolerance_m: float
    estimated_m: float
    mesh_m: float
    error_m: float
    reference_m: float
    nodes: int
    reference_nodes: int

    @property
    def ratio(self) -> float:
        """Error over estimate."""
        return self.error_m / self.estimated_m


def drawn(number: int) -> Drawn:
    """Random shot of a number."""
    rng = np.random.default_rng(number)
    links, length, slenderness = int(rng.integers(1, 3)), rng.uniform(0.2, 0.5), rng.uniform(12.0, 30.0)
    character, meshes = beam_arm(
        links, length, length / slenderness, 10.0 ** rng.uniform(9.2, 10.3), payload=rng.uniform(0.05, 0.25),
        damping=rng.uniform(0.01, 0.03), cells=round(0.5 * slenderness), across=1,
    )  # fmt: skip
    turn, seconds = rng.uniform(0.3, 1.0), rng.uniform(0.25, 0.5)
    away, back = quintic(turn, seconds, 0.1), quintic(-rng.uniform(0.3, 1.0), rng.uniform(0.25, 0.5), 0.2 + seconds)
    animation = shot_of(lambda t: away(t) + back(t), 1.25, motors=links)
    judged = []
    for mesh in meshes.meshes:
        body = character.bodies[mesh.body]
        carrier = next(joint.frame1 for joint in character.joints if joint.body1 == mesh.body)
        judged.append(refined_for_frequencies(mesh, body, carrier, Effort(2.0 * MESH_ACCURACY, MAX_NODES)))
    return Drawn(character, animation, FEMeshes(tuple(judged)), 10.0 ** rng.uniform(-4.0, -2.3))


def judged(number: int) -> Judged:
    """Simulate the shot of a number to its tolerance, and measure the result.

    Raises:
        ShotError: The shot cannot be simulated: it bends too far.
    """
    shot = drawn(number)
    options = RunSettings(tolerance=shot.tolerance)
    reduction = reduction_for(shot.character, shot.animation, shot.meshes, options, repeats=True)
    first = compile_shot(shot.character, shot.animation, reduction.bodies(shot.tolerance))
    converged = converged_reduction(first, reduction, options)
    quiet = lambda fraction, message: None  # noqa: E731  (a callback)
    result = simulate_to_tolerance(converged.shot, options, quiet, converged.error_m, converged.known)
    assert result.accuracy is not None and result.accuracy.mesh_m is not None
    estimated = result.accuracy.estimated_m + result.accuracy.mesh_m
    times, own_error, nodes = TIMES, np.inf, 0
    while own_error > KNOWN * estimated and nodes < MOST / MORE:
        positions, own_error, nodes = _reference(shot, reduction, options, result.step_s, times)
        times *= MORE
    found = frames_of(result, shot.animation.frame_times).positions
    return Judged(
        number, shot.tolerance, estimated, result.accuracy.mesh_m,
        distance(found, positions), own_error, sum(body.nodes for body in converged.shot.bodies), nodes,
    )  # fmt: skip


def _reference(
    shot: Drawn, reduction: BodyReduction, options: RunSettings, step: float, times: float
) -> tuple[Array, float, int]:
    """Positions of a far finer run [m], the estimated error of its meshes [m], and their nodes.

    Args:
        times: Their nodes over those of the shot.
    """
    first = BodyReduction(shot.character, shot.meshes, reduction.loads)
    # to the finer tolerance, since a link that hardly bends has no modes by which its mesh would be refined
    finer = with_more_nodes(first, times, FINER * shot.tolerance)
    complete = compile_shot(shot.character, shot.animation, finer.bodies(FINER * shot.tolerance))
    fine = project_to_subspace(complete, options, step, lambda item: HELD * shot.tolerance).shot

    def run(part: float) -> StepRun:
        return by_fast_scheme(options, lambda options: simulate_at(fine, options, part * step))

    runs = [run(part) for part in STEPS]
    factor = (runs[0].step / runs[1].step) ** runs[0].order - 1.0
    limit = runs[1].positions + (runs[1].positions - runs[0].positions) / factor
    return limit, mesh_error(fine, options, runs[1]) or 0.0, _nodes(fine)


def _nodes(shot: CompiledShot) -> int:
    return sum(body.nodes for body in shot.bodies)


def counts(ratios: Sequence[float]) -> list[list[str]]:
    """Rows of the table: class, number of shots, share of all."""
    found = np.histogram(ratios, EDGES)[0]
    names = [f"{low:g} to {high:g}" for low, high in zip(EDGES[:-2], EDGES[1:-1], strict=True)] + [
        f"above {EDGES[-2]:g}"
    ]
    return [[name, str(n), f"{100.0 * n / len(ratios):.0f}%"] for name, n in zip(names, found, strict=True)]


HEADS = ("error over estimate", "shots", "share")


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when an error exceeds one and a half times its estimate."""
    parser = bench_parser("estimates", __doc__)
    parser.add_argument("--count", type=int, default=200, help="number of shots (default: 200)")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first shot (default: 0)")
    parser.add_argument("--resume", action="store_true", help="keep the shots that the file of --csv has")
    output_options(parser, csv="a row for each shot", markdown=True)
    options = parser.parse_args(arguments)
    rows: list[Judged] = resumed_rows(parser, options, Judged)
    known = {row.shot for row in rows}
    for number in range(options.first, options.first + options.count):
        if number in known:
            continue
        try:
            row = judged(number)
        except ShotError as problem:
            print(f"shot {number} is refused: {problem.problem}", file=sys.stderr, flush=True)
            continue
        rows = sorted([*rows, row], key=lambda row: row.shot)
        print(
            f"shot {number}, {1e3 * row.tolerance_m:.2g} mm: {1e3 * row.error_m:.2g} mm off, "
            f"{1e3 * row.estimated_m:.2g} mm estimated", file=sys.stderr, flush=True,
        )  # fmt: skip
        if options.csv:
            write_rows(options.csv, Judged, rows)
    if not rows:
        return 1
    ratios = [row.ratio for row in rows]
    table = counts(ratios)
    if options.markdown:
        Path(options.markdown).write_text(markdown(HEADS, table), encoding="utf-8")
    if options.json:
        print(json.dumps({"rows": [asdict(row) | {"ratio": row.ratio} for row in rows]}))
    else:
        from calmotion.cli.tables import console_on, print_table

        print_table(console_on(sys.stdout), "Random shots by error over estimate", HEADS, table)
    return int(max(ratios) > EDGES[-2])


if __name__ == "__main__":
    sys.exit(main())
