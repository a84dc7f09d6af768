"""TOML maps beside recordings: what they have in common, whatever they are of."""

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from calmotion.errors import ShotError
from calmotion.support import nearest, read_toml


def map_of(file: str, map_file: str, entries: Sequence[str], example: str) -> tuple[dict[str, Any] | None, str]:
    """The map of a recording and its file: the one that is named, else FILE.toml beside it; None where there is none.

    Args:
        file: The recording.
        map_file: The map, or empty.
        entries: That it may have; none: any.
        example: How it is written.

    Raises:
        ShotError: It cannot be read, or has another entry.
    """
    path = map_file or f"{os.path.splitext(file)[0]}.toml"
    if not map_file and not os.path.isfile(path):
        return None, path
    try:
        content: dict[str, Any] = read_toml(path)
    except (OSError, ValueError) as error:
        found = getattr(error, "strerror", None) or error
        raise ShotError("the map of the recording cannot be read", path=path, found=found, remedy=example) from error
    if entries:
        refuse_other_entries(content, path, "", entries)
    return content, path


def refuse_other_entries(table: Mapping[str, Any], path: str, place: str, entries: Sequence[str]) -> None:
    """Refuse a table with an entry that is none of some.

    Raises:
        ShotError: It has one.
    """
    for key in table:
        if key not in entries:
            told = f"{nearest(key, entries)}Use {', '.join(entries)}"
            raise ShotError("the map has no such entry", path=path, attribute=f"{place}{key}", remedy=told)


def prims_in(content: Mapping[str, Any], name: str, path: str, example: str) -> dict[str, str]:
    """A table of prim paths.

    Raises:
        ShotError: It is none.
    """
    table = content[name]
    if not isinstance(table, dict) or not all(isinstance(p, str) and p.startswith("/") for p in table.values()):
        raise ShotError("must be a table of prim paths", path=path, attribute=name, remedy=example)
    return table


def axes_of(text: str, path: str, of_what: str) -> list[tuple[int, float]]:
    """The axis and its sign that lie along x, y and z, from a text such as `y, -x, z`.

    Raises:
        ShotError: It does not name each axis once.
    """
    names = [name.strip().lower() for name in text.split(",")]
    plain = [name.lstrip("+-") for name in names]
    if sorted(plain) != ["x", "y", "z"]:
        raise ShotError(
            f"must name each axis of the {of_what} once",
            path=path,
            attribute="axes",
            found=text,
            remedy="Write those along x, y and z of the prim, or of the stage, such as y, -x, z",
        )
    return [("xyz".index(own), -1.0 if name.startswith("-") else 1.0) for name, own in zip(names, plain, strict=True)]


def positive(value: object, path: str, attribute: str, problem: str, remedy: str) -> float:
    """A positive number.

    Raises:
        ShotError: It is none.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value < np.inf:
        raise ShotError(problem, path=path, attribute=attribute, found=value, remedy=remedy)
    return float(value)


def noise_in(table: Mapping[str, Any], unit: float, path: str, place: str = "") -> float | None:
    """The standard deviation of a noise in SI; None where the table has none.

    Raises:
        ShotError: It is no positive number.
    """
    if table.get("noise") is None:
        return None
    problem = "must be the standard deviation of the noise, in the unit of the recording"
    remedy = "Write a positive number, or leave it out"
    return unit * positive(table["noise"], path, f"{place}noise", problem, remedy)
