"""How honest the extrapolated first frequencies of meshes are: links of robots on ever finer meshes.

`calmotion bench mesh-extrapolation ROBOT ... [--nodes N] [--csv FILE]` meshes each link with elements of the automatic
size and bisects them where their error arises, until a mesh has N nodes. A row for each mesh has its estimated error,
its frequencies, what the extrapolation from it and the coarser ones takes from them, and what it claims to leave. The
truth is extrapolated from the finest mesh, whose row shows how well it is known. `FILE:PRIM` names one link.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from calmotion.benchmarks.common.messages import say
from calmotion.benchmarks.common.parsers import links_parser, output_options
from calmotion.benchmarks.common.tables import markdown, write_rows
from calmotion.benchmarks.scenes.links import Link, attachments_of, frames_of, links_of_all
from calmotion.benchmarks.scenes.mesher import mesher
from calmotion.errors import ShotError
from calmotion.shot.character import Array
from calmotion.workflow.plain import plain

FREQUENCIES = "largest error of three frequencies"  # what is off
_QUANTILES = (0.5, 0.8, 0.95, 1.0)


@dataclass(frozen=True)
class LevelRow:
    """One of the ever finer meshes of a link.

    Attributes:
        link: Name.
        nodes: Of the ten-node tetrahedra.
        f1, f2, f3: First frequencies [Hz].
        estimate: Their error by recovered strains [%].
        taken: What the extrapolation takes from them [%].
        claimed: Error that it claims to leave [%].
        off: Largest error of the three that it leaves [%]; not a number: the finest mesh.
    """

    link: str
    nodes: int
    f1: float
    f2: float
    f3: float
    estimate: float
    taken: float
    claimed: float
    off: float


def levels(link: Link, nodes: int) -> list[LevelRow]:
    """The meshes of a link, coarse to fine.

    Args:
        link: With surfaces.
        nodes: The finest mesh is the first with so many or more.

    Raises:
        ShotError: The link cannot be meshed.
    """
    from calmotion.accuracy.element_size import element_size, shape_of
    from calmotion.reduction.full_order.mesh_estimates import frequency_estimate
    from calmotion.reduction.full_order.mesh_extrapolation import Estimate, extrapolation
    from calmotion.reduction.full_order.nested_modes import NestedModes
    from calmotion.reduction.mesh_refinement import bisected_where

    maker = mesher()
    solid = maker.solid_of(link.body, link.body.surfaces)
    size = element_size(shape_of(solid.points, solid.triangles))
    options, joints = maker.MeshOptions(element_size=size, cache=False), attachments_of(link)
    mesh = maker.mesh_body(0, link.body, options, frames_of(link), joints)
    estimate = partial(
        frequency_estimate, body=link.body, carrier=link.carrier, coarser=NestedModes(), attachments=joints
    )
    estimates: list[Estimate] = [estimate(mesh)]
    while estimates[-1].nodes < nodes:
        mesh = bisected_where(mesh, estimates[-1].indicators)
        estimates.append(estimate(mesh))
    told = [extrapolation(estimates[: k + 1], one_factor=True) for k in range(len(estimates))]
    found = [_frequencies(one.squares, excess) for one, (excess, _) in zip(estimates, told, strict=True)]
    rows = []
    for k, (one, (excess, left)) in enumerate(zip(estimates, told, strict=True)):
        f1, f2, f3 = map(float, _frequencies(one.squares, 0.0))
        taken = 100.0 * (1.0 - np.sqrt(1.0 - excess))
        off = 100.0 * float(np.abs(found[k] / found[-1] - 1.0).max()) if one is not estimates[-1] else float("nan")
        rows.append(LevelRow(link.name, one.nodes, f1, f2, f3, 50.0 * one.error, taken, 50.0 * left, off))
    return rows


def _frequencies(squares: Array, excess: float) -> Array:
    """Frequencies [Hz], shape [3], without a share of their stiffness."""
    return np.asarray(np.sqrt(squares[:3] * (1.0 - excess)) / (2.0 * np.pi))


class Extrapolated(Protocol):
    """A row of a mesh, as `LevelRow`."""

    @property
    def estimate(self) -> float: ...

    @property
    def taken(self) -> float: ...

    @property
    def claimed(self) -> float: ...

    @property
    def off(self) -> float: ...


def honesty(rows: Sequence[Extrapolated], what: str = FREQUENCIES) -> str:
    """A line about the errors over what is claimed, where something was extrapolated."""
    ratios = [row.off / row.claimed for row in rows if row.taken > 0.0 and not np.isnan(row.off)]
    if not ratios:
        return "no mesh has been extrapolated"
    parts = ", ".join(f"{np.quantile(ratios, q):.2f} for {100.0 * q:.0f}%" for q in _QUANTILES)
    return f"{what} over what is claimed, of {len(ratios)} meshes: at most {parts}"


def percents(row: Extrapolated, digits: int) -> list[str]:
    """The errors of a row for a person [%]."""
    values = (row.estimate, row.taken, row.claimed, row.off)
    return ["-" if np.isnan(value) else f"{value:.{digits}f}" for value in values]


def tell(rows: Sequence[Any], heads: Sequence[str], cells: Sequence[Sequence[str]], what: str, as_json: bool) -> None:
    """Print rows, as of `Extrapolated` and dataclasses, and how honest they are; or one JSON object.

    Args:
        heads, cells: Of the table for a person.
        what: As of `honesty`.
    """
    if as_json:
        print(json.dumps(plain({"rows": [asdict(row) for row in rows]})))
    else:
        print(f"{markdown(heads, cells)}\n{honesty(rows, what)}")


HEADS = ("link", "nodes", "f1, f2, f3 Hz", "estimate %", "taken %", "claimed %", "off %")


def cells(rows: Sequence[LevelRow]) -> list[list[str]]:
    """The table for a person, without its heads."""
    return [
        [
            row.link, str(row.nodes), f"{row.f1:.4g}, {row.f2:.4g}, {row.f3:.4g}",
            *percents(row, 2),
        ]
        for row in rows
    ]  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; exit status 1 when no link could be meshed."""
    parser = links_parser("mesh-extrapolation", __doc__)
    parser.add_argument("--nodes", type=int, default=100_000, metavar="N", help="of the finest mesh (default: 100000)")
    output_options(parser, csv="a row for each mesh")
    options = parser.parse_args(arguments)
    rows: list[LevelRow] = []
    for _, link in links_of_all(options.links, say):
        try:
            rows += levels(link, options.nodes)
        except ShotError as error:
            say(f"{link.name}: {error}")
        if options.csv:
            write_rows(options.csv, LevelRow, rows)  # the next may take long
    tell(rows, HEADS, cells(rows), FREQUENCIES, options.json)
    return 0 if rows else 1


if __name__ == "__main__":
    sys.exit(main())
