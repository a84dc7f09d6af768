"""What a run does to files, as Python's audit events tell it; a fault can strike at each of them.

An event has a label of what is written and how: `checkpoint: rename`, `kernels: open`. Temporary files bear the suffix
of the file that they become, which tells the outputs apart.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path

from workspace import Workspace

_CALLS = {
    "open": "open", "os.rename": "rename", "os.remove": "remove", "os.link": "link", "os.chmod": "make public",
    "tempfile.mkstemp": "make", "os.mkdir": "make folder", "os.utime": "mark", "os.rmdir": "remove folder",
    "shutil.rmtree": "remove folder",
}  # fmt: skip
_SUFFIXES = {".usda": "layer", ".csv": "table", ".rrd": "recording", ".png": "figures", ".npz": "checkpoint"}


def label(space: Workspace, event: str, arguments: tuple[object, ...]) -> str | None:
    """Label of an audit event; None for one that concerns no file of the run, or only reads."""
    if event not in _CALLS or not arguments:
        return None
    name = arguments[1] if event in ("os.rename", "os.link") else arguments[0]
    if not isinstance(name, (str, os.PathLike)):
        return None
    path = Path(os.fspath(name))
    if event == "open" and not (isinstance(arguments[2], int) and arguments[2] & (os.O_WRONLY | os.O_RDWR)):
        return None
    for folder in (space.cache, space.out, space.temporary):
        if folder in path.parents or path == folder:
            break
    else:
        return None
    if folder == space.out:
        kind = "root layer" if path.name.endswith("_root.usda") else _SUFFIXES.get(path.suffix, "outputs")
    else:
        kind = path.relative_to(folder).parts[0] if path != folder else folder.name
        kind = kind if folder == space.cache else "temporary files"
    return f"{kind}: {_CALLS[event]}"


def strike(space: Workspace, wanted: str, count: int, act: Callable[[], None]) -> Callable[[], None]:
    """A fault that acts once, just before the `count`-th event with a label."""

    def install() -> None:
        seen = [0]

        def hook(event: str, arguments: tuple[object, ...]) -> None:
            if event in _CALLS and seen[0] < count and label(space, event, arguments) == wanted:
                seen[0] += 1
                if seen[0] == count:
                    act()

        sys.addaudithook(hook)

    return install


def record(space: Workspace, file: Path) -> Callable[[], None]:
    """A fault that does no harm but writes the labels of all events, a line each."""

    def install() -> None:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

        def hook(event: str, arguments: tuple[object, ...]) -> None:
            found = label(space, event, arguments) if event in _CALLS else None
            if found is not None:
                os.write(descriptor, f"{found}\n".encode())

        sys.addaudithook(hook)

    return install
