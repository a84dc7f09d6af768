"""Messages about joints that do not hold a flexible body where their frames are: off its surface, or too near to each
other for a patch each."""

from collections.abc import Iterator

import numpy as np

from calmotion.arrays import Array, box_diagonal
from calmotion.mesh.patches.contact_place import contact_place
from calmotion.mesh.patches.interface_patches import AttachmentFrame, at_one_place
from calmotion.mesh.patches.joint_places import SAME, nearest_apart
from calmotion.mesh.tetrahedra import boundary_triangles
from calmotion.model import Body, Character, FEMeshes

_HELD = {
    "ring": "it takes hold of the nearest bore or boss around its axis",
    "flange": "it takes hold of the nearest flange around its axis",
    "face": "it takes hold of the nearest part of the surface",
}


def contact_notes(character: Character, meshes: FEMeshes) -> Iterator[str]:
    """For each joint that is off the surface of a meshed body: how far, and where it takes hold of it instead; for
    joints whose frames are too near to each other for a patch each: how near, and that they hold one part of it."""
    for mesh in meshes.meshes:
        body = character.bodies[mesh.body]
        surfaces = {surface.joint: surface for surface in body.interfaces}
        triangles = mesh.points[boundary_triangles(mesh.tets)]
        joints = [joint for joint in character.joints if mesh.body in (joint.body0, joint.body1)]
        frames = [
            AttachmentFrame(
                joint.path,
                joint.frame0 if joint.body0 == mesh.body else joint.frame1,
                "interface",
                surfaces.get(joint.path),
            )
            for joint in joints
            if not joint.redundant
        ]
        for at in frames:
            if at.surface is not None:
                continue
            place = contact_place(at.frame.position, at.frame.axis, triangles, mesh.points)
            if place is not None:
                yield (
                    f"{body.path}: the frame of {at.path} is {1e3 * place.distance:.3g} mm off its surface; "
                    f"{_HELD[place.kind]} (a GeomSubset of family calmInterface chooses another)"
                )
        yield from _shared(body, frames, triangles)


def _shared(body: Body, frames: list[AttachmentFrame], triangles: Array) -> Iterator[str]:
    """Messages about joints that hold one part of the surface, though their frames have different positions."""
    assert body.flexible is not None
    same = SAME * box_diagonal(triangles)
    for group in at_one_place(frames, nearest_apart(triangles, body.flexible.interface_radius)):
        at = [frames[k].frame.position for k in group]
        far = max(float(np.linalg.norm(position - at[0])) for position in at)
        if far > same:
            yield (
                f"{body.path}: the frames of {' and '.join(frames[k].path for k in group)} are {1e3 * far:.3g} mm "
                "apart, too near for an interface patch each: they share one, and do not move against each "
                "other (a GeomSubset of family calmInterface for each separates them)"
            )
