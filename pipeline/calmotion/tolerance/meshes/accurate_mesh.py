"""Meshes that are accurate enough for the first frequencies, and what is said about their accuracy."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calmotion.arrays import box_diagonal
from calmotion.errors import ShotError
from calmotion.mesh.element_sizes import envelope
from calmotion.mesh.mass import balance_note, density_note, mass_of_tets
from calmotion.mesh.parts import Makeup
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.tetrahedra import tet_volumes
from calmotion.mesh.tetrahedralize.filling import INTERSECTS, MAX_VOLUME_ERROR, filled
from calmotion.mesh.tetrahedralize.tetwild import SIMPLE, ProcessorTime
from calmotion.model import Body, Character, FEMesh, Frame
from calmotion.model.meshes import MeshQuality, Part
from calmotion.tolerance.meshes.options import MeshOptions, Volume

GOAL = 0.01  # error of the first frequencies: a fifth of what is known of a modulus to 10%
# Nodes of the finer mesh at most: some five seconds
MAX_NODES = 25_000
# factor of the element size where a surface has more than a few triangles: elements are bisected where it matters
_LONGER = 1.5
_FIT = 4.0  # of the distance to the surface that the mesher is allowed: how far corners are moved to fit it
_SAME_MASS = 0.05  # relative difference that is not reported


def accurate(
    index: int, body: Body, volume: Volume, size: float, options: MeshOptions, carrier: Frame | None,
    attachments: Sequence[AttachmentFrame],
) -> FEMesh:  # fmt: skip
    """Tetrahedra fine enough for the first frequencies; where the shot needs more, they are refined for its loads.

    Args:
        index, body, options, attachments: As of `mesh_of`.
        volume: To fill.
        size: Of the elements before they are refined [m].
        carrier: Frame of the joint to the parent, body frame.
    """
    time = ProcessorTime(options.time_limit)
    printed = body.flexible is not None and body.flexible.material.core is not None
    longer = _LONGER if len(volume.solid.triangles) > SIMPLE and not printed else 1.0
    mesh = filled(index, body, volume.solid, volume.shape, size, time, options.cache, longer)
    mesh = judged(shaped_to(volume, size, mesh, body, attachments), body, carrier, attachments)
    return replace(mesh, quality=replace(mesh.quality, repairs=(*mesh.quality.repairs, *remark(mesh.quality))))


def judged(
    mesh: FEMesh, body: Body, carrier: Frame | None, attachments: Sequence[AttachmentFrame], keeps: str = ""
) -> FEMesh:
    """The mesh, refined once for the first frequencies, with its estimated error; where that is not possible, as it is.

    Args:
        mesh: Of the body.
        body, carrier, attachments: As of `accurate`.
        keeps: As of `MeshController`.
    """
    from calmotion.reduction.mesh_refinement import MeshController, root_at

    try:
        root = root_at(attachments, carrier)
        return MeshController(2.0 * GOAL, MAX_NODES, keeps).refined(mesh, body, attachments, root)
    except ShotError:
        return mesh  # the reduction reports it with the joint


def shaped_to(
    volume: Volume, size: float, mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame]
) -> FEMesh:  # fmt: skip
    """The mesh of a volume with elements of a size [m], which follows its surface in the mean."""
    from calmotion.mesh.mesh_shaping import Surface, shaped

    solid, shape = volume.solid, volume.shape
    diagonal = box_diagonal(solid.points)
    limit = _FIT * envelope(size, diagonal, shape, len(solid.triangles))
    return shaped(mesh, body, Surface(solid.points, solid.triangles, solid.volume, limit), attachments)


def frames_of(character: Character, index: int) -> tuple[Frame, ...]:
    """Frames on a body of its joints, body frame, that of the joint to its parent first."""
    carrying = [joint.frame1 for joint in character.joints if joint.body1 == index]
    return (*carrying, *(joint.frame0 for joint in character.joints if joint.body0 == index))


def volume_note(quality: MeshQuality) -> tuple[str, ...]:
    """Message about a mesh whose volume, after it was fitted to its surface, is not that of the surface."""
    if quality.volume_error <= MAX_VOLUME_ERROR or INTERSECTS in quality.repairs:
        return ()
    return (f"its volume differs from that of the surface by {100.0 * quality.volume_error:.2g}%",)


def mass_note(body: Body, mesh: FEMesh) -> tuple[str, ...]:
    """Message about a stated mass that is not that of the solid and its material; the density follows the mass."""
    return density_note(body, mesh.quality.volume, _SAME_MASS)


def spread_note(body: Body, mesh: FEMesh) -> tuple[str, ...]:
    """Message about a stated centre of mass or inertia that is not that of the solid."""
    if body.mass is None or body.flexible is None:
        return ()
    from calmotion.mesh.parts import makeup_of

    makeup = makeup_of(mesh.points, mesh.tets, body.flexible.material)
    own = mass_of_tets(mesh.points, mesh.tets, body.flexible.material.density, body.mass.mass, makeup)
    return balance_note(body, own)


def makeup_note(body: Body, mesh: FEMesh) -> tuple[str, ...]:
    """Message about what a body of several materials is taken for, and about a stated mass that is not that of it."""
    from calmotion.mesh.parts import makeup_of

    makeup = None if body.flexible is None else makeup_of(mesh.points, mesh.tets, body.flexible.material)
    if body.flexible is None or makeup is None:
        return ()
    material, core = body.flexible.material, body.flexible.material.core
    mass = float(material.density * (tet_volumes(mesh.points, mesh.tets) @ makeup.density))
    note = parts_note(material.parts, mesh, makeup) if core is None else (
        f"printed: a solid skin of {1e3 * core.skin:.3g} mm around {100.0 * core.infill:.3g}% infill with "
        f"{100.0 * core.stiffness:.2g}% of the modulus (Hashin-Shtrikman); its mass is "
        f"{100.0 * mass / (material.density * mesh.quality.volume):.3g}% of that of a solid part, {mass:.3g} kg"
    )  # fmt: skip
    if body.mass is not None and abs(body.mass.mass / mass - 1.0) > _SAME_MASS:
        note += (
            f", where the shot states {body.mass.mass:.3g} kg: densities are {body.mass.mass / mass:.3g} times those"
        )
    return (note,)


def parts_note(parts: Sequence[Part], mesh: FEMesh, makeup: Makeup) -> str:
    """What of a body is of which material."""
    held = makeup.parts
    assert held is not None
    volumes = tet_volumes(mesh.points, mesh.tets) / held.shape[1]
    shares = np.bincount(held.ravel(), np.repeat(volumes, held.shape[1]), len(parts)) / mesh.quality.volume
    by_material: dict[str, float] = {}
    for part, share in zip(parts, shares, strict=True):
        by_material[part.material] = by_material.get(part.material, 0.0) + float(share)
    told = ", ".join(f"{100.0 * share:.3g}% {path}" for path, share in by_material.items())
    return f"{len(parts)} parts of {len(by_material)} materials: {told} of its volume"


def remark(quality: MeshQuality) -> tuple[str, ...]:
    """Message about a mesh that is less accurate than wanted."""
    if quality.frequency_error is None or quality.frequency_error <= GOAL:
        return ()
    return (
        f"estimated error of the first frequencies: {100.0 * quality.frequency_error:.2g}%, "
        f"more than {100.0 * GOAL:.2g}%: author a smaller calm:flexible:elementSize to reduce it",
    )
