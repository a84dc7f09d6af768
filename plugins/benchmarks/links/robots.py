"""The survey of all links of robots, each in a process of its own; what is written while it goes on."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Sequence
from typing import Any

import numpy as np
from calmotion.support import Fault, results_of

from ..common.tables import say, write_rows
from ..scenes.links import Link, frames_of
from .survey import LinkRow, faulty_row, same_row, survey_link

_PATIENCE = 30.0  # of the time limit, that a link may take on a busy machine


def survey_robots(found: Sequence[tuple[Link, str]], options: Namespace, known: Sequence[LinkRow]) -> list[LinkRow]:
    """The rows of all links, written after each: a fault in one link is its own outcome, and loses no other.

    Args:
        found: Links and the names of their robots.
        options: Of `calmotion bench meshing`.
        known: Rows of links that are not meshed again.
    """
    first = first_of_its_kind([link for link, _ in found])
    kept = {(row.robot, row.link): row for row in known}
    rows = {k: kept[robot, link.name] for k, (link, robot) in enumerate(found) if (robot, link.name) in kept}
    own = [k for k in sorted(set(first)) if any(same == k and n not in rows for n, same in enumerate(first))]
    work = [(*found[k], options.time_limit, options.geometry_only) for k in own]
    start = time.monotonic()
    results = results_of(survey_link, work, options.jobs, patience(options.time_limit))
    for done_work, (index, result) in enumerate(results, 1):
        link, robot = found[own[index]]
        row = faulty_row(link, robot, result) if isinstance(result, Fault) else result
        for k, same in enumerate(first):
            if same == own[index]:
                rows[k] = row if k == same else same_row(row, *found[k])
        left = (time.monotonic() - start) / done_work * (len(work) - done_work)
        say(f"[{len(rows)}/{len(found)}] {robot} {link.name}: {row.outcome}; about {left / 60.0:.0f} min left")
        if options.csv:
            write_rows(options.csv, LinkRow, [rows[k] for k in sorted(rows)])
    return [rows[k] for k in sorted(rows)]


def patience(time_limit: float) -> float:
    """After which the process of a link is ended [s], by the limit of its processor time [s]."""
    return _PATIENCE * time_limit + 300.0


def first_of_its_kind(links: Sequence[Link]) -> list[int]:
    """For each link the index of the first one that has its mesh, as the mesher finds them, and its mass."""
    from calmotion.mesh import twin_of

    firsts: list[int] = []
    shapes = [_shape(link) for link in links]
    for index, link in enumerate(links):
        earlier = [k for k in sorted(set(firsts)) if _mass(links[k]) == _mass(link)]
        twin = twin_of(shapes[index], [shapes[k] for k in earlier])
        firsts.append(index if twin is None else earlier[twin[0]])
    return firsts


def _shape(link: Link) -> Any:
    """What decides its mesh; None where its tetrahedra are given, or it has no visual surfaces."""
    from calmotion.mesh import Link as Shape
    from calmotion.mesh import joined_surfaces

    visible = [surface for surface in link.body.surfaces if surface.visible and len(surface.triangles)]
    joined = joined_surfaces(visible) if visible and link.body.tets is None else None
    if joined is None or not np.isfinite(joined[0]).all():
        return None
    return Shape(link.body, *joined, "", -1.0, link.carrier is not None, frames_of(link))


def _mass(link: Link) -> float | None:
    return None if link.mass is None else float(f"{link.mass.mass:.5g}")
