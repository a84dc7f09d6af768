"""Short names for prim paths, for people; files keep the paths."""

from __future__ import annotations

from collections.abc import Sequence


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
