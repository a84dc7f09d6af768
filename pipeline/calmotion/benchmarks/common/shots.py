"""The shots of the benchmarks: files, or synthetic characters."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calmotion.errors import ShotError
from calmotion.shot import Animation, Character, FEMeshes
from calmotion.shot.model_choice import ON
from calmotion.shot.run import RunSettings
from calmotion.simulation.body_reduction import reduced_shot
from calmotion.simulation.compiled_shot import CompiledShot

MADE = {
    "linkage": "an arm with a four-bar linkage",
    "soft-linkage": "the same with thinner links, with a shake of 0.25 m",
    "arm": "two plastic links",
}


@dataclass(frozen=True, eq=False)
class BenchShot:
    """A shot ready to be prepared."""

    name: str
    compiled: CompiledShot

    @property
    def character(self) -> Character:
        """Its character."""
        return self.compiled.character

    @property
    def animation(self) -> Animation:
        """Its animation."""
        return self.compiled.animation


@dataclass(frozen=True, eq=False)
class Unreduced:
    """A shot with its meshes, to be reduced in one way and another; `path` is that of its file.

    Attributes:
        edge: Mean edge of the elements [m].
    """

    name: str
    path: str
    character: Character
    animation: Animation
    meshes: FEMeshes
    edge: float


def load_unreduced(path: str, element_size: float | None = None) -> Unreduced:
    """A shot by its file.

    Args:
        element_size: Edge of the elements [m]; None: automatic.

    Raises:
        ShotError: It cannot be read, or nothing is flexible.
    """
    from calmotion.host import open_host
    from calmotion.shot.run import Source

    # everything is kept, so that what could be left out can be compared with it
    settings: dict[str, dict[str, object]] = {
        "accuracy.analyse": dict.fromkeys(("bodies", "turning", "loops", "motors"), ON)
    }
    if element_size is not None:
        settings["fe.mesh"] = {"element_size": element_size}
    run = open_host([]).run(
        [Source(path=path, command="simulate")], [Character, Animation, FEMeshes], settings=settings
    )
    for result in run:
        if result.error is not None:
            raise result.error
    character, animation, meshes = run.get(Character), run.get(Animation), run.get(FEMeshes)
    if character is None or animation is None or meshes is None:
        raise ShotError("has nothing flexible to reduce", path=path)
    edges = [np.linalg.norm(m.points[m.tets[:, 0]] - m.points[m.tets[:, 1]], axis=1) for m in meshes.meshes]
    return Unreduced(Path(path).stem, path, character, animation, meshes, float(np.mean(np.concatenate(edges))))


def load(name: str) -> BenchShot:
    """A shot by the name of its file, or one of `MADE`.

    Raises:
        ShotError: It cannot be read.
    """
    if name in MADE:
        character, animation, meshes = _made(name)
        return BenchShot(name, reduced_shot(character, animation, meshes, RunSettings()))
    from calmotion.host import open_host
    from calmotion.shot.run import Source

    run = open_host([]).run([Source(path=name, command="optimize")], [CompiledShot])
    for result in run:
        if result.error is not None:
            raise result.error
    compiled = run.get(CompiledShot)
    if compiled is None or not any(body.simulated_flexible for body in compiled.character.bodies):
        raise ShotError("has nothing flexible to retarget", path=name)
    return BenchShot(Path(name).stem, compiled)


def _made(name: str) -> tuple[Character, Animation, FEMeshes]:
    if name.endswith("linkage"):
        from calmotion.benchmarks.scenes.linkage_arm import SOFT, linkage_arm, performance

        character, meshes = linkage_arm(thickness=SOFT) if name.startswith("soft") else linkage_arm()
        return character, performance(), meshes
    from calmotion.benchmarks.scenes.beam_arm import beam_arm, quintic, shot_of

    character, meshes = beam_arm(2, length=0.3, thickness=0.014, payload=0.2)
    move, back = quintic(0.8, 0.4, 0.2), quintic(-1.1, 0.35, 0.9)
    return character, shot_of(lambda t: move(t) + back(t), 2.0, motors=2), meshes
