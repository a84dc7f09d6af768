"""The operator `fe.mesh`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from calmotion.errors import ShotError, raise_all
from calmotion.host import NotAsked, Operator, Property, RunContext
from calmotion.mesh import TIME_LIMIT
from calmotion.model import Character, FEMeshes, ModelChoices, Source, no_flexible_bodies

if TYPE_CHECKING:
    from calmotion.mesh import AttachmentFrame, Link
    from calmotion.model import Body, FEMesh
    from calmotion.tolerance import MeshOptions, Volume


class TetrahedralizeFlexibleBodies(Operator):
    """One tetrahedral mesh for each flexible body."""

    idname = "fe.mesh"
    label = "Tetrahedralise flexible bodies"
    requires = (Character,)
    uses = (ModelChoices, Source)
    provides = (FEMeshes,)
    properties = (
        Property(
            "element_size",
            float,
            -1.0,
            unit="m",
            minimum=1e-6,
            description="Edge length of the elements of every body; -1: that of the shot, or automatic.",
        ),
        Property(
            "time_limit",
            float,
            TIME_LIMIT,
            unit="s",
            minimum=1.0,
            description="Largest processor time for the meshes of one body; then a coarser one is made.",
        ),
        Property("cache", bool, True, description="Store meshes in the cache folder and reuse them."),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """The reason to skip it: nothing is flexible, or beams are told in place of meshes."""
        source, nothing = data.get(Source), no_flexible_bodies(data)
        if nothing is None and source is not None and source.by_sections:
            return NotAsked("no --meshes is requested")
        return nothing

    def execute(self, context: RunContext) -> Sequence[object]:
        """The meshes, in the order of the bodies."""
        # manifold3d takes half a second to load: only for flexible bodies
        from calmotion.mesh import twin_of
        from calmotion.simulation import bodies_in_parallel
        from calmotion.tolerance import MeshOptions, frames_of, mesh_of, twin_mesh

        choices = context.get(ModelChoices)
        character = context.get(Character) if choices is None else choices.character
        options = MeshOptions(
            element_size=context.properties.element_size,
            time_limit=context.properties.time_limit,
            cache=context.properties.cache,
        )
        flexible = [index for index, body in enumerate(character.bodies) if body.simulated_flexible]
        geometries = _geometries(character, flexible, options)
        attachments = _attachments(character)
        links = [_link(character, index, geometries[index]) for index in flexible]
        # a link of which another one is the copy or the mirror image is meshed once
        twins = {index: twin_of(links[k], links[:k]) for k, index in enumerate(flexible)}
        own = [index for index in flexible if twins[index] is None]

        def mesh_one(index: int) -> FEMesh:
            frames = frames_of(character, index)
            body = character.bodies[index]
            return mesh_of(index, body, geometries[index], options, frames, attachments.get(index, ()))

        made = dict(zip(own, bodies_in_parallel(mesh_one, own, character, context.progress), strict=True))
        for index in flexible:
            body, twin = character.bodies[index], twins[index]
            if twin is not None:
                made[index] = twin_mesh(made[flexible[twin[0]]], twin[1], index, character, geometries[index])
            mesh = made[index]
            quality = mesh.quality
            context.report(
                "detail",
                f"{body.path}: {quality.source}, {len(mesh.tets)} tetrahedra, {len(mesh.points)} points, "
                f"{1e6 * quality.volume:.4g} cm^3, "
                f"volume error {quality.volume_error:.2%}, smallest dihedral angle {quality.min_dihedral_deg:.1f} deg",
            )
            for repair in quality.repairs:
                context.report("info" if twin is None else "detail", f"{body.path}: {repair}")
        context.progress(1.0, "")
        return (FEMeshes(tuple(made[index] for index in flexible)),)


def _link(character: Character, index: int, geometry: FEMesh | Volume) -> Link | None:
    """What decides the mesh of a body; None where its tetrahedra are given."""
    from calmotion.mesh import Link
    from calmotion.tolerance import Volume, frames_of

    if not isinstance(geometry, Volume):
        return None
    carried = any(joint.body1 == index for joint in character.joints)
    solid = geometry.solid
    return Link(
        character.bodies[index], solid.points, solid.triangles, solid.source, geometry.size, carried,
        frames_of(character, index),
    )  # fmt: skip


def _refuse_large_elements(body: Body, given: float) -> None:
    """Refuse elements that are larger than a body: their size was mostly meant in another unit.

    Args:
        body: Flexible.
        given: Size of the elements of every body [m]; not positive: that of the shot.

    Raises:
        ShotError: They are.
    """
    assert body.flexible is not None
    size = given if given > 0.0 else body.flexible.element_size or 0.0
    parts = [surface.points for surface in body.surfaces if len(surface.points)]
    length = float(max((np.ptp(points, axis=0).max() for points in parts), default=np.inf))
    if size > length:
        raise ShotError(
            "the elements would be larger than the body",
            path=body.path,
            attribute="fe.mesh.element_size" if given > 0.0 else "calm:flexible:elementSize",
            found=f"{size:g} m, where the body is {length:.3g} m long",
            remedy="Use a smaller size, such as a third of its thickness, or leave it out.",
        )


def _attachments(character: Character) -> dict[int, Sequence[AttachmentFrame]]:
    """Frames of the joints and targets of each flexible body; none where its joints are wrong, which others report."""
    from calmotion.multibody import body_anchors, span_tree
    from calmotion.simulation import fem_anchors

    try:
        anchors = body_anchors(character, span_tree(character))
    except ShotError:
        return {}
    return {
        index: fem_anchors(character, body, anchors[index])
        for index, body in enumerate(character.bodies)
        if body.simulated_flexible
    }


def _geometries(character: Character, flexible: Sequence[int], options: MeshOptions) -> dict[int, FEMesh | Volume]:
    """The geometry of each flexible body, so that all that is wrong is known before the first mesh is made.

    Raises:
        ShotError: What is wrong with any of them.
    """
    from calmotion.tolerance import frames_of, geometry_of

    geometries: dict[int, FEMesh | Volume] = {}
    problems = []
    for index in flexible:
        try:
            _refuse_large_elements(character.bodies[index], options.element_size)
            geometries[index] = geometry_of(index, character.bodies[index], options, frames_of(character, index))
        except ShotError as problem:
            problems.append(problem)
    raise_all(problems)
    return geometries
