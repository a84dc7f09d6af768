"""Names for people: short ones for prim paths (files keep the paths), and right ones that are like a wrong one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def distinct_names(paths: Sequence[str]) -> dict[str, str]:
    """Each path's name by as few of its last parts as tell it apart from the others."""
    parts = {path: path.strip("/").split("/") for path in sorted(set(paths))}
    names = {}
    for path, segments in parts.items():
        count = 1
        while count < len(segments) and sum(other[-count:] == segments[-count:] for other in parts.values()) > 1:
            count += 1
        names[path] = "/".join(segments[-count:])
    return names


def nearest(found: str, known: Iterable[str]) -> str:
    """A sentence with the known name that is most like one that is not known; empty where none is like it.

    Paths are compared by their last parts first, since most paths of a shot begin alike.
    """
    near = nearest_name(found, known)
    return f"Did you mean {near}? " if near else ""


def nearest_name(found: str, known: Iterable[str]) -> str:
    """The known name that is most like one that is not known; empty where none is like it."""
    names = list(known)
    return _nearest_path(found, names) if any("/" in name for name in names) else _like(found, names)


def _nearest_path(found: str, paths: Sequence[str]) -> str:
    """The path whose last part is most like that of a path; of several, the one that is most like it as a whole."""
    ends: dict[str, list[str]] = {}
    for path in paths:
        ends.setdefault(path.rsplit("/", 1)[-1], []).append(path)
    end = _like(found.rsplit("/", 1)[-1], list(ends))
    return _like(found, ends[end], 0.0) if end else ""


def _like(found: str, names: Sequence[str], least: float = 0.6) -> str:
    from difflib import get_close_matches

    by_case = {name.casefold(): name for name in reversed(names)}
    near = get_close_matches(found.casefold(), list(by_case), 1, least)
    return by_case[near[0]] if near else ""
