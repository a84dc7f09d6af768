"""The survey of all links of robots, each in a process of its own; what is written while it goes on."""

from __future__ import annotations

import shlex
import time
from argparse import Namespace
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.benchmarks.common.tables import read_rows, write_table
from calmotion.benchmarks.links.survey import LinkRow, faulty_row, same_row, survey_link
from calmotion.benchmarks.links.tables import page, survey_table
from calmotion.benchmarks.scenes.links import Link, frames_of
from calmotion.benchmarks.scenes.mesher import mesher
from calmotion.reduction.cache import cache_key
from calmotion.support.processes.workers import Fault, results_of

_SAME = 1e-7  # distance of points of links that are the same [m]
_PATIENCE = 30.0  # of the time limit, that a link may take on a busy machine


def survey_robots(found: Sequence[tuple[Link, str]], options: Namespace, say: Callable[[str], None]) -> list[LinkRow]:
    """The rows of all links, written after each: a fault in one link is its own outcome, and loses no other.

    Args:
        found: Links and the names of their robots.
        options: Of `calmotion bench meshing`.
        say: Told how far it is.

    Raises:
        ShotError: The table that is to be resumed is not one of links.
    """
    folder = Path(options.page or options.output or ".").parent
    pictures = [
        str(folder / "meshing" / f"{robot}_{link.name}.png".replace(" ", "_")) if link.name in options.pictures else ""
        for link, robot in found
    ]
    if any(pictures):
        (folder / "meshing").mkdir(parents=True, exist_ok=True)
    first = first_of_its_kind([link for link, _ in found])
    kept = {(row.robot, row.link): row for row in _resumed(options)}
    rows = {k: kept[robot, link.name] for k, (link, robot) in enumerate(found) if (robot, link.name) in kept}
    own = [k for k in sorted(set(first)) if any(same == k and n not in rows for n, same in enumerate(first))]
    work = [(found[k][0], found[k][1], options.time_limit, options.geometry_only, pictures[k]) for k in own]
    start, longest = time.monotonic(), patience(options.time_limit)

    def keep() -> None:
        so_far = {k: rows[k] for k in sorted(rows)}
        if options.output:
            write_table(options.output, LinkRow, list(so_far.values()), survey_table)
        if options.page:
            drawn = [(f"{r.robot}, {r.link}", Path(pictures[k])) for k, r in so_far.items() if pictures[k]]
            shown = [(title, f"meshing/{file.name}") for title, file in drawn if file.exists()]
            text = page(list(so_far.values()), shown, _command(options))
            Path(options.page).write_text(text, encoding="utf-8")

    for done_work, (index, result) in enumerate(results_of(survey_link, work, options.jobs, longest), 1):
        link, robot = found[own[index]]
        row = faulty_row(link, robot, result) if isinstance(result, Fault) else result
        for k, same in enumerate(first):
            if same == own[index]:
                rows[k] = row if k == same else same_row(row, found[k][0], found[k][1])
        left = (time.monotonic() - start) / done_work * (len(work) - done_work)
        say(f"[{len(rows)}/{len(found)}] {robot} {link.name}: {row.outcome}; about {left / 60.0:.0f} min left")
        keep()
    if not work:
        keep()
    return [rows[k] for k in sorted(rows)]


def patience(time_limit: float) -> float:
    """After which the process of a link is ended [s], by the limit of its processor time [s]."""
    return _PATIENCE * time_limit + 300.0


def _resumed(options: Namespace) -> list[LinkRow]:
    return read_rows(options.output, LinkRow) if options.resume else []


def first_of_its_kind(links: Sequence[Link]) -> list[int]:
    """For each link the index of the first one that has its mesh, as the mesher finds them, and its mass."""
    twins = import_module(mesher().__name__.rsplit(".", 1)[0] + ".sources.twins")
    kinds: dict[str, int] = {}
    shapes: list[Any] = []
    firsts: list[int] = []
    for index, link in enumerate(links):
        joints = frames_of(link)
        shapes.append(twins.Link(link.body, None, -1.0, link.carrier is not None, joints))
        surfaces = [(np.round(s.points / _SAME) + 0.0, s.triangles, s.visible) for s in link.body.surfaces]
        frames = [(np.round(f.position / _SAME) + 0.0, np.round(f.axis, 6) + 0.0) for f in joints]
        first = kinds.setdefault(cache_key((surfaces, frames, _mass(link), link.body.tets)), index)
        if first == index and link.body.tets is None:
            earlier = [k for k in sorted(set(firsts)) if _mass(links[k]) == _mass(link) and links[k].body.tets is None]
            twin = twins.twin_of(shapes[index], [shapes[k] for k in earlier])
            first = index if twin is None else earlier[twin[0]]
        firsts.append(first if first == index else firsts[first])
    return firsts


def _mass(link: Link) -> float | None:
    return None if link.mass is None else float(f"{link.mass.mass:.5g}")


def _command(options: Namespace) -> str:
    """The command that makes a page, with the robots by their names."""
    names = " ".join(shlex.quote(Path(file_of(source)).name) for source in options.links)
    pictures = f" --pictures {' '.join(options.pictures)}" if options.pictures else ""
    return f"calmotion bench meshing {names}{pictures} --page {options.page}"


def file_of(source: str) -> str:
    """The file of FILE or FILE:PRIM."""
    return source.rpartition(":")[0] or source
