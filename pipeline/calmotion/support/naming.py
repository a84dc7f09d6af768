"""Names for people: short ones for prim paths (files keep the paths), and right ones that are like a wrong one."""

import posixpath
import re
from collections.abc import Iterable, Mapping, Sequence

_PRIM_PATH = re.compile(r"(?<![\w.])/[A-Za-z_][\w./:]*\w")
_ENCODED = re.compile(r"\btn__\w*")  # how converters to USD write a name that USD does not allow
_LISTED = 3  # prims that a note names
_PART = 3  # letters of a part of a name that tells which name is meant


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
    part = found.casefold()
    near = get_close_matches(part, list(by_case), 1, least)
    if not near and len(part) >= _PART:  # the beginning of a long name is not like the whole of it
        near = sorted((name for name in by_case if part in name), key=len)
    return by_case[near[0]] if near else ""


def as_written(text: str, names: Mapping[str, str]) -> str:
    """A text with encoded names of prims (`tn__leftknee_uN9E`) as the author of the file wrote them (`left-knee`).

    Args:
        text: With names of prims, alone or in paths.
        names: Encoded to written name.
    """
    return _ENCODED.sub(lambda found: names.get(found[0], found[0]), text) if names else text


def grouped_notes(notes: Iterable[str]) -> tuple[str, ...]:
    """The notes; those that differ in their prim paths alone are merged into one, which names a few prims and counts.

    A note about a prim begins with its path and a colon.
    """
    groups: dict[str, list[tuple[str, str]]] = {}
    for note in notes:
        place, colon, text = note.partition(": ")
        if not (colon and place.startswith("/")):
            place, text = "", note
        groups.setdefault(f"{bool(place)}{_PRIM_PATH.sub('/', text)}", []).append((place, text))
    return tuple(_merged(group) for group in groups.values())


def listed(paths: Sequence[str]) -> str:
    """Prim paths as a list for people: the first, the names of a few more, and how many others there are."""
    shown = paths if len(paths) <= _LISTED + 1 else paths[:_LISTED]  # one more is no shorter than its name
    others = [path.rsplit("/", 1)[-1] for path in shown[1:]]
    others += [f"{len(paths) - len(shown)} more"] if len(paths) > len(shown) else []
    return " and ".join([", ".join([paths[0], *others[:-1]]), *others[-1:]])


def _merged(group: Sequence[tuple[str, str]]) -> str:
    places = list(dict.fromkeys(place for place, _ in group))
    where = listed(places)
    paths = [_PRIM_PATH.findall(text) for _, text in group]
    common = iter(_common_path(same) for same in zip(*paths, strict=True))
    text = _PRIM_PATH.sub(lambda _: next(common), group[0][1])
    times = f" ({len(group)} times)" if len(group) > len(places) else ""
    return f"{where}: {text}{times}" if where else text + times


def _common_path(paths: Sequence[str]) -> str:
    """A path that several have in common, with dots for what differs."""
    return paths[0] if len(set(paths)) == 1 else f"{posixpath.commonpath(paths).rstrip('/')}/…"
