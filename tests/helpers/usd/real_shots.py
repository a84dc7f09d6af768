"""Reads the robots and characters of a folder as commands do, and tells what became of each."""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from calmotion.errors import ShotError, each
from calmotion.host import open_host
from calmotion.model import Character
from calmotion.model.outputs import Rig
from calmotion.model.run import OutputPaths, Source
from calmotion.usd.dependencies import open_dependencies
from calmotion.usd.diagnostics import quiet
from pxr import Sdf, Tf

LOADS, RIGGED, REFUSED = "loads", "loads as a robot", "refused"


@dataclass(frozen=True)
class Tried:
    """A file, what became of it, its number of motors, and why it was refused."""

    file: str
    outcome: str
    motors: int = 0
    reason: str = ""


def shots_in(folder: Path) -> list[Path]:
    """The USD files of a folder but for those that one beside or above them opens."""
    files = sorted(path for path in folder.rglob("*") if path.suffix in (".usd", ".usda", ".usdc", ".usdz"))
    parts: set[Path] = set()
    for path in files:
        parts |= {file for file in files_named_by(path) if file.is_relative_to(path.resolve().parent)}
    return [path for path in files if path.resolve() not in parts]


def files_named_by(path: Path) -> list[Path]:
    """The files of the layers that a layer names, directly or not; none for one that cannot be opened."""
    try:
        with quiet():
            layer = Sdf.Layer.FindOrOpen(str(path))
            return [] if layer is None else [Path(named.realPath).resolve() for named in open_dependencies(layer)[1:]]
    except (Tf.ErrorException, ShotError):
        return []


def tried(folder: Path) -> Iterator[Tried]:
    """Every shot of a folder, a skinned character without physics after `calmotion rig`."""
    host = open_host([])

    def carried_out(given, wanted):
        run = host.run(given, [wanted]).finish()
        for failure in run.failures():
            raise failure.error or ShotError(failure.reason)
        return run.data[wanted]

    def read(path):
        return carried_out([Source(path=str(path), command="inspect")], Character)

    for path in shots_in(folder):
        name = path.relative_to(folder).as_posix()
        try:
            try:
                yield Tried(name, LOADS, len(read(path).motors))
            except ShotError as error:
                if "calmotion rig" not in error.remedy:
                    raise
                with tempfile.TemporaryDirectory() as made:
                    layer = Path(made) / "rig.usda"
                    carried_out([Source(path=str(path), command="rig"), OutputPaths(layer=str(layer))], Rig)
                    yield Tried(name, RIGGED, len(read(layer).motors))
        except ShotError as error:
            yield Tried(name, REFUSED, reason="; ".join(one.message() for one in each(error)))
