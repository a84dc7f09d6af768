"""Hollow parts that a shot models by their outer surfaces: the solid without a cavity at the depth of the wall."""

from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.mesh.grids import grid_about, wound, zero_surface
from calmotion.mesh.repair.closed_solid import Solid
from calmotion.mesh.repair.closing import Part, connected_pieces
from calmotion.mesh.repair.uniting import NotManifold, manifold_of, part_of, without_detail
from calmotion.mesh.sources.sampling import sampled
from calmotion.mesh.surfaces.closed_surfaces import winding_numbers
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles

_EDGE = 0.03  # of the largest eigenvalue of the normals around a corner, from which they differ
_LONGEST = 3.0  # way of a corner, of the thickness
_END = 0.9  # least cosine between the normal of an end face and the axis of a tube
_NEAR, _PLACES = (
    0.97,
    2_000,
)  # least distance of a cavity from the surface, of the thickness; places where it is checked
_CELL, _CELLS = 0.5, 400_000  # grid of a cavity: its cells of the thickness, and their largest number
_DETAIL = 0.05  # of the thickness, that is removed from a cavity


def hollowed(solid: Solid, thickness: float, section: str, path: str) -> Solid:
    """A solid with a wall of even thickness.

    Args:
        solid: Bounded by the outer surface.
        thickness: Of the wall [m].
        section: `closed`: the wall is all around; `tube`: both ends along its longest side are open.
        path: Prim path of the body, for errors.

    Raises:
        ShotError: It is nowhere thicker than two walls.
    """
    low, high = solid.points.min(axis=0), solid.points.max(axis=0)
    center, scale = 0.5 * (low + high), float(np.linalg.norm(high - low))
    outer, wall = Part((solid.points - center) / scale, solid.triangles), thickness / scale
    end = np.eye(3)[int(np.argmax(high - low))] if section == "tube" else None
    try:
        cavity = _offset(outer, wall, end)
        if cavity is None and end is None:
            cavity = _cavity_on_grid(outer, wall)
    except NotManifold:
        cavity = None
    if cavity is None:
        raise ShotError(
            "this body is nowhere thick enough for a cavity inside its wall",
            path=path,
            attribute="calm:flexible:wallThickness",
            found=f"{thickness:.3g} m",
            remedy="Author a smaller wallThickness, or remove it so that the body is solid",
        )
    made = part_of(manifold_of(outer) - manifold_of(cavity))
    largest = max(connected_pieces(made.points, made.triangles), key=lambda piece: abs(piece.volume))
    whole = made if largest.volume > 0.0 else largest
    volume = made.volume * scale**3
    note = (
        f"hollow with a wall of {1e3 * thickness:.3g} mm{', open at both ends' if end is not None else ''}: "
        f"{100.0 * volume / solid.volume:.3g}% of the volume that its surface encloses"
    )
    return replace(
        solid,
        points=whole.points * scale + center,
        triangles=whole.triangles.astype(np.int32),
        volume=volume,
        repairs=(*solid.repairs, note),
    )


def _offset(outer: Part, wall: float, end: Array | None) -> Part | None:
    """The surface moved inward: each corner to where the planes around it meet then; None where that folds it over."""
    x = outer.points[outer.triangles]
    area = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    normal = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), np.finfo(float).tiny)
    way = np.full(len(normal), wall)
    if end is not None:  # the cavity leaves the body at its ends
        way[np.abs(normal @ end) > _END] = -wall
    sides = np.roll(x, -1, axis=1) - x
    sides /= np.maximum(np.linalg.norm(sides, axis=2, keepdims=True), np.finfo(float).tiny)
    angles = np.arccos(np.clip(-np.einsum("ijk,ijk->ij", sides, np.roll(sides, 1, axis=1)), -1.0, 1.0)).ravel()
    corners, normals, ways = outer.triangles.ravel(), np.repeat(normal, 3, axis=0), np.repeat(way, 3)
    planes = np.zeros((len(outer.points), 3, 3))
    np.add.at(planes, corners, angles[:, None, None] * normals[:, :, None] * normals[:, None, :])
    sums = np.zeros((len(outer.points), 3))
    np.add.at(sums, corners, (angles * ways)[:, None] * normals)
    values, vectors = np.linalg.eigh(planes)
    used = values > _EDGE * values[:, -1:]
    along = np.einsum("nij,ni->nj", vectors, sums) * used / np.where(used, values, 1.0)
    move = -np.einsum("nij,nj->ni", vectors, along)
    if (np.linalg.norm(move, axis=1) > _LONGEST * wall).any():
        return None
    moved = Part(outer.points + move, outer.triangles)
    places = np.vstack([sampled(moved, _PLACES)[0], moved.points])
    if end is not None:  # beyond the ends it is outside
        height, ends = places @ end, outer.points @ end
        places = places[(height > ends.min() + wall) & (height < ends.max() - wall)]
    inside = winding_numbers(places, outer.points, outer.triangles) > 0.5
    if not len(places) or not inside.all() or _distances(outer, places, wall).min() < _NEAR * wall:
        return None
    return moved if moved.volume > 0.0 else None


def _cavity_on_grid(outer: Part, wall: float) -> Part | None:
    """All that is deeper than the wall, as a level set of the distance to the surface; None where nothing is."""
    low, high = outer.points.min(axis=0), outer.points.max(axis=0)
    cell = max(_CELL * wall, float(np.prod(high - low) / _CELLS) ** (1.0 / 3.0))
    counts = np.ceil((high - low) / cell).astype(int) + 3
    low = low - cell
    grid = low + cell * np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1)
    within = wound(outer.points, outer.triangles, low, counts, cell) > 0
    depth = np.full(tuple(counts), -wall)
    depth[within] = _distances(outer, grid[within], wall + 2.0 * cell) - wall
    if not (depth > 0.0).any():
        return None
    used, at, tets = grid_about(depth > 0.0, low, cell)
    return without_detail(Part(*zero_surface(at, depth.ravel()[used], tets)), _DETAIL * wall)


def _distances(outer: Part, places: Array, reach: float) -> Array:
    """Distances from places to a surface, at most the reach."""
    closest = NearbyTriangles(outer.points, outer.triangles, reach).closest(places)
    return np.asarray(np.nan_to_num(np.linalg.norm(places - closest, axis=1), nan=reach))
