"""How honest the estimated errors are: random shots, each simulated to a tolerance and compared with a finer run.

`calmotion bench estimates [--count N] [--first K] [--csv FILE [--resume]]` draws arms of one or two slender links with
a load, of random size, material and motion, simulates each to a random tolerance as the program chooses, and measures
the result against a simulation with regular meshes of some ten times the nodes, a reduction that is refined until it
moves no target by more than a tenth of the estimate, and a step that is extrapolated to zero. How well that is known is
measured too, by coarser regular meshes and by the last refinement of its reduction. Shot number K is the same on every
machine; `--resume` goes on with the shots that the CSV file does not have. The table counts the shots by their error
over their estimate: below one the estimate is on the safe side. A reference that is known to no better than half of the
error and half of the estimate decides nothing, and its shot is counted apart. The command fails where an error exceeds
one and a half times its estimate.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.mesh import AttachmentFrame, quadratic_nodes
from calmotion.model import Animation, Character, FEMesh, FEMeshes, MeshQuality, RunSettings
from calmotion.reduction import LoadEnvelope, MeshController
from calmotion.simulation import BodyReduction, CompiledShot, compile_shot, reduction_for
from calmotion.testing import beam_arm, beam_mesh, quintic, shot_of
from calmotion.tolerance import (
    ReferenceRun,
    StepRun,
    by_fast_scheme,
    converged_reduction,
    distance,
    frames_of_result,
    project_to_subspace,
    reference_run,
    simulate_at,
    simulate_to_tolerance,
)

from ..common.reporting import bench_parser, finish, numbered, numbered_options

LIMIT = 1.5  # errors over estimates that none may exceed
EDGES = (0.0, 0.05, 0.1, 0.2, 0.5, 1.0, LIMIT, np.inf)  # of the classes of error over estimate
MESH_ACCURACY, MAX_NODES = 0.01, 15_000  # of the first meshes, as of the mesher
MESHES = ((3, 2), (4, 3))  # of references: cells along a link over those of the first mesh, and across; the last counts
DECIDES = 0.5  # largest error of a reference over the larger of error and estimate
FINER, MOST = 1.0 / 30.0, 3  # tolerance of its first reduction over that of the result; reductions, each to a tenth
REDUCED = 0.1  # of the estimate: what the last of these may change, and what the stiffness of the meshes may cost
HELD = 0.02  # of the estimate: what POD subspaces of the reference may change
STEPS = (0.5, 0.25)  # of the reference over that of the result


@dataclass(frozen=True, eq=False)
class Drawn:
    """A random shot.

    Attributes:
        character, animation, meshes: The shot.
        tolerance: That it is simulated to [m].
        size: Length and thickness of a link [m].
        cells: Of the mesh along a link, before it was refined.
    """

    character: Character
    animation: Animation
    meshes: FEMeshes
    tolerance: float
    size: tuple[float, float]
    cells: int

    def regular_meshes(self, along: int, across: int) -> FEMeshes:
        """Meshes with so many times the cells along each link, and so many across."""
        points, tets = beam_mesh(*self.size, along * self.cells, across)
        quality = MeshQuality(0.0, 0.0, 0.0)
        return FEMeshes(tuple(FEMesh(mesh.body, points, tets, quality) for mesh in self.meshes.meshes))


@dataclass(frozen=True)
class Judged:
    """One shot.

    Attributes:
        shot: Its number.
        tolerance_m: Asked for [m].
        estimated_m, mesh_m: What the program estimates, and the part of the meshes [m].
        error_m: Distance to the reference [m].
        reference_m: Distance of the reference from one on coarser meshes, with what its last reduction and its
            subspaces changed [m].
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

    @property
    def decides(self) -> bool:
        """Whether the reference is known well enough for the ratio to tell something."""
        return self.reference_m <= DECIDES * max(self.error_m, self.estimated_m)


def drawn(number: int) -> Drawn:
    """Random shot of a number."""
    rng = np.random.default_rng(number)
    links, length, slenderness = int(rng.integers(1, 3)), rng.uniform(0.2, 0.5), rng.uniform(12.0, 30.0)
    size, cells = (length, length / slenderness), round(0.5 * slenderness)
    character, meshes = beam_arm(
        links, *size, 10.0 ** rng.uniform(9.2, 10.3), payload=rng.uniform(0.05, 0.25),
        damping=rng.uniform(0.01, 0.03), cells=cells, across=1,
    )  # fmt: skip
    turn, seconds = rng.uniform(0.3, 1.0), rng.uniform(0.25, 0.5)
    away, back = quintic(turn, seconds, 0.1), quintic(-rng.uniform(0.3, 1.0), rng.uniform(0.25, 0.5), 0.2 + seconds)
    animation = shot_of(lambda t: away(t) + back(t), 1.25, motors=links)
    judged = []
    for mesh in meshes.meshes:
        body = character.bodies[mesh.body]
        carrier = next(joint.frame1 for joint in character.joints if joint.body1 == mesh.body)
        ends = [joint.frame0 for joint in character.joints if joint.body0 == mesh.body]
        held = [AttachmentFrame(body.path, frame, "interface") for frame in (carrier, *ends)]
        judged.append(MeshController(2.0 * MESH_ACCURACY, MAX_NODES).refined(mesh, body, held, 0))
    return Drawn(character, animation, FEMeshes(tuple(judged)), 10.0 ** rng.uniform(-4.0, -2.3), size, cells)


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
    share = REDUCED * estimated / max(result.accuracy.mesh_m, np.finfo(float).tiny)
    wanted = {b: share * (body.mesh_error or 0.0) for b, body in enumerate(converged.shot.bodies)}
    positions, own_error = _reference(shot, reduction.loads, options, result.step_s, estimated, wanted)
    found = frames_of_result(result, shot.animation.frame_times).positions
    nodes, finer = sum(body.nodes for body in converged.shot.bodies), _nodes(shot.regular_meshes(*MESHES[-1]))
    return Judged(
        number, shot.tolerance, estimated, result.accuracy.mesh_m,
        distance(found, positions), own_error, nodes, finer,
    )  # fmt: skip


def _reference(
    shot: Drawn,
    loads: Sequence[LoadEnvelope] | None,
    options: RunSettings,
    step: float,
    estimated: float,
    wanted: dict[int, float],
) -> tuple[Array, float]:
    """Positions of a far finer run [m], and how far it may be from its limit [m], as of `Judged`.

    Args:
        loads: Of the bodies.
        step: Of the result [s].
        estimated: Error of the result [m].
        wanted: Relative error of the stiffness of each body that would cost a tenth of it.
    """
    coarse, fine = (_stiffened(shot, shot.regular_meshes(*cells), loads, wanted) for cells in MESHES)

    def reduced(meshes: BodyReduction, k: int) -> tuple[CompiledShot, ReferenceRun]:
        # what quadratic strain does not see stays bounded as by the first, since to see all takes most of the time
        bodies = meshes.bodies(FINER * 0.1**k * shot.tolerance, 10.0**k)
        complete = compile_shot(shot.character, shot.animation, bodies)
        return complete, reference_run(complete, options, step)

    (complete, known), changed = reduced(fine, 0), np.inf
    for k in range(1, MOST):
        last, (complete, known) = known, reduced(fine, k)
        changed = distance(last.run.positions, known.run.positions)
        if changed <= REDUCED * estimated:
            break
    by_meshes = distance(reduced(coarse, k)[1].run.positions, known.run.positions)
    few = project_to_subspace(complete, options, step, lambda item: HELD * estimated, known)

    def run(part: float) -> StepRun:
        return by_fast_scheme(options, lambda options: simulate_at(few.shot, options, part * step))

    runs = [run(part) for part in STEPS]
    factor = (runs[0].step / runs[1].step) ** runs[0].order - 1.0
    limit = runs[1].positions + (runs[1].positions - runs[0].positions) / factor
    return limit, by_meshes + changed + few.error_m


def _stiffened(
    shot: Drawn, meshes: FEMeshes, loads: Sequence[LoadEnvelope] | None, wanted: dict[int, float]
) -> BodyReduction:
    """The reduction on some meshes as they are, with the stiffness of finer ones; arguments as of `_reference`."""
    reduction = BodyReduction(shot.character, meshes, loads, repeats=True)
    return reduction.with_finer_meshes(shot.tolerance, wanted, MAX_NODES)


def _nodes(meshes: FEMeshes) -> int:
    """Of the quadratic elements of all meshes."""
    return sum(quadratic_nodes(mesh.points, mesh.tets) for mesh in meshes.meshes)


def counts(rows: Sequence[Judged]) -> list[list[str]]:
    """Rows of the table: class, number of shots, share of those that decide."""
    ratios = [row.ratio for row in rows if row.decides]
    names = [f"{low:g} to {high:g}" for low, high in zip(EDGES[:-2], EDGES[1:-1], strict=True)] + [f"above {LIMIT:g}"]
    share = 100.0 / max(len(ratios), 1)
    table = [[name, str(n), f"{share * n:.0f}%"] for name, n in zip(names, np.histogram(ratios, EDGES)[0], strict=True)]
    return [
        *table,
        ["undecided", str(len(rows) - len(ratios)), "-"],
        ["largest", f"{max(ratios, default=0.0):.2f}", "-"],
    ]


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when an error exceeds one and a half times its estimate."""
    parser = bench_parser("estimates", __doc__)
    numbered_options(parser, 200)
    options = parser.parse_args(arguments)
    rows = numbered(options, Judged, "shot", lambda k: [judged(k)])
    heads = ("error over estimate", "shots", "share")
    finish(options, "Random shots by error over estimate", rows, (heads, counts(rows)))
    return int(not rows or any(row.decides and row.ratio > LIMIT for row in rows))
