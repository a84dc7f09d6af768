"""How honest the extrapolated stiffness of interfaces is: flexible bodies of shots on ever finer meshes.

`calmotion bench interface-extrapolation SHOT ... [--nodes N] [--csv FILE]` bisects the meshes of each flexible body of
a shot where their error under the shot's loads arises, until a mesh has N nodes. SHOT is a file, or the number of a
random shot of `calmotion bench estimates`. A row for each mesh has its estimated error of the static compliance as the
targets see it, and what the extrapolation from it and the coarser ones claims to leave. The truth is extrapolated from
the finest mesh; what that claims shows how well it is known, and the mesh before it tells little.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.benchmarks.accuracy.estimates import drawn
from calmotion.benchmarks.common.messages import say
from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.shots import load_unreduced
from calmotion.benchmarks.common.tables import write_rows
from calmotion.benchmarks.links.extrapolation import percents, tell
from calmotion.errors import ShotError
from calmotion.multibody.model.model import body_anchors
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction.full_order.full_models import Member
from calmotion.reduction.full_order.mesh_extrapolation import Estimate, along, interface_factors, target_shares
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.mesh_refinement import bisected_where, load_estimator, with_own_stiffness
from calmotion.shot import Animation, Character, FEMeshes
from calmotion.shot.character import Array
from calmotion.shot.run import RunSettings
from calmotion.simulation.bodies import full_model_of
from calmotion.simulation.body_reduction import reduction_for

_TOLERANCE = 1e-4  # of the modes that count [m]


@dataclass(frozen=True)
class InterfaceRow:
    """One of the ever finer meshes of a body.

    Attributes:
        shot, body: File or number; prim path.
        nodes: Of the ten-node tetrahedra.
        estimate: Error of the compliance by recovered strains [%].
        taken: What the extrapolation takes from the stiffness [%].
        claimed: Error that it claims to leave [%].
        off: Error that it leaves [%]; not a number: the finest mesh.
    """

    shot: str
    body: str
    nodes: int
    estimate: float
    taken: float
    claimed: float
    off: float


def members(shot: str) -> Iterator[tuple[Member, LoadEnvelope]]:
    """The flexible bodies of a shot and their loads.

    Raises:
        ShotError: The shot cannot be read.
    """
    character, animation, meshes = _read(shot)
    reduction = reduction_for(character, animation, meshes, RunSettings(tolerance=_TOLERANCE))
    assert reduction.meshes is not None and reduction.loads is not None
    anchors = body_anchors(reduction.character, span_tree(reduction.character))
    for mesh in reduction.meshes.meshes:
        yield full_model_of(reduction.character, mesh, anchors[mesh.body]), reduction.loads[mesh.body]


def _read(shot: str) -> tuple[Character, Animation, FEMeshes]:
    found = drawn(int(shot)) if shot.isdigit() else load_unreduced(shot)
    return found.character, found.animation, found.meshes


def levels(own: Member, loads: LoadEnvelope, nodes: int) -> list[Estimate]:
    """Estimates of the meshes of a body, coarse to fine.

    Args:
        own: The body on its first mesh.
        loads: On it.
        nodes: The finest mesh is the first with so many or more.
    """
    mesh = with_own_stiffness(own.mesh)
    estimate = load_estimator(own.body, own.attachments, own.root, loads, _TOLERANCE)
    estimates = [estimate(mesh)]
    while estimates[-1].nodes < nodes:
        mesh = bisected_where(mesh, estimates[-1].indicators)
        estimates.append(estimate(mesh))
    return estimates


def rows_of(shot: str, body: str, estimates: Sequence[Estimate]) -> list[InterfaceRow]:
    """A row for each mesh of a body; none where nothing moves."""
    from scipy.linalg import eigh

    first, finest = estimates[0], estimates[-1]
    found = [interface_factors(first, estimates[: k + 1]) for k in range(len(estimates))]
    if found[-1] is None:
        return []
    limit = first.interfaces @ found[-1][0]
    _, G = eigh(finest.forms, 0.5 * (limit + limit.T))
    shares = target_shares(G, finest)

    def seen(form: Array) -> float:
        return 100.0 * float(np.abs(along(G, form)) @ shares)

    rows = []
    for one, factors in zip(estimates, found, strict=True):
        assert factors is not None
        stiffness, softest = first.interfaces @ factors[0], first.interfaces @ factors[1]
        off = float("nan") if one is finest else seen(stiffness - limit)
        taken = 0.0 if one is first else seen(one.interfaces - stiffness)
        claimed = seen(stiffness - softest)
        rows.append(InterfaceRow(shot, body, one.nodes, seen(one.forms), taken, claimed, off))
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; exit status 1 when no body has an interface that moves."""
    parser = bench_parser("interface-extrapolation", __doc__)
    parser.add_argument("shots", nargs="+", metavar="SHOT", help="USD file, or number of a random shot")
    parser.add_argument("--nodes", type=int, default=60_000, metavar="N", help="of the finest mesh (default: 60000)")
    output_options(parser, csv="a row for each mesh")
    options = parser.parse_args(arguments)
    rows: list[InterfaceRow] = []
    for shot in options.shots:
        try:
            for own, loads in members(shot):
                rows += rows_of(shot, own.body.path, levels(own, loads, options.nodes))
                if options.csv:
                    write_rows(options.csv, InterfaceRow, rows)  # the next may take long
        except ShotError as error:
            say(f"{shot}: {error}")
    heads = ("shot", "body", "nodes", "estimate %", "taken %", "claimed %", "off %")
    cells = [[row.shot, row.body, str(row.nodes), *percents(row, 3)] for row in rows]
    tell(rows, heads, cells, "error of the compliance", options.json)
    return 0 if rows else 1


if __name__ == "__main__":
    sys.exit(main())
