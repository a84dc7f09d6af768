"""What becomes of the links of real robots, and the time and error of their meshes against element size.

`calmotion bench meshing ROBOT ... [-o table.md|table.csv]` has a row for each link: what its solid was made of, its
volume and mass, interface patches, unknowns, processor time, first frequencies, and why it was refused.
`--geometry-only` ends before the mesh. `FILE:PRIM` names one link.

With `--sizes 2 1.4 1 0.7` each link is meshed with elements of several sizes, given in metres with a unit (`8mm`) or as
multiples of the automatic size. Errors of frequencies are relative to the mesh with the most nodes, which itself has an
error; its estimate is shown too.
"""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.benchmarks.common.parsers import bench_parser
from calmotion.benchmarks.common.tables import markdown, write_rows
from calmotion.benchmarks.scenes.links import Link, read_links
from calmotion.benchmarks.speed.link_survey import LinkRow, summary, survey_row, survey_table
from calmotion.errors import ShotError


@dataclass(frozen=True)
class Row:
    """One mesh of one link.

    Attributes:
        link: Name.
        size: Element size [mm].
        nodes: Of the ten-node tetrahedra.
        mesh_time, reduce_time: [s].
        f1, f2, f3: First frequencies [Hz], held by the parent's joint; elastic ones of the free body without.
        error: Largest relative difference of the three to the mesh with the most nodes [%].
        estimate: Largest error of the three estimated on this mesh alone [%].
        volume_error: Of the tetrahedra against the surface [%].
        held: What holds the body: `joint` or `free`.
    """

    link: str
    size: float
    nodes: int
    mesh_time: float
    reduce_time: float
    f1: float
    f2: float
    f3: float
    error: float
    estimate: float
    volume_error: float
    held: str


def study(link: Link, sizes: Sequence[str], time_limit: float, say: Callable[[str], None]) -> list[Row]:
    """One row for each element size, coarse to fine.

    Args:
        link: With surfaces.
        sizes: Multiples of the automatic size, or lengths with a unit.
        time_limit: Processor time of one mesh [s].
        say: Told what could not be done.

    Raises:
        ShotError: The surfaces enclose no volume.
    """
    from calmotion.accuracy.element_size import element_size, shape_of

    mesher = _mesher()
    solid = mesher.solid_of(link.body, link.body.surfaces)
    shape = shape_of(solid.points, solid.triangles)
    automatic = element_size(shape)
    rows = []
    for size in sorted((_length(text, automatic) for text in sizes), reverse=True):
        try:
            start = time.perf_counter()
            mesh = mesher.filled(0, link.body, solid, shape, size, mesher.ProcessorTime(time_limit), False)
            meshed = time.perf_counter() - start
            rows.append(_row(link, size, mesh, meshed))
        except ShotError as error:
            say(f"{link.name} at {1e3 * size:.3g} mm: {error}")
    return _compared(rows)


def _row(link: Link, size: float, mesh: Any, mesh_time: float) -> Row:
    from calmotion.reduction.discretization_error import frequency_errors
    from calmotion.reduction.elements.assembly import assemble
    from calmotion.reduction.interfaces.interface_patches import AttachmentFrame, interface_patches
    from calmotion.reduction.reduce import reduce_body

    settings = link.body.flexible
    assert settings is not None
    model = assemble(mesh.points, mesh.tets, settings.material)
    clamped, reduce_time = None, float("nan")
    if link.carrier is not None:
        anchor = AttachmentFrame(link.body.path, link.carrier, "interface")
        try:
            clamped = interface_patches(model.mesh, [anchor], settings.interface_radius, link.body.path)[0].nodes
            start = time.perf_counter()
            reduce_body(mesh, link.body, [anchor], (), 0)
            reduce_time = time.perf_counter() - start
        except ShotError:
            clamped = None  # a joint off the link's surface is not a property of its mesh
    frequencies, errors = frequency_errors(model, settings.material, 3, clamped)
    return Row(
        link=link.name,
        size=1e3 * size,
        nodes=len(model.mesh.nodes),
        mesh_time=mesh_time,
        reduce_time=reduce_time,
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
    from calmotion.host.units import parse_quantity

    try:
        return float(text) * automatic
    except ValueError:
        return parse_quantity(text, "m")


def _mesher() -> Any:
    """The module of the bundled mesher that makes meshes."""
    from calmotion.host import open_host

    operator = open_host().operators["fe.mesh"]
    return import_module(operator.__module__.rsplit(".", 1)[0] + ".body_mesh")


def table(rows: Sequence[Row]) -> str:
    """The rows as a Markdown table."""
    heads = [
        "link", "size mm", "nodes", "mesh s", "reduce s", "f1 Hz", "f2 Hz", "f3 Hz", "error %", "estimate %",
        "volume %", "held",
    ]  # fmt: skip
    return markdown(heads, ([_cell(value) for value in astuple(row)] for row in rows), "---:")


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "-" if np.isnan(value) else f"{value:.4g}" if abs(value) >= 10.0 else f"{value:.2f}"
    return str(value)


def write(rows: Sequence[Any], path: str) -> None:
    """The rows, of one kind, as CSV or Markdown, by the suffix of the file."""
    if path.lower().endswith(".csv"):
        write_rows(path, type(rows[0]), rows)
    else:
        shown = survey_table(rows) if isinstance(rows[0], LinkRow) else table(rows)
        Path(path).write_text(shown, encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; exit status 1 when no link could be meshed."""
    parser = bench_parser("meshing", __doc__)
    parser.add_argument("links", nargs="+", metavar="FILE[:PRIM]", help="links; all bodies without a prim")
    parser.add_argument("--sizes", nargs="+", help="multiples of the automatic element size, or lengths (8mm)")
    parser.add_argument("--geometry-only", action="store_true", help="make solids, and no meshes")
    parser.add_argument("--time-limit", type=float, default=60.0, help="processor time of the meshes of a link [s]")
    parser.add_argument("-o", "--output", help="file of the table, .md or .csv")
    options = parser.parse_args(arguments)

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    rows: list[Any] = []
    for source in options.links:
        try:
            links = read_links(source)
        except ShotError as error:
            say(str(error))
            continue
        for link in links:
            rows += _rows(link, source, options, say)
            if options.output and rows:
                write(rows, options.output)  # after each link: hours of work are not lost with the last of them
    if options.sizes:
        print(table(rows), end="")
        return 0 if rows else 1
    print(survey_table(rows) + "\n" + summary(rows, options.geometry_only), end="")
    return 0 if any(row.flexible or (options.geometry_only and row.source != "refused") for row in rows) else 1


def _rows(link: Link, source: str, options: Namespace, say: Callable[[str], None]) -> list[Any]:
    if not options.sizes:
        robot = Path(source.rpartition(":")[0] or source).stem
        say(f"{robot} {link.name}")
        return [survey_row(link, robot, _mesher(), options.time_limit, options.geometry_only)]
    try:
        return list(study(link, options.sizes, options.time_limit, say))
    except ShotError as error:
        say(str(error))
        return []


if __name__ == "__main__":
    sys.exit(main())
