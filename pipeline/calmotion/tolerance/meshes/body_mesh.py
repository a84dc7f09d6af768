"""Tetrahedra of a flexible body."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from calmotion.arrays import box_diagonal
from calmotion.errors import ShotError
from calmotion.mesh.element_sizes import MAX_NODES, element_size, shape_of
from calmotion.mesh.mass import mass_of_solid
from calmotion.mesh.mesh_file import read_mesh_file
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.repair.closed_solid import Solid
from calmotion.mesh.sources.beam import equivalent_beam
from calmotion.mesh.sources.choice import solid_of
from calmotion.mesh.sources.hollow import hollowed
from calmotion.mesh.sources.twins import moved
from calmotion.mesh.surfaces.congruence import Isometry
from calmotion.mesh.tetrahedra import (
    connected_parts,
    measure_quality,
    oriented_tets,
    refuse_bad_neighbours,
    welded_tets,
    without_contacts,
    without_unused_points,
)
from calmotion.mesh.tetrahedralize.filling import filled, refuse_loose_parts, refuse_too_many
from calmotion.mesh.tetrahedralize.tetwild import DENSE, OutOfTime, ProcessorTime
from calmotion.model import Body, Character, FEMesh, Frame, SurfaceMesh, TetGeometry
from calmotion.tolerance.meshes.accurate_mesh import (
    accurate,
    judged,
    makeup_note,
    mass_note,
    shaped_to,
    spread_note,
    volume_note,
)
from calmotion.tolerance.meshes.options import MeshOptions, Volume

SECTIONS = 1.0  # of a first frequency: what is not known of it by beams and sections, for nine of ten links
FAR = 5.0  # distance of a mesh from all joints of its body, over its size, that nobody means
_SIMPLE = ("collision surface", "wrapped collision surface", "equivalent beam")
_WELD = 1e-6  # distance of coincident points, of the diagonal


def mesh_of(
    index: int, body: Body, geometry: FEMesh | Volume, options: MeshOptions, frames: Sequence[Frame] = (),
    attachments: Sequence[AttachmentFrame] = (),
) -> FEMesh:  # fmt: skip
    """The tetrahedra of a geometry.

    Args:
        index: Of the body in its character.
        body: With `flexible` settings.
        geometry: See `geometry_of`.
        options: Settings of the user.
        frames: Of its joints, body frame, that of the joint to its parent first.
        attachments: Frames of its joints and targets, along whose patches a solid is cut.

    Raises:
        ShotError: It cannot be meshed.
    """
    try:
        mesh = _meshed(index, body, geometry, options, frames, attachments)
    except OutOfTime as reason:
        mesh = _simplest_in_time(index, body, geometry, options, frames, attachments, reason)
    _refuse_far(mesh, body, frames)
    return mesh


def _simplest_in_time(
    index: int, body: Body, geometry: FEMesh | Volume, options: MeshOptions, frames: Sequence[Frame],
    attachments: Sequence[AttachmentFrame], reason: OutOfTime,
) -> FEMesh:  # fmt: skip
    """The first simpler geometry that is meshed in time.

    Raises:
        OutOfTime: None is.
        ShotError: It cannot be meshed.
    """
    for simpler in _simpler(index, body, geometry, options, frames, reason):
        with suppress(OutOfTime):
            mesh = _meshed(index, body, simpler, options, frames, attachments)
            assert isinstance(geometry, Volume)
            return _in_its_place(mesh, body, geometry.solid, simpler.solid, attachments, frames[0] if frames else None)
    raise reason


def _in_its_place(
    mesh: FEMesh, body: Body, wanted: Solid, given: Solid, attachments: Sequence[AttachmentFrame], carrier: Frame | None
) -> FEMesh:
    """The mesh of a given solid in place of the wanted one, with the error of its stiffness that this is."""
    from calmotion.reduction.mesh_refinement import root_at

    root = root_at(attachments, carrier)
    if root is None or mesh.quality.frequency_error is None:  # nothing holds it, or the reduction refuses it
        return mesh
    stiffer = _first_frequency(body, given, attachments, root) / _first_frequency(body, wanted, attachments, root)
    quality, factor = mesh.quality, stiffer**-2.0
    off = min(2.0 * abs(stiffer - 1.0), SECTIONS)  # a factor close to 1 may be off by as much
    told = (
        f"its modulus is {factor:.2g} of that of its material, with which its first frequency is that of the visual "
        "surface by beams and sections"
    )
    quality = replace(
        quality,
        error_of_source=2.0 * off,
        factor_of_source=factor,
        frequency_error=mesh.quality.frequency_error + off,
        deflection_error=(quality.deflection_error or 0.0) + 2.0 * off,
        repairs=(*quality.repairs, told),
    )
    return replace(mesh, quality=quality)


def _first_frequency(body: Body, solid: Solid, attachments: Sequence[AttachmentFrame], root: int) -> float:
    """Of a solid by beams and sections [Hz]; arguments as of `estimated_body`."""
    from calmotion.reduction.sections.estimate import estimated_body

    assert body.flexible is not None
    settings = replace(body.flexible, geometry="auto", mesh_file="", wall_thickness=-1.0)
    surface = SurfaceMesh(body.path, solid.points, solid.triangles)
    body = replace(body, tets=None, surfaces=(surface,), flexible=settings)
    return float(estimated_body(body, attachments, root)[0].frequencies[0])


def _refuse_far(mesh: FEMesh, body: Body, frames: Sequence[Frame]) -> None:
    """Refuse a mesh that lies far from all joints of its body.

    Raises:
        ShotError: It does.
    """
    size = box_diagonal(mesh.points)
    away = min((float(np.linalg.norm(mesh.points - f.position, axis=1).min()) for f in frames), default=0.0)
    if away > FAR * size:
        raise ShotError(
            "the mesh of this body lies far from all of its joints", path=body.path,
            found=f"{away:.3g} m from the nearest one, {away / size:.3g} times its size",
            remedy="Correct the transform, the unit or the points of the mesh, or the positions of the joints.",
        )  # fmt: skip


def _simpler(
    index: int, body: Body, geometry: FEMesh | Volume, options: MeshOptions, frames: Sequence[Frame], reason: ShotError
) -> Iterator[Volume]:  # fmt: skip
    """The collision surface of a body, and a beam, in place of a visual surface that takes too long.

    A body without a stated mass has that of its solid.
    """
    if body.flexible is None or body.flexible.geometry != "auto" or not isinstance(geometry, Volume):
        return
    if geometry.solid.source in _SIMPLE:
        return
    hidden = any(not surface.visible and len(surface.triangles) for surface in body.surfaces)
    solid = geometry.solid
    mass = body.mass or mass_of_solid(solid.points, solid.triangles, body.flexible.material.density)
    for source in ("collision", "beam") if hidden else ("beam",):
        settings = replace(body.flexible, geometry=source, mesh_file="", wall_thickness=-1.0)
        try:
            found = geometry_of(index, replace(body, flexible=settings, tets=None, mass=mass), options, frames)
        except ShotError:
            continue
        if isinstance(found, Volume) and found.solid.source in _SIMPLE:
            if len(found.solid.triangles) >= max(len(solid.triangles), DENSE):
                continue  # a copy of the visual surface takes as long
            ratio = found.solid.volume / solid.volume
            note = (
                f"meshed the {found.solid.source}, with {ratio:.2g} of the volume of the visual surface, which takes "
                f"too long ({reason.found}): its stiffness differs; give a TetMesh or a simpler mesh file"
            )
            own = () if source == "beam" else found.solid.repairs  # how exact a beam is that nothing is known beside
            yield replace(found, solid=replace(found.solid, repairs=(note, *own)))


def _meshed(
    index: int, body: Body, geometry: FEMesh | Volume, options: MeshOptions, frames: Sequence[Frame],
    attachments: Sequence[AttachmentFrame],
) -> FEMesh:  # fmt: skip
    """`mesh_of` a geometry, without another one in its place."""
    carrier = frames[0] if frames else None
    if isinstance(geometry, FEMesh):
        mesh = _judged(geometry, body, carrier, attachments)
    elif geometry.size > 0.0:
        time = ProcessorTime(options.time_limit)
        mesh = filled(index, body, geometry.solid, geometry.shape, geometry.size, time, options.cache)
        mesh = _judged(shaped_to(geometry, geometry.size, mesh, body, attachments), body, carrier, attachments)
    else:
        assert body.flexible is not None
        size = element_size(geometry.shape, core=body.flexible.material.core)
        mesh = accurate(index, body, geometry, size, options, carrier, attachments)
    quality = mesh.quality
    source = geometry.solid.source if isinstance(geometry, Volume) else quality.source
    notes = (*volume_note(quality), *mass_note(body, mesh), *spread_note(body, mesh), *makeup_note(body, mesh))
    return replace(mesh, quality=replace(quality, repairs=(*quality.repairs, *notes), source=source))


def twin_mesh(mesh: FEMesh, isometry: Isometry, index: int, character: Character, geometry: FEMesh | Volume) -> FEMesh:
    """The mesh of a body that has the shape of another one, from the mesh of that.

    Args:
        mesh: Of the other body.
        isometry: From the other body to this one.
        index: Of this body in its character.
        character: Of both.
        geometry: Of this body, see `geometry_of`.
    """
    body = character.bodies[index]
    made = moved(mesh, isometry, index, character.bodies[mesh.body].path)
    own = geometry.solid.repairs if isinstance(geometry, Volume) else ()
    repairs = (*made.quality.repairs, *own, *mass_note(body, made), *spread_note(body, made), *makeup_note(body, made))
    return replace(made, quality=replace(made.quality, repairs=repairs))


def geometry_of(index: int, body: Body, options: MeshOptions, frames: Sequence[Frame] = ()) -> FEMesh | Volume:
    """The geometry of a flexible body: authored tetrahedra, else that of its mesh file, of its surfaces, or a beam.

    It is read and closed in seconds, while meshes take minutes: what is wrong with it is known before any mesh is made.

    Raises:
        ShotError: There is no geometry, it encloses no volume, or the requested elements are too small.
    """
    settings = body.flexible
    assert settings is not None
    if body.tets is not None and settings.geometry != "beam":
        return _authored(index, body.tets, ())
    surfaces = body.surfaces
    repairs: tuple[str, ...] = ()
    if settings.mesh_file:
        geometry, repairs = read_mesh_file(settings.mesh_file, settings.mesh_scale, body.path)
        if isinstance(geometry, TetGeometry):
            return _authored(index, geometry, repairs)
        surfaces = geometry
    if settings.geometry == "beam" or not any(len(surface.triangles) for surface in surfaces):
        solid = equivalent_beam(body, frames)
    else:
        solid = solid_of(body, surfaces)
    if settings.wall_thickness > 0.0:
        solid = hollowed(solid, settings.wall_thickness, settings.section, body.path)
    solid = replace(solid, repairs=(*repairs, *solid.repairs))
    size = options.element_size if options.element_size > 0.0 else settings.element_size
    shape = shape_of(solid.points, solid.triangles)
    if size > 0.0:
        refuse_too_many(shape, size, ProcessorTime(options.time_limit), body.path)
    return Volume(solid, shape, size)


def _authored(index: int, geometry: TetGeometry, repairs: tuple[str, ...]) -> FEMesh:
    tets, inverted = oriented_tets(geometry.points, geometry.tets, geometry.path)
    points, tets = without_unused_points(np.asarray(geometry.points, dtype=float), tets)
    if inverted:
        repairs += (f"reoriented {inverted} inverted tetrahedra",)
    if len(points) < len(geometry.points):
        repairs += (f"removed {len(geometry.points) - len(points)} points that no tetrahedron uses",)
    if connected_parts(tets) > 1:
        points, tets, merged = welded_tets(points, tets, _WELD)
        if merged:
            repairs += (f"merged {merged} coincident points of separate parts",)
    refuse_loose_parts(tets, geometry.path)
    refuse_bad_neighbours(tets, geometry.path)
    touching = len(without_contacts(points, tets)[0]) - len(points)
    if touching:
        repairs += (
            f"at {touching} points tetrahedra share a corner or an edge, but no face. Such a connection is the softer, "
            "the finer the elements are: let them share faces, or separate their points",
        )
    quality = replace(measure_quality(points, tets, repairs=repairs), source="tetrahedra")
    return FEMesh(index, points, tets, quality)


def _judged(mesh: FEMesh, body: Body, carrier: Frame | None, attachments: Sequence[AttachmentFrame]) -> FEMesh:
    """A mesh whose elements are given, with its estimated error; a mesh that is too large for the estimate without."""
    if len(mesh.points) > MAX_NODES:
        return replace(mesh, given=True)
    return replace(judged(mesh, body, carrier, attachments, "given"), given=True)
