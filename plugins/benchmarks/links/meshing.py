"""What becomes of the links of real robots, and the time and error of their meshes against element size.

`calmotion bench meshing ROBOT ... [--csv FILE [--resume]]` has a row for each link: what its solid was made of, its
volume and mass, interface patches, unknowns, processor time, first frequencies, and why it was refused.
`--geometry-only` ends before the mesh. `FILE:PRIM` names one link. Each link is meshed in a process of its own
(`--jobs`): where that crashes or hangs, this is the outcome of the link. With `--resume` links that the CSV file has
are not meshed again.

With `--sizes 2 1.4 1 0.7` each link is meshed with elements of several sizes, given in metres with a unit (`8mm`) or as
multiples of the automatic size; `auto` is the mesh that a shot gets, refined for its first frequencies. Errors of
frequencies are relative to the mesh with the most nodes, which itself has an error; its estimate is shown too. With
`--refine 40000` the automatic mesh is also refined where its error arises, to so many nodes, and its stiffness
extrapolated: a reference in a fraction of the time, which does not show errors of the shape. Below the table is, for
each link, how far the automatic mesh is off, and how far the first frequency spreads over the meshes.
"""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np
from calmotion import ShotError

from ..common.parsers import bench_parser
from ..common.tables import markdown, resumed_rows, say, write_rows
from ..scenes.links import Link, attachments_of, frames_of, links_of_all
from .robots import survey_robots
from .survey import LinkRow
from .tables import done, summary, survey_tables

_REFINED = "refined"  # word for a row of it
_AUTO = "auto"  # word for the automatic mesh among element sizes
_FINEST = 1e-3  # relative error of the compliance that ends a refinement


@dataclass(frozen=True)
class Row:
    """One mesh of one link.

    Attributes:
        link: Name.
        size: Element size [mm]; not a number: the automatic mesh; 0: that mesh, refined.
        nodes: Of the ten-node tetrahedra.
        mesh_time: [s].
        f1, f2, f3: First frequencies [Hz], held by the parent's joint; elastic ones of the free body without.
        error: Largest relative difference of the three to the mesh with the most nodes [%].
        estimate: Largest error of the three estimated on this mesh alone [%]; of the automatic mesh what is reported.
        volume_error: Of the tetrahedra against the surface [%].
        held: What holds the body: `joint` or `free`.
    """

    link: str
    size: float
    nodes: int
    mesh_time: float
    f1: float
    f2: float
    f3: float
    error: float
    estimate: float
    volume_error: float
    held: str


def study(link: Link, sizes: Sequence[str], time_limit: float, refine: int = 0) -> list[Row]:
    """One row for each element size, coarse to fine.

    Args:
        link: With surfaces.
        sizes: Multiples of the automatic size, lengths with a unit, or `auto` for the automatic mesh.
        time_limit: Processor time of one mesh [s].
        refine: Number of nodes to which the automatic mesh is refined as well; 0: it is not.

    Raises:
        ShotError: The surfaces enclose no volume.
    """
    from calmotion.mesh import element_size, shape_of, solid_of
    from calmotion.tolerance import MeshOptions, mesh_body

    solid = solid_of(link.body, link.body.surfaces)
    automatic = element_size(shape_of(solid.points, solid.triangles))
    rows = []
    given = sorted((_length(text, automatic) for text in sizes if text != _AUTO), reverse=True)
    for size in [float("nan")] * (_AUTO in sizes) + given:
        try:
            start = time.perf_counter()
            asked = -1.0 if np.isnan(size) else size
            options = MeshOptions(element_size=asked, time_limit=time_limit, cache=False)
            mesh = mesh_body(0, link.body, options, frames_of(link), attachments_of(link))
            meshed = time.perf_counter() - start
            row, told = _row(link, size, mesh, meshed), mesh.quality.frequency_error
            # of the automatic mesh what users are told
            rows.append(replace(row, estimate=100.0 * told) if np.isnan(size) and told is not None else row)
            if np.isnan(size) and refine:
                rows.append(_refined(link, mesh, refine))
        except ShotError as error:
            say(f"{link.name} at {_AUTO if np.isnan(size) else f'{1e3 * size:.3g} mm'}: {error}")
    return _compared(rows)


def _refined(link: Link, mesh: Any, nodes: int) -> Row:
    """The row of an automatic mesh that is refined to a number of nodes, with the stiffness of ever finer ones."""
    from calmotion.reduction import MeshController, root_at

    start = time.perf_counter()
    attachments = attachments_of(link)
    controller = MeshController(_FINEST, nodes, "finer")
    finer = controller.refined(mesh, link.body, attachments, root_at(attachments, link.carrier))
    row = _row(link, 0.0, finer, time.perf_counter() - start)
    return replace(row, estimate=100.0 * (finer.quality.frequency_error or 0.0))


def _row(link: Link, size: float, mesh: Any, mesh_time: float) -> Row:
    from calmotion.mesh import interface_patches
    from calmotion.reduction import assemble, frequency_errors

    settings = link.body.flexible
    assert settings is not None
    model = assemble(mesh.points, mesh.tets, settings.material)
    clamped = None
    if link.carrier is not None:
        try:
            patches = interface_patches(
                model.mesh, attachments_of(link), settings.interface_radius, link.body.path, mesh.patches
            )
            clamped = patches[0].nodes
        except ShotError:
            clamped = None  # a joint off the link's surface is not a property of its mesh
    frequencies, errors = frequency_errors(model, settings.material, 3, clamped)
    frequencies = np.sqrt(mesh.quality.stiffness_factor) * frequencies
    return Row(
        link=link.name,
        size=1e3 * size,
        nodes=len(model.mesh.nodes),
        mesh_time=mesh_time,
        f1=float(frequencies[0]),
        f2=float(frequencies[1]),
        f3=float(frequencies[2]),
        error=float("nan"),
        estimate=100.0 * float(errors.max()),
        volume_error=100.0 * mesh.quality.volume_error,
        held="free" if clamped is None else "joint",
    )


def _compared(rows: list[Row]) -> list[Row]:
    """The rows with their differences to the one with the most nodes, which itself has none."""
    if not rows:
        return rows
    finest = max(rows, key=lambda row: row.nodes)
    truth = np.array([finest.f1, finest.f2, finest.f3])
    done = []
    for row in rows:
        error = 100.0 * float(np.abs(np.array([row.f1, row.f2, row.f3]) / truth - 1.0).max())
        done.append(row if row is finest else replace(row, error=error))
    return done


def _length(text: str, automatic: float) -> float:
    from calmotion.host import parse_quantity

    try:
        return float(text) * automatic
    except ValueError:
        return parse_quantity(text, "m")


def table(rows: Sequence[Row]) -> str:
    """The rows as a Markdown table."""
    heads = [
        "link", "size mm", "nodes", "mesh s", "f1 Hz", "f2 Hz", "f3 Hz", "error %", "estimate %",
        "volume %", "held",
    ]  # fmt: skip
    shown = ([_size(row.size) if k == 1 else _cell(value) for k, value in enumerate(astuple(row))] for row in rows)
    return markdown(heads, shown, "---:")


def _size(size: float) -> str:
    return _AUTO if np.isnan(size) else _cell(size) if size else _REFINED


def verdicts(rows: Sequence[Row]) -> str:
    """A line for each link with several meshes: error of the automatic mesh, spread of the first frequency."""
    lines = []
    for link in dict.fromkeys(row.link for row in rows):
        own = [row for row in rows if row.link == link]
        if len(own) < 2:
            continue
        finest = max(own, key=lambda row: row.nodes)
        first = [row.f1 for row in own]
        parts = [
            f"the automatic mesh is {row.error:.2g}% off the finest one ({finest.nodes} nodes), "
            f"{row.estimate:.2g}% are estimated"
            for row in own if np.isnan(row.size) and row is not finest
        ]  # fmt: skip
        spread = 100.0 * (max(first) - min(first)) / finest.f1
        parts.append(f"the first frequency spreads by {spread:.2g}% over {len(own)} meshes")
        lines.append(f"{link}: {'; '.join(parts)}\n")
    return "".join(lines)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "-" if np.isnan(value) else f"{value:.4g}" if abs(value) >= 10.0 else f"{value:.2f}"
    return str(value)


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; exit status 1 when no link could be meshed."""
    parser = bench_parser("meshing", __doc__)
    parser.add_argument("links", nargs="+", metavar="FILE[:PRIM]", help="links; all bodies without a prim")
    parser.add_argument("--sizes", nargs="+", help="multiples of the automatic element size, lengths (8mm), auto")
    parser.add_argument("--geometry-only", action="store_true", help="make solids, and no meshes")
    parser.add_argument("--time-limit", type=float, default=60.0, help="processor time of the meshes of a link [s]")
    parser.add_argument(
        "--refine", type=int, default=0, metavar="NODES", help="also refine the automatic mesh to these"
    )
    parser.add_argument("--jobs", type=int, default=1, help="links at a time, each in a process of its own")
    parser.add_argument("--csv", metavar="FILE", help="also write all columns, after each link")
    parser.add_argument("--resume", action="store_true", help="keep the links that the file of --csv has")
    options = parser.parse_args(arguments)
    known: list[LinkRow] = [] if options.sizes else resumed_rows(parser, options, LinkRow)
    found = list(links_of_all(options.links, say))
    if options.sizes:
        return _study_all([link for link, _ in found], options)
    rows = survey_robots(found, options, known)
    print(survey_tables(rows) + "\n" + summary(rows, options.geometry_only), end="")
    return 0 if done(rows, options.geometry_only) else 1


def _study_all(links: Sequence[Link], options: Namespace) -> int:
    rows: list[Row] = []
    for link in links:
        try:
            rows += study(link, options.sizes, options.time_limit, options.refine)
        except ShotError as error:
            say(str(error))
        if options.csv:
            write_rows(options.csv, Row, rows)
    lines = verdicts(rows)
    print(table(rows) + (f"\n{lines}" if lines else ""), end="")
    return 0 if rows else 1
