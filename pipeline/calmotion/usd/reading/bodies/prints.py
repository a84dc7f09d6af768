"""Printed flexible bodies: their skin and their infill."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calmotion.model.materials.printed import LINE_WIDTH, PERIMETERS, Core, core_of
from calmotion.usd import schemas
from calmotion.usd.reading.context import Reading

if TYPE_CHECKING:
    from pxr import Usd

_SCHEMA, _INFILL, _PERIMETERS = "CalmFlexibleBodyAPI", "calm:flexible:infill", "calm:flexible:perimeters"


def print_of(reading: Reading, prim: Usd.Prim, wall: float, section: str) -> tuple[float, Core | None]:
    """The wall of a hollow body [m], -1 for a solid one, and the core of a printed one.

    Args:
        reading: Of the shot.
        prim: The flexible body.
        wall: `calm:flexible:wallThickness` [m]; -1: not authored. With infill it is the skin.
        section: `calm:flexible:section`.

    Raises:
        ShotError: A value is out of range, or two of them contradict each other.
    """
    infill = float(schemas.value(prim, _SCHEMA, _INFILL))
    perimeters = int(schemas.value(prim, _SCHEMA, _PERIMETERS))
    problem = "must be a number of lines of at least 1, or -1 for automatic"
    schemas.require(perimeters == -1 or perimeters >= 1, prim, _PERIMETERS, perimeters, problem)
    if infill == -1.0:
        schemas.require(
            perimeters == -1, prim, _PERIMETERS, perimeters,
            "says how thick the skin of a printed part is, but the part has no infill",
            f"Author {_INFILL} as well (1 for a part that is printed solid), or remove it",
        )  # fmt: skip
        return wall, None
    problem = "must be a share between 0 and 1, or -1 for a part without infill"
    schemas.require(0.0 <= infill <= 1.0, prim, _INFILL, infill, problem, "Author 0.2 for 20%, or remove the attribute")
    problem = "and calm:flexible:wallThickness both say how thick the skin of a printed part is"
    both = f"{perimeters} lines and {wall:.3g} m"
    schemas.require(wall <= 0.0 or perimeters == -1, prim, _PERIMETERS, both, problem, "Remove one of them")
    problem, remedy = "is that of a hollow part, but the part has infill", f"Remove it, or set {_INFILL} to 0"
    schemas.require(section != "tube" or infill <= 0.0, prim, "calm:flexible:section", section, problem, remedy)
    skin = wall if wall > 0.0 else LINE_WIDTH * (PERIMETERS if perimeters == -1 else perimeters)
    if infill == 1.0:
        return -1.0, None
    if infill == 0.0:
        return skin, None
    reading.note(f"{prim.GetPath()}: printed with a skin of {1e3 * skin:.3g} mm and {100.0 * infill:.3g}% infill")
    return -1.0, core_of(infill, skin)
