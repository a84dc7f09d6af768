"""Shots by the names of their files, as far as a benchmark needs them processed."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from calmotion import ShotError
from calmotion.host import open_host
from calmotion.model import ON, Animation, Character, FEMeshes, Source
from calmotion.simulation import CompiledShot

SAMPLES = tuple(f"samples/{name}/{name}.usda" for name in ("bartender", "dancer", "rapper", "drummer", "boxer"))


@dataclass(frozen=True, eq=False)
class Unreduced:
    """A shot with its meshes, to be reduced in one way and another."""

    name: str
    character: Character
    animation: Animation
    meshes: FEMeshes


def load_unreduced(path: str) -> Unreduced:
    """A shot by its file.

    Raises:
        ShotError: It cannot be read, or nothing is flexible.
    """
    # everything is kept, so that what could be left out can be compared with it
    kept: dict[str, object] = dict.fromkeys(("bodies", "turning", "loops", "motors"), ON)
    settings = {"accuracy.analyse": kept}
    character, animation, meshes = _processed(path, "simulate", (Character, Animation, FEMeshes), settings)
    if character is None or animation is None or meshes is None:
        raise ShotError("has nothing flexible to reduce", path=path)
    return Unreduced(Path(path).stem, character, animation, meshes)


def load(path: str, rigid: bool = False) -> CompiledShot:
    """A shot by its file, ready to be optimised.

    Args:
        path: Of the file.
        rigid: Whether it may be without flexible bodies.

    Raises:
        ShotError: It cannot be read, or nothing is flexible.
    """
    (compiled,) = _processed(path, "optimize", (CompiledShot,))
    if compiled is None or not (rigid or any(body.simulated_flexible for body in compiled.character.bodies)):
        raise ShotError("has nothing flexible to retarget", path=path)
    found: CompiledShot = compiled
    return found


def _processed(
    path: str, command: str, wanted: Sequence[type], settings: dict[str, dict[str, object]] | None = None
) -> list[Any]:
    """What the operators of a command make of a shot, None where they do not make it."""
    run = open_host([]).run([Source(path=path, command=command)], list(wanted), settings=settings)
    for result in run:
        if result.error is not None:
            raise result.error
    return [run.get(kind) for kind in wanted]
