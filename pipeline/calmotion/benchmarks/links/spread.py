"""How much the first frequencies of links depend on their meshes: the automatic mesh, less and more closely.

`calmotion bench mesh-spread ROBOT ... [--factors 0.5 1.5] [--csv FILE [--resume]] [--markdown FILE] [--jobs N]` meshes
each link as a shot would, and again with its surface followed within other distances (envelopes): so many times the
automatic one. Such a mesh has other elements, walls, slits and patches, so that the difference of its frequencies
contains what an estimate on one mesh does not see. Links that are copies or mirror images of another one are left out.
`FILE:PRIM` names one link.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from calmotion.benchmarks.common.messages import say
from calmotion.benchmarks.common.parsers import links_parser, output_options
from calmotion.benchmarks.common.tables import markdown, resumed_rows, write_rows
from calmotion.benchmarks.links.robots import file_of, first_of_its_kind, patience
from calmotion.benchmarks.links.survey import LinkRow, faulty_row, survey_row
from calmotion.benchmarks.scenes.links import Link, links_of_all
from calmotion.benchmarks.scenes.mesher import mesher
from calmotion.shot.character import Array
from calmotion.support.processes.workers import Fault, results_of
from calmotion.workflow.plain import plain

_WANTED = 2.0  # largest difference that is wanted [%]


@dataclass(frozen=True)
class SpreadRow(LinkRow):
    """One mesh of one link; the others as of `LinkRow`.

    Attributes:
        factor: Of the distance that the mesh may be from its surface; 1: the automatic mesh.
    """

    factor: float = 1.0


def spread_row(link: Link, robot: str, factor: float, time_limit: float) -> SpreadRow:
    """The row of a mesh, for a process of its own.

    Args:
        link: From `read_links`.
        robot: Its name.
        factor: Of the distance that the mesh may be from its surface.
        time_limit: Processor time of the mesh [s].
    """
    return SpreadRow(**asdict(survey_row(link, robot, mesher(), time_limit, envelope_factor=factor)), factor=factor)


def differences(rows: Sequence[SpreadRow]) -> Array:
    """Relative differences of frequencies to those of the automatic mesh [%], shape [m, 3], for all rows but its own.

    Args:
        rows: Of one link; without an automatic mesh there are none.
    """
    auto = [row for row in rows if row.factor == 1.0 and row.nodes]
    others = [row for row in rows if row.factor != 1.0 and row.nodes]
    if not auto or not others:
        return np.zeros((0, 3))
    own = np.array([auto[0].f1, auto[0].f2, auto[0].f3])
    return np.asarray(100.0 * (np.array([[row.f1, row.f2, row.f3] for row in others]) / own - 1.0))


def by_link(rows: Sequence[SpreadRow]) -> list[list[SpreadRow]]:
    """The rows of each link, the automatic mesh first."""
    links = dict.fromkeys((row.robot, row.link) for row in rows)
    order = sorted(rows, key=lambda row: (row.factor != 1.0, row.factor))
    return [[row for row in order if (row.robot, row.link) == link] for link in links]


def table(rows: Sequence[SpreadRow]) -> str:
    """A row for each link, and below it how many of them are within what is wanted."""
    heads = ["robot", "link", "f1, f2, f3 Hz", "estimate %", "envelope: differences %", "largest of f1 %", "of all %"]
    shown, first, three = [], [], []
    for own in by_link(rows):
        auto, off = own[0], differences(own)
        others = [row for row in own if row.factor != 1.0 and row.nodes]
        told = [f"{row.factor:g}: " + ", ".join(map("{:+.2f}".format, x)) for row, x in zip(others, off, strict=False)]
        told += [f"{row.factor:g}: {row.note}" for row in own if not row.nodes]
        largest = ["-", "-"]
        if len(off):
            first.append(float(np.abs(off[:, 0]).max()))
            three.append(float(np.abs(off).max()))
            largest = [f"{first[-1]:.2f}", f"{three[-1]:.2f}"]
        frequencies = f"{auto.f1:.4g}, {auto.f2:.4g}, {auto.f3:.4g}"
        shown.append([auto.robot, auto.link, frequencies, f"{auto.estimate:.2f}", "; ".join(told), *largest])
    return markdown(heads, shown) + _counted(first, three)


def _counted(first: Sequence[float], three: Sequence[float]) -> str:
    if not first:
        return ""
    within = [sum(value <= _WANTED for value in values) for values in (first, three)]
    return (
        f"\nOf {len(first)} links the first frequency changes by no more than {_WANTED:g}% in {within[0]} "
        f"({np.median(first):.2g}% in the median), all three in {within[1]} ({np.median(three):.2g}% in the median).\n"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; exit status 1 when no link could be meshed."""
    parser = links_parser("mesh-spread", __doc__)
    parser.add_argument("--factors", nargs="+", type=float, default=[0.5, 1.5], help="of the envelope")
    parser.add_argument("--time-limit", type=float, default=180.0, help="processor time of a mesh [s]")
    parser.add_argument("--jobs", type=int, default=1, help="meshes at a time, each in a process of its own")
    output_options(parser, csv="a row for each mesh", markdown=True)
    parser.add_argument("--resume", action="store_true", help="keep the rows that the file of --csv has")
    options = parser.parse_args(arguments)
    if not all(factor > 0.0 for factor in options.factors):
        parser.error("--factors of the envelope are positive")
    rows: list[SpreadRow] = resumed_rows(parser, options, SpreadRow)
    found = [(link, Path(file_of(source)).stem) for source, link in links_of_all(options.links, say)]
    first = first_of_its_kind([link for link, _ in found])
    known = {(row.robot, row.link, row.factor) for row in rows}
    work = [
        (*found[k], factor, options.time_limit)
        for k in sorted(set(first)) for factor in dict.fromkeys((1.0, *options.factors))
        if (found[k][1], found[k][0].name, factor) not in known
    ]  # fmt: skip
    for index, result in results_of(spread_row, work, options.jobs, patience(options.time_limit)):
        link, robot, factor, _ = work[index]
        if isinstance(result, Fault):
            result = SpreadRow(**asdict(faulty_row(link, robot, result)), factor=factor)
        rows.append(result)
        say(f"[{len(rows) - len(known)}/{len(work)}] {robot} {link.name}, envelope times {factor:g}: {result.outcome}")
        if options.csv:
            write_rows(options.csv, SpreadRow, rows)
    shown = table(rows)
    if options.markdown:
        Path(options.markdown).write_text(shown, encoding="utf-8")
    if options.json:
        print(json.dumps(plain({"rows": [asdict(row) for row in rows]})))
    else:
        print(shown, end="")
    return 0 if any(row.nodes for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
