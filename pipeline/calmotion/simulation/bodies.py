"""From a character and its finite-element meshes to reduced bodies, skins and frequencies."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import TypeVar

from calmotion.errors import ShotError
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.model import Body, Character, FEMeshes, ModeTable, Skin
from calmotion.model.character import ElasticMaterial, with_ideal_motors, with_settings
from calmotion.model.meshes import FEMesh
from calmotion.model.result import EARLIER_MESH, SECTIONS
from calmotion.model.tolerance import tolerance_of
from calmotion.multibody.model.joint_arrays import BodyAnchors
from calmotion.multibody.model.model import body_anchors, compile_model, rigid_body
from calmotion.multibody.model.topology import Tree, span_tree
from calmotion.reduction.full_models import FullModels, Member
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.reduce import LinearModes
from calmotion.reduction.reduced_body import ReducedBody

Found = TypeVar("Found")


def reduce_bodies(
    character: Character,
    tree: Tree,
    meshes: FEMeshes | None,
    progress: Callable[[float, str], None] | None = None,
    load_envelopes: Sequence[LoadEnvelope | None] | None = None,
    tolerance: float | None = None,
    full: FullModels | None = None,
) -> list[ReducedBody]:
    """Every body of a character as the dynamics needs it; finite elements are loaded only for flexible ones.

    Args:
        character, tree, meshes: What to reduce.
        progress: Called with a fraction and the body at hand.
        load_envelopes: Loads on each body in the shot, for what is chosen automatically.
        tolerance: Error that does not matter [m]; None: the shot's own, or 1 mm.
        full: Full models, for who reduces the same bodies again; what is made is added.

    Raises:
        ShotError: A flexible body without a mesh, or one that cannot be reduced.
    """
    mesh_of = {} if meshes is None else {mesh.body: mesh for mesh in meshes.meshes}
    allowed = tolerance_of(character, tolerance)
    anchors = body_anchors(character, tree)
    flexible = [index for index, body in enumerate(character.bodies) if body.simulated_flexible]
    for index in flexible:
        if index not in mesh_of:
            raise ShotError(
                "this flexible body has no finite-element mesh",
                path=character.bodies[index].path,
                remedy="Enable the plugin that provides meshes, or remove CalmFlexibleBodyAPI.",
            )

    members = {index: full_model_of(character, mesh_of[index], anchors[index]) for index in flexible}
    models = full
    if flexible:
        from calmotion.reduction.full_models import FullModels, handed_on

        models = models or FullModels(keeps=False)
        models.expect(members.values())

    def reduced(index: int) -> ReducedBody:
        from calmotion.reduction.cache import cached_reduction, store_reduction

        own = members[index]
        load_envelope = None if load_envelopes is None else load_envelopes[index]
        # what has no bearing on the reduction does not make it another one
        body = replace(own.body, non_rotating=False)
        # what bodies along a chain leave out adds up
        parts = (own.mesh, body, own.attachments, body.surfaces, own.root, load_envelope, allowed / len(flexible))

        def reduce() -> ReducedBody:
            from calmotion.mesh.quadratic import quadratic_nodes
            from calmotion.reduction.full_models import room
            from calmotion.reduction.reduce import reduce_body

            assert models is not None
            with room.of(quadratic_nodes(own.mesh.points, own.mesh.tets)):
                made = reduce_body(*parts, full=models.of(own))
            # of finer and finer meshes the last one stays
            store_reduction(_meshed_before(own.body, own.attachments, own.root), replace(made, skin=()))
            return made

        return cached_reduction(parts, reduce)

    result = dict(zip(flexible, bodies_in_parallel(reduced, flexible, character, progress), strict=True))
    if flexible:
        handed_on.clear()
    rigid = (
        rigid_body(body, own) if index not in result else result[index]
        for index, (body, own) in enumerate(zip(character.bodies, anchors, strict=True))
    )
    return _damped(character, tree, list(rigid))


def estimated_bodies(
    character: Character, progress: Callable[[float, str], None] | None = None
) -> tuple[list[ReducedBody], tuple[ModeTable, ...]]:
    """Every body of a character without meshes: the flexible ones as beams by their sections.

    A body that an earlier run has meshed is as it was then.

    Args:
        progress: Called with a fraction and the body at hand.

    Returns:
        The bodies, and the frequencies of the flexible ones.

    Raises:
        ShotError: A flexible body without geometry.
    """
    from calmotion.reduction.cache import known_reduction
    from calmotion.reduction.sections.estimate import estimated_body

    tree = span_tree(character)
    anchors = body_anchors(character, tree)
    flexible = [index for index, body in enumerate(character.bodies) if body.simulated_flexible]

    def estimated(index: int) -> tuple[ReducedBody, float | None]:
        body, own = character.bodies[index], anchors[index]
        attachments = fem_anchors(character, body, own)
        known: ReducedBody | None = known_reduction(_meshed_before(body, attachments, own.root))
        return estimated_body(body, attachments, own.root) if known is None else (known, None)

    found = dict(zip(flexible, bodies_in_parallel(estimated, flexible, character, progress), strict=True))
    bodies = [
        found[index][0] if index in found else rigid_body(body, own)
        for index, (body, own) in enumerate(zip(character.bodies, anchors, strict=True))
    ]
    volumes = {index: volume for index, (_, volume) in found.items()}
    tables = tuple(
        replace(table, source=EARLIER_MESH if volumes[table.body] is None else SECTIONS, volume=volumes[table.body])
        for table in mode_tables(bodies)
    )
    return _damped(character, tree, bodies), tables


def _meshed_before(body: Body, attachments: Sequence[AttachmentFrame], root: int) -> object:
    """The key of a body that was meshed, whatever its loads and its mesh were."""
    assert body.flexible is not None
    settings = replace(body.flexible, modes_share=1.0, pairs_share=1.0)
    return "meshed before", replace(body, flexible=settings, non_rotating=False), list(attachments), root


def bodies_in_parallel(
    work: Callable[[int], Found],
    bodies: Sequence[int],
    character: Character,
    progress: Callable[[float, str], None] | None = None,
    what: str = "",
) -> list[Found]:
    """The results of dense and sparse linear algebra on several bodies, in their order; one thread of BLAS for each.

    Args:
        work: Called for each body, in any thread.
        bodies: Their indices.
        character: Whose bodies they are.
        progress: Called with a fraction and the path of a body at hand.
        what: Follows the path.
    """
    if not bodies:
        return []
    from calmotion.linear_algebra.blas_threads import one_blas_thread
    from calmotion.multibody.parallel import in_parallel

    def done(number: int) -> None:
        if progress is not None:
            at = bodies[min(number, len(bodies) - 1)]
            progress(number / len(bodies), f"{character.bodies[at].path}{what}")

    with one_blas_thread() if len(bodies) > 1 else nullcontext():
        return in_parallel(work, bodies, done)


def _damped(character: Character, tree: Tree, bodies: Sequence[ReducedBody]) -> list[ReducedBody]:
    """The bodies, damped so that the character's modes have the ratios of their materials."""
    if all(material.rayleigh is not None for material in _materials(character).values()):
        return list(bodies)  # these do not know of modes
    return with_material_damping(character, tree, bodies)


def with_material_damping(character: Character, tree: Tree, bodies: Sequence[ReducedBody]) -> list[ReducedBody]:
    """Reduced bodies with any damping, damped as the materials of a character say."""
    materials = _materials(character)
    if not materials:
        return list(bodies)
    from calmotion.multibody.analysis.modes import elastic_modes
    from calmotion.reduction.damping import damped

    # ratios are those of the structure, its motors held
    omega, shapes = elastic_modes(compile_model(with_ideal_motors(character), tree, bodies))
    result = list(bodies)
    for b, shape in zip(tree.body, shapes, strict=True):
        if b in materials:
            result[b] = damped(bodies[b], materials[b], omega, shape)
    return result


def _materials(character: Character) -> dict[int, ElasticMaterial]:
    """Of the bodies that are simulated as flexible, by their index."""
    return {
        k: b.flexible.material
        for k, b in enumerate(character.bodies)
        if b.flexible is not None and b.simulated_flexible
    }


def full_model_of(character: Character, mesh: FEMesh, anchors: BodyAnchors) -> Member:
    """What the full model of a flexible body is made of."""
    from calmotion.reduction.full_models import Member

    body = character.bodies[mesh.body]
    return Member(mesh, body, fem_anchors(character, body, anchors), anchors.root)


def fem_anchors(character: Character, body: Body, anchors: BodyAnchors) -> list[AttachmentFrame]:
    """The anchors of a flexible body as finite elements take them."""
    from calmotion.mesh.patches.interface_patches import AttachmentFrame

    joints, targets = character.joints, character.targets
    paths = [joints[k].prim_path for k in anchors.joints] + [targets[k].path for k in anchors.targets]
    kinds = ["interface"] * len(anchors.joints) + ["point"] * len(anchors.targets)
    held = {surface.joint: surface for surface in body.interfaces}
    named = [held.get(path) for path in paths]
    return [AttachmentFrame(*item) for item in zip(paths, anchors.frames, kinds, named, strict=True)]


def flexible_modes(
    character: Character,
    meshes: FEMeshes,
    load_envelopes: Sequence[LoadEnvelope | None] | None,
    tolerance: float | None,
) -> Iterator[tuple[Body, LinearModes]]:
    """Every flexible body with its linear modes on the mesh; arguments as of `reduce_bodies`."""
    from calmotion.reduction.reduce import linear_modes

    tree = span_tree(character)
    anchors = body_anchors(character, tree)
    allowed = tolerance_of(character, tolerance)
    for mesh in meshes.meshes:
        body, own = character.bodies[mesh.body], anchors[mesh.body]
        load_envelope = None if load_envelopes is None else load_envelopes[mesh.body]
        frames = fem_anchors(character, body, own)
        yield body, linear_modes(mesh, body, frames, own.root, load_envelope, allowed / len(meshes.meshes))


def weak_seat_notes(character: Character, meshes: FEMeshes, bodies: Sequence[ReducedBody]) -> Iterator[str]:
    """Messages about joints whose seats, of which the shot says nothing, decide how far a flexible body bends."""
    from calmotion.reduction.cache import cached_reduction
    from calmotion.reduction.weak_seats import weak_seat_note

    anchors = body_anchors(character, span_tree(character))
    for mesh in meshes.meshes:
        weak = bodies[mesh.body].weak_seat
        if weak is None:
            continue
        own = full_model_of(character, mesh, anchors[mesh.body])
        parts = (own.mesh, own.body, own.attachments, weak)
        note = cached_reduction(("weak seat", *parts), partial(weak_seat_note, *parts))
        if note:
            yield note


def with_elasticity(character: Character, law: str) -> Character:
    """The character with one elastic law (see `FlexibleSettings`) for all flexible bodies."""
    return with_settings(character, lambda own: replace(own, elasticity=law))


def mode_tables(bodies: Sequence[ReducedBody]) -> tuple[ModeTable, ...]:
    """Frequencies of the flexible bodies."""
    return tuple(
        ModeTable(index, body.frequencies, body.nodes, body.elements, body.invariants.mass, body.mesh_error)
        for index, body in enumerate(bodies)
        if len(body.stiffness)
    )


def skins(bodies: Sequence[ReducedBody]) -> tuple[Skin | None, ...]:
    """How the elastic coordinates move each body's surfaces."""
    return tuple(Skin(body.skin) if len(body.stiffness) else None for body in bodies)
