"""Messages about joints whose frames do not touch the surface of their flexible bodies."""

from __future__ import annotations

from collections.abc import Iterator

from calmotion.geometry.tetrahedra import boundary_triangles
from calmotion.reduction.interfaces.contact_place import contact_place
from calmotion.shot import Character, FEMeshes

_HELD = {
    "ring": "it takes hold of the nearest bore or boss around its axis",
    "flange": "it takes hold of the nearest flange around its axis",
    "face": "it takes hold of the nearest part of the surface",
}


def contact_notes(character: Character, meshes: FEMeshes) -> Iterator[str]:
    """For each joint that is off the surface of a meshed body: how far, and where it takes hold of it instead."""
    for mesh in meshes.meshes:
        body = character.bodies[mesh.body]
        named = {surface.joint for surface in body.interfaces}
        surface = boundary_triangles(mesh.tets)
        triangles = mesh.points[surface]
        for joint in character.joints:
            if joint.redundant or joint.path in named or mesh.body not in (joint.body0, joint.body1):
                continue
            frame = joint.frame0 if joint.body0 == mesh.body else joint.frame1
            place = contact_place(frame.position, frame.axis, triangles, mesh.points)
            if place is not None:
                yield (
                    f"{body.path}: the frame of {joint.path} is {1e3 * place.distance:.3g} mm off its surface; "
                    f"{_HELD[place.kind]} (a GeomSubset of family calmInterface chooses another)"
                )
