"""What becomes of the links of real robots: solids, meshes, frequencies and errors.

`calmotion bench meshing ROBOT ... [--csv FILE [--resume]]` has a row for each link: what its solid was made of, its
volume and mass, interface patches, unknowns, processor time, first frequencies, and why it was refused.
`--geometry-only` ends before the mesh, `--reference` compares with a finer one (minutes). `FILE:PRIM` names one link.
Each link is meshed in a process of its own (`--jobs`): where that crashes or hangs, this is the outcome of the link.
With `--resume` links that the CSV file has are not meshed again. The command fails where no link could be meshed.
"""

import time
from collections.abc import Sequence

import numpy as np
from calmotion.support import Fault, results_of

from ..common.reporting import bench_parser, finish, keep, kept_rows, say
from ..scenes.links import links_of_all
from .survey import LIMIT, LinkRow, faulty_row, survey_link

PATIENCE = 30.0  # of the time limit, that a link may take on a busy machine
NEAR, FAR = 2.0, 5.0  # difference to a finer mesh that is wanted, and that must be told [%]
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
COLUMNS = (
    "robot, link, source, volume_cm3, mass_kg, nodes, processor_s, f1_hz, by_sections_hz, estimate_percent, "
    "difference_percent, note"
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; exit status 1 when no link could be meshed."""
    parser = bench_parser("meshing", __doc__)
    parser.add_argument("links", nargs="+", metavar="FILE[:PRIM]", help="links; all bodies without a prim")
    parser.add_argument("--geometry-only", action="store_true", help="make solids, and no meshes")
    parser.add_argument("--reference", action="store_true", help="compare frequencies with those of a finer mesh")
    parser.add_argument("--time-limit", type=float, default=60.0, help="processor time of the meshes of a link [s]")
    parser.add_argument("--jobs", type=int, default=1, help="links at a time, each in a process of its own")
    parser.add_argument("--resume", action="store_true", help="keep the links that the file of --csv has")
    options = parser.parse_args(arguments)
    rows: list[LinkRow] = kept_rows(options, LinkRow)
    known = {(row.robot, row.link) for row in rows}
    found = [pair for pair in links_of_all(options.links, say) if (pair[1], pair[0].name) not in known]
    work = [(*pair, options.time_limit, options.geometry_only, options.reference) for pair in found]
    start = time.monotonic()
    results = results_of(survey_link, work, options.jobs, PATIENCE * options.time_limit + 300.0)
    for done, (index, result) in enumerate(results, 1):
        link, robot = found[index]
        rows.append(faulty_row(link, robot, result) if isinstance(result, Fault) else result)
        left = (time.monotonic() - start) / done * (len(work) - done)
        say(f"[{done}/{len(work)}] {robot} {link.name}: {rows[-1].outcome}; about {left / 60.0:.0f} min left")
        keep(options, LinkRow, rows)
    finish(options, "Links", rows, columns=COLUMNS.split(", "), lines=summary(rows, options.geometry_only))
    return int(not any(made(row, options.geometry_only) for row in rows))


def made(row: LinkRow, geometry_only: bool = False) -> bool:
    """Whether a link is flexible, or has a solid."""
    return row.flexible or (geometry_only and row.source not in ("refused", "fault", "none"))


def summary(rows: Sequence[LinkRow], geometry_only: bool = False) -> list[str]:
    """How many links became flexible, how many of these within the wanted time, and why the others did not."""
    links = [row for row in rows if row.source != "none"]
    good = [row for row in links if made(row, geometry_only)]
    what = "have a solid" if geometry_only else "are flexible"
    fast = sum(row.processor_s <= LIMIT for row in good)
    lines = [
        f"{len(good)} of {len(links)} links {what} ({100.0 * len(good) / max(len(links), 1):.3g}%); "
        f"{fast} took no more than {LIMIT:g} s of processor time ({100.0 * fast / max(len(good), 1):.3g}%)"
    ]
    ratios = np.array([row.by_sections_hz / row.f1_hz for row in good])
    ratios = ratios[np.isfinite(ratios)]
    if len(ratios):
        within = [100.0 * float(np.mean(np.abs(np.log(ratios)) <= np.log(factor))) for factor in (2.0, 1.5)]
        spread = ", ".join(f"{ratio:.2f}" for ratio in np.quantile(ratios, QUANTILES))
        lines.append(
            f"first frequencies by sections over those of the meshes: {within[0]:.3g}% of {len(ratios)} links within a "
            f"factor of 2, {within[1]:.3g}% within 1.5; at 5, 25, 50, 75 and 95% {spread}"
        )
    compared = [row for row in good if np.isfinite(row.difference_percent)]
    if compared:
        near = np.mean([row.difference_percent <= NEAR for row in compared])
        silent = sum(row.difference_percent > max(FAR, row.estimate_percent) for row in compared)
        lines.append(
            f"first three frequencies against finer meshes: within {NEAR:g}% for {100.0 * near:.3g}% of "
            f"{len(compared)} links, at most {max(row.difference_percent for row in compared):.2g}% off; "
            f"{silent} more than {FAR:g}% off without being told so"
        )
    return lines + [f"{row.robot} {row.link}: {row.note}" for row in links if row not in good]
