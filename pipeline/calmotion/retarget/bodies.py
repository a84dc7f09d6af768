"""From a character and its finite-element meshes to reduced bodies, skins and frequencies."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..dynamics.model import body_anchors, rigid_body
from ..dynamics.topology import Tree
from ..errors import ShotError
from ..fem.excitation_data import Excitation
from ..fem.reduced_body import ReducedBody
from ..shot import Character, FEMeshes, ModeTable, Skin
from ..shot.character import DEFAULT_TOLERANCE


def reduce_bodies(
    character: Character,
    tree: Tree,
    meshes: FEMeshes | None,
    progress: Callable[[float, str], None] | None = None,
    excitations: Sequence[Excitation | None] | None = None,
    tolerance: float | None = None,
) -> list[ReducedBody]:
    """Every body of a character as the dynamics needs it; finite elements are loaded only for flexible ones.

    Args:
        character, tree, meshes: What to reduce.
        progress: Called with a fraction and the body at hand.
        excitations: Loads on each body in the shot, for what is chosen automatically.
        tolerance: Error that does not matter [m]; None: the shot's own, or 1 mm.

    Raises:
        ShotError: A flexible body without a mesh, or one that cannot be reduced.
    """
    mesh_of = {} if meshes is None else {mesh.body: mesh for mesh in meshes.meshes}
    allowed = tolerance or character.retarget.tolerance or DEFAULT_TOLERANCE
    # what bodies along a chain leave out adds up
    flexible = sum(body.flexible is not None for body in character.bodies)
    result = []
    for index, (body, anchors) in enumerate(zip(character.bodies, body_anchors(character, tree), strict=True)):
        if progress is not None:
            progress(index / len(character.bodies), body.path)
        if body.flexible is None:
            result.append(rigid_body(body, anchors))
            continue
        if index not in mesh_of:
            raise ShotError(
                "this flexible body has no finite-element mesh",
                path=body.path,
                remedy="Enable the plugin that provides meshes, or remove CalmFlexibleBodyAPI.",
            )
        from ..fem.reduce import Anchor, reduce_body

        paths = [character.joints[k].path for k in anchors.joints] + [
            character.targets[k].path for k in anchors.targets
        ]
        kinds = ["interface"] * len(anchors.joints) + ["point"] * len(anchors.targets)
        frames = [Anchor(*item) for item in zip(paths, anchors.frames, kinds, strict=True)]
        excitation = None if excitations is None else excitations[index]
        result.append(
            reduce_body(mesh_of[index], body, frames, body.surfaces, anchors.root, excitation, allowed / flexible)
        )
    return result


def mode_tables(bodies: Sequence[ReducedBody]) -> tuple[ModeTable, ...]:
    """Frequencies of the flexible bodies."""
    return tuple(
        ModeTable(index, body.frequencies, body.nodes, body.elements, body.invariants.mass)
        for index, body in enumerate(bodies)
        if len(body.stiffness)
    )


def skins(bodies: Sequence[ReducedBody]) -> tuple[Skin | None, ...]:
    """How the elastic coordinates move each body's surfaces."""
    return tuple(Skin(body.skin) if len(body.stiffness) else None for body in bodies)
