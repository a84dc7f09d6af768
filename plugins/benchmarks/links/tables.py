"""Tables about what becomes of the links of robots."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..common.tables import markdown
from .survey import COPY, LIMIT, LinkRow

_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
_HONEST = 20.0  # estimate from which a link counts as coarse [%]


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "-" if np.isnan(value) else f"{value:.3g}"
    return str(value).replace("|", "/").replace("\n", " ")


def done(rows: Sequence[LinkRow], geometry_only: bool = False) -> list[LinkRow]:
    """The links that are flexible, or have a solid."""
    return [row for row in rows if row.flexible or (geometry_only and row.source not in ("refused", "fault", "none"))]


def summary(rows: Sequence[LinkRow], geometry_only: bool = False) -> str:
    """How many links became flexible, how many of these within the wanted time, and why the others did not."""
    links = [row for row in rows if row.source != "none"]
    made = done(links, geometry_only)
    what = "have a solid" if geometry_only else "are flexible"
    fast = sum(row.seconds <= LIMIT for row in made)
    lines = [
        f"{len(made)} of {len(links)} links {what} ({100.0 * len(made) / max(len(links), 1):.3g}%); "
        f"{fast} took no more than {LIMIT:g} s of processor time ({100.0 * fast / max(len(made), 1):.3g}%)\n"
    ]
    copies = [row for row in made if row.note.startswith(COPY)]
    if copies:
        fast += sum(row.seconds > LIMIT for row in copies)
        lines.append(
            f"{len(copies)} are copies or mirror images of another link and are meshed with it: their rows have its "
            f"time. If they count as links that take none, {fast} took no more ({100.0 * fast / len(made):.3g}%)\n"
        )
    ratios = np.array([row.by_sections / row.f1 for row in made])
    ratios = ratios[np.isfinite(ratios)]
    if len(ratios):
        within = [100.0 * float(np.mean(np.abs(np.log(ratios)) <= np.log(factor))) for factor in (2.0, 1.5)]
        spread = ", ".join(f"{ratio:.2f}" for ratio in np.quantile(ratios, _QUANTILES))
        lines.append(
            f"first frequencies by sections over those of the meshes: {within[0]:.3g}% of {len(ratios)} links within a "
            f"factor of 2, {within[1]:.3g}% within 1.5; at 5, 25, 50, 75 and 95% {spread}\n"
        )
    lines += [f"{row.robot} {row.link}: {row.note}\n" for row in links if row not in made]
    return "".join(lines)


def survey_tables(rows: Sequence[LinkRow]) -> str:
    """The numbers of each robot, and a row of each link, as Markdown."""
    links = [row for row in rows if row.source != "none"]
    return f"## Robots\n\n{_robots(links)}\n## Links\n\n{_links(links)}"


def _robots(links: Sequence[LinkRow]) -> str:
    """Numbers of each robot."""
    heads = ["robot", "links", "flexible", "from visual surfaces", "median s", "largest s", "median estimate %"]
    table = []
    for robot in dict.fromkeys(row.robot for row in links):
        own = [row for row in links if row.robot == robot]
        made = done(own)
        visual = sum("visual" in row.source for row in made)
        seconds = [row.seconds for row in made] or [np.nan]
        estimates = [row.estimate for row in made if not np.isnan(row.estimate)] or [np.nan]
        table.append(
            [
                robot, str(len(own)), str(len(made)), str(visual), _cell(float(np.median(seconds))),
                _cell(float(max(seconds))), _cell(float(np.median(estimates))),
            ]
        )  # fmt: skip
    return markdown(heads, table)


def _links(links: Sequence[LinkRow]) -> str:
    """The row of each link, in few columns."""
    heads = [
        "robot",
        "link",
        "source",
        "cm^3",
        "kg",
        "nodes",
        "s",
        "f1, f2, f3 Hz",
        "by sections Hz",
        "estimate %",
        "what to know",
    ]
    table = []
    for row in links:
        frequencies = ", ".join(_cell(f) for f in (row.f1, row.f2, row.f3)) if row.flexible else "-"
        table.append(
            [
                row.robot, row.link, row.source, _cell(row.volume), _cell(row.mass), _cell(row.nodes),
                _cell(row.seconds), frequencies, _cell(row.by_sections), _cell(row.estimate), _cell(_told(row)),
            ]
        )  # fmt: skip
    return markdown(heads, table)


def _told(row: LinkRow) -> str:
    coarse = f"coarse: {row.estimate:.2g}%" if row.estimate > _HONEST else ""
    return "; ".join(filter(None, (coarse, row.note)))
