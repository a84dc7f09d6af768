"""Links that are meshed once: the left arm of a robot is mostly its mirrored right one, and its fingers are alike."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array, Indices, box_diagonal
from calmotion.mesh.surfaces.congruence import Isometry, isometries
from calmotion.model import Body, FEMesh, FlexibleSettings, Frame
from calmotion.model.meshes import CutPatch

_SAME, _ALONG = 1e-4, 1e-4  # distance of frames, of the size; 1 - cosine of axes that are the same
_TOLD = 1e-7  # distance of surfaces that is told [m]


@dataclass(frozen=True, eq=False)
class Link:
    """What decides the mesh of a flexible body.

    Attributes:
        body: Its body.
        points: Of its solid, or of its visual surfaces where that is not made yet [m], shape [n, 3].
        triangles: Shape [m, 3].
        source: What the solid is made of.
        size: Of its elements [m]; not positive: automatic.
        carried: Whether the first frame is that of the joint to its parent.
        frames: Of its joints, body frame, that of the joint to its parent first.
    """

    body: Body
    points: Array
    triangles: Indices
    source: str
    size: float
    carried: bool
    frames: tuple[Frame, ...]


def twin_of(link: Link | None, others: Sequence[Link | None]) -> tuple[int, Isometry] | None:
    """The first of other links that has the same shape, and the isometry that takes it to the link; None without one.

    Their joints must be at the same places, their settings the same; their densities and masses may differ. Surfaces
    are the same if they are as near to each other as a mesh is to its surface. Where the tetrahedra of a link are
    given, it is None, and like no other.
    """
    for index, other in enumerate(others):
        if link is None or other is None:
            continue
        if _settings(link) != _settings(other) or len(link.frames) != len(other.frames):
            continue
        size = box_diagonal(link.points)
        for isometry in isometries(other.points, other.triangles, link.points, link.triangles):
            if _joints_match(isometry, other, link, size):
                return index, isometry
    return None


def _settings(link: Link) -> tuple[object, ...]:
    """What of the settings decides a mesh; those of named interfaces and of several materials
    are never the same."""
    settings: FlexibleSettings | None = link.body.flexible
    assert settings is not None
    material = settings.material
    named = link.body.path if link.body.interfaces or material.parts else ""
    core = None if material.core is None else (material.core.skin, material.core.infill, material.core.stiffness)
    return (
        material.poissons_ratio, core, settings.interface_radius, settings.geometry, settings.wall_thickness,
        settings.section, link.size, link.source, link.carried, named,
    )  # fmt: skip


def _joints_match(isometry: Isometry, link: Link, other: Link, size: float) -> bool:
    """Whether an isometry takes the joints of a link to those of another one: the first to the first, others in any
    order; places that are off by less than a share of the size are the same."""
    left = list(range(len(other.frames)))
    for number, frame in enumerate(link.frames):
        place, axis = isometry(frame.position), isometry.turn @ frame.axis
        for k in [0] if number == 0 and link.carried else left:
            found = other.frames[k]
            near = np.linalg.norm(found.position - place) <= _SAME * size
            if k in left and near and abs(float(found.axis @ axis)) >= 1.0 - _ALONG:
                left.remove(k)
                break
        else:
            return False
    return True


def moved(mesh: FEMesh, isometry: Isometry, index: int, path: str) -> FEMesh:
    """A mesh after an isometry, as that of another body.

    Args:
        isometry: From the twin to the body.
        index: Of the body in its character.
        path: Prim path of the twin, for the message.
    """
    tets = mesh.tets[:, [1, 0, 2, 3]] if isometry.mirrors else mesh.tets
    order = [0, 2, 1] if isometry.mirrors else [0, 1, 2]
    patches = tuple(
        CutPatch(isometry(patch.origin), np.ascontiguousarray(isometry(patch.triangles)[:, order]))
        for patch in mesh.patches
    )
    note = f"meshed as {path}, {'mirrored' if isometry.mirrors else 'which has the same shape'}"
    if isometry.distance > _TOLD:
        note += f" (within {1e3 * isometry.distance:.2g} mm)"
    quality = replace(mesh.quality, repairs=(note,))
    return FEMesh(index, isometry(mesh.points), np.ascontiguousarray(tets), quality, mesh.given, patches)
