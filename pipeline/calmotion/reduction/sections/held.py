"""Which cells of a body its joints hold: those that the patches of a mesh would be made of."""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, BoolArray, Indices, box_diagonal
from calmotion.mesh.patches.automatic_patch import least_radius
from calmotion.mesh.patches.contact_place import contact_place
from calmotion.mesh.patches.interface_patches import LEAST, AttachmentFrame, Place, carries
from calmotion.mesh.patches.seats import other_cheek
from calmotion.mesh.patches.sphere_cut import just_reached
from calmotion.mesh.surfaces.distances import closest_on_triangles
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.reduction.sections.cells import Cells

_GROWTH = 1.25
_NEAR = 1.0  # of a side of a cell: distance of a cell from the surface that it is at
_ONE = 1e-3  # of the size: frames that are nearer to each other are at one place


@dataclass(frozen=True, eq=False)
class Outside:
    """The outer surface of a body: points [m], shape [n, 3], and triangles, shape [k, 3]."""

    nodes: Array
    surface: Indices


def held_cells(
    cells: Cells, outside: Outside, attachments: list[AttachmentFrame], number: int, radius: float
) -> BoolArray:
    """Which cells an attachment frame holds, at least one, shape [n].

    Args:
        radius: Given [m]; negative: measured.
    """
    attachment = attachments[number]
    frame, measured = attachment.frame, outside.nodes[outside.surface]
    side = float(cells.sides.max())
    if attachment.surface is not None:
        corners = np.asarray(attachment.surface.triangles, dtype=float).reshape(-1, 3)
        near = NearbyTriangles(corners, np.arange(len(corners)).reshape(-1, 3), side)
        found = cells.outside & np.isfinite(near.closest(cells.places)[:, 0])
        if found.any():
            return np.asarray(found)
    size = box_diagonal(measured)
    if radius >= 0.0:
        return _within(cells, frame.position, radius)
    place = contact_place(frame.position, frame.axis, measured, measured.reshape(-1, 3))
    center = frame.position if place is None else place.position
    away = [float(np.linalg.norm(a.frame.position - frame.position)) for a in attachments if a.kind == "interface"]
    room = min((distance for distance in away if distance > _ONE * size), default=np.inf)
    least = min(LEAST * size, least_radius(measured))
    radius = Place(center, frame.axis, outside, measured, room, least).end_and_radius()[1]
    gap = float(np.linalg.norm(closest_on_triangles(center, measured) - center, axis=1).min())
    radius = max(radius, 1.25 * gap)
    found = _reached(cells, outside, center, radius, frame.axis)
    while radius < size and not carries(cells.places[found], least):
        radius *= _GROWTH
        found = _reached(cells, outside, center, radius, frame.axis)
    opposite = other_cheek(outside, center, radius, frame.axis)
    return found if opposite is None else found | _reached(cells, outside, opposite, radius, frame.axis)


def _reached(cells: Cells, outside: Outside, center: Array, radius: float, axis: Array) -> BoolArray:
    """Cells within a radius, without those of places that the sphere just reaches."""
    found = _within(cells, center, radius)
    left = just_reached(outside.nodes, outside.surface, center, radius, axis)
    if not left.any():
        return found
    near = NearbyTriangles(outside.nodes, outside.surface[~left], _NEAR * float(cells.sides.max()))
    at = np.flatnonzero(found)
    found[at] = np.isfinite(near.closest(cells.places[at])[:, 0])
    return found


def _within(cells: Cells, center: Array, radius: float) -> BoolArray:
    """Cells at the surface within a radius, or the nearest ones."""
    away = np.linalg.norm(cells.places - center, axis=1)
    nearest = float(away[cells.outside].min()) + float(cells.sides.max())
    return np.asarray(cells.outside & (away <= max(radius, nearest)))
