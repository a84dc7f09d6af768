"""What becomes of every link of robots: one row each, from its geometry to its first frequencies."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from calmotion import ShotError
from calmotion.arrays import Array
from calmotion.mesh import boundary_triangles, contact_place, element_size, interface_patches, quadratic_nodes
from calmotion.model import Body, FEMesh
from calmotion.reduction import MeshController, assemble, clamped_modes, estimated_body, recomputed, root_at
from calmotion.support import Fault
from calmotion.tolerance import MeshOptions, Volume, geometry_of, mesh_of

from ..common.timing import processor_time
from ..scenes.links import Link, attachments_of, frames_of

LIMIT = 20.0  # processor time of a link that is wanted [s]
REFERENCE = (0.002, 100_000)  # wanted error of the compliances of a reference, and its nodes at most
REFERENCE_TIME = 300.0  # processor time of its mesh [s]


@dataclass(frozen=True)
class LinkRow:
    """What became of a link.

    Attributes:
        robot, link: Names.
        source: What its solid was made of; `refused`, `fault` or `none` (no geometry) where there is none.
        triangles: Of its visual surfaces.
        volume_cm3: Of its solid.
        mass_kg: That the robot states.
        joints, off: Its joints, and those whose frames do not touch its solid.
        nodes: Of the ten-node tetrahedra.
        volume_error_percent: Of the tetrahedra against the solid.
        processor_s: Time of solid, mesh, refinement and estimated error.
        f1_hz, f2_hz, f3_hz: First frequencies, held by the joint towards the world, in polyamide.
        by_sections_hz: First frequency by beams and sections, as `calmotion inspect` tells it.
        estimate_percent: Error of the frequencies that is estimated.
        difference_percent: Largest difference of the three frequencies to those of the reference, a finer mesh.
        note: Why it was refused, or why another source than the visual surface was taken.
    """

    robot: str
    link: str
    source: str = "refused"
    triangles: int = 0
    volume_cm3: float = np.nan
    mass_kg: float = np.nan
    joints: int = 0
    off: int = 0
    nodes: int = 0
    volume_error_percent: float = np.nan
    processor_s: float = np.nan
    f1_hz: float = np.nan
    f2_hz: float = np.nan
    f3_hz: float = np.nan
    by_sections_hz: float = np.nan
    estimate_percent: float = np.nan
    difference_percent: float = np.nan
    note: str = ""

    @property
    def flexible(self) -> bool:
        """Whether it can be simulated as flexible."""
        return self.nodes > 0

    @property
    def outcome(self) -> str:
        """What became of it, in few words."""
        if self.flexible:
            told = f"{self.processor_s:.3g} s, estimate {self.estimate_percent:.2g}%"
            return f"{self.source}, {self.nodes} nodes, {told}"
        return self.source if not self.note else f"{self.source}: {self.note}"


def faulty_row(link: Link, robot: str, fault: Fault) -> LinkRow:
    """The row of a link whose process failed."""
    note = f"{fault.reason}. Give a TetMesh, or a simpler mesh file, for this link, and report the fault"
    return LinkRow(robot=robot, link=link.name, source="fault", note=note)


def survey_link(
    link: Link, robot: str, time_limit: float, geometry_only: bool = False, reference: bool = False
) -> LinkRow:
    """The row of a link, by the bundled mesher; what is wrong with the link is in its note.

    Args:
        link: From `read_links`.
        robot: Its name.
        time_limit: Processor time of its meshes [s].
        geometry_only: Whether its solid is made but not meshed.
        reference: Whether its frequencies are compared with those of a finer mesh, which may take minutes.
    """
    body = replace(link.body, mass=link.mass)
    frames = frames_of(link)
    visual = [surface for surface in body.surfaces if surface.visible and len(surface.triangles)]
    row = LinkRow(
        robot=robot,
        link=link.name,
        triangles=sum(len(surface.triangles) for surface in visual),
        joints=len(frames),
        mass_kg=np.nan if link.mass is None else link.mass.mass,
    )
    if not body.surfaces and body.tets is None and not frames:
        return replace(row, source="none", note="no geometry and no joints")
    begin = processor_time()
    try:
        options = MeshOptions(time_limit=time_limit, cache=False)
        geometry = geometry_of(0, body, options, frames)
        row = _with_solid(row, geometry, frames)
        if not geometry_only:
            with recomputed():
                mesh = mesh_of(0, body, geometry, options, frames, attachments_of(link))
            row = replace(row, processor_s=processor_time() - begin)
            row = _with_sections(_with_mesh(row, mesh, link), body, link)
            if reference and isinstance(geometry, Volume):
                row = _with_reference(row, geometry, body, link)
    except ShotError as problem:
        row = replace(row, note=str(problem), nodes=0)
    return row if row.nodes else replace(row, processor_s=processor_time() - begin)


def _with_solid(row: LinkRow, geometry: Any, frames: Sequence[Any]) -> LinkRow:
    solid = getattr(geometry, "solid", None)
    points = geometry.points if solid is None else solid.points
    triangles = boundary_triangles(geometry.tets) if solid is None else solid.triangles
    volume = geometry.quality.volume if solid is None else solid.volume
    places = [contact_place(frame.position, frame.axis, points[triangles], points) for frame in frames]
    return replace(
        row,
        source="tetrahedra" if solid is None else solid.source,
        volume_cm3=1e6 * volume,
        off=sum(place is not None for place in places),
        note="" if solid is None or solid.source == "visual surface" else solid.repairs[0],
    )


def _with_mesh(row: LinkRow, mesh: FEMesh, link: Link) -> LinkRow:
    f1, f2, f3 = _frequencies(mesh, link)
    error = mesh.quality.frequency_error
    late = [
        note for note in mesh.quality.repairs if "too long" in note or "would exceed" in note or "on a grid" in note
    ]
    return replace(
        row,
        source=mesh.quality.source,
        nodes=quadratic_nodes(mesh.points, mesh.tets),
        volume_error_percent=100.0 * mesh.quality.volume_error,
        f1_hz=float(f1),
        f2_hz=float(f2),
        f3_hz=float(f3),
        estimate_percent=np.nan if error is None else 100.0 * error,
        note="; ".join(filter(None, (row.note, *late))),
    )


def _frequencies(mesh: FEMesh, link: Link) -> Array:
    """The first three frequencies [Hz], held by the joint towards the world."""
    settings = link.body.flexible
    assert settings is not None
    model = assemble(mesh.points, mesh.tets, settings.material)
    held = interface_patches(model.mesh, attachments_of(link), settings.interface_radius, link.body.path, mesh.patches)
    clamped = held[0].nodes if link.carrier is not None else None
    return np.asarray(np.sqrt(mesh.quality.factor) * clamped_modes(model, 3, clamped)[0])


def _with_reference(row: LinkRow, volume: Volume, body: Body, link: Link) -> LinkRow:
    """The row with the difference to a mesh of half the element size, bisected where its error arises."""
    held = attachments_of(link)
    finer = replace(volume, size=0.5 * element_size(volume.shape))
    options = MeshOptions(time_limit=REFERENCE_TIME, cache=False)
    mesh = mesh_of(0, body, finer, options, frames_of(link), held)
    if mesh.quality.source != row.source:  # a beam or a collision surface in its place is no reference
        return row
    mesh = MeshController(*REFERENCE, "finer").refined(mesh, body, held, root_at(held, link.carrier))
    ratios = np.array([row.f1_hz, row.f2_hz, row.f3_hz]) / _frequencies(mesh, link)
    return replace(row, difference_percent=100.0 * float(np.abs(ratios - 1.0).max()))


def _with_sections(row: LinkRow, body: Body, link: Link) -> LinkRow:
    """The row with the frequency that takes no mesh; a link that no joint holds has none."""
    if link.carrier is None:
        return row
    frequencies = estimated_body(body, attachments_of(link), 0)[0].frequencies
    return replace(row, by_sections_hz=float(frequencies[0]) if len(frequencies) else np.nan)
