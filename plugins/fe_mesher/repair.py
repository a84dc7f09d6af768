"""From surfaces as robots have them to one closed solid: trimesh repairs, manifold3d unites."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from calmotion.errors import ShotError
from calmotion.fem.closed_surfaces import close, winding_number
from calmotion.fem.tetrahedra import surface_area, surface_volume
from calmotion.shot import SurfaceMesh

_MERGE = 1e-6  # of the diagonal: STL files repeat their corners in single precision
_CRUMB = 1e-3  # of the area: triangles that hang in the air
_HOLE, _HOLES = 5e-3, 2e-2  # of the area of a part: one hole, all of them
_LOOSE = 1e-2  # of the volume: screws that touch nothing
_REMEDY = "Close the mesh, or name a closed one in calm:flexible:meshFile, or author a TetMesh below the body"


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed surface.

    Attributes:
        points: [m], shape [n, 3], body frame.
        triangles: Shape [m, 3], outward.
        volume: [m^3].
        repairs: What was repaired, as sentences.
    """

    points: np.ndarray
    triangles: np.ndarray
    volume: float
    repairs: tuple[str, ...]


def closed_solid(surfaces: Sequence[SurfaceMesh], body: str) -> Solid:
    """One solid from the surfaces of a body: repaired, and united where there are several.

    Args:
        surfaces: Of the body, body frame.
        body: Prim path of the body.

    Raises:
        ShotError: A surface is open, or encloses no volume; the path is that of its Mesh prim.
    """
    repairs: list[str] = []
    parts: list[trimesh.Trimesh] = []
    for surface in _without_copies(surfaces, repairs):
        parts += _closed_parts(surface, repairs)
    if not parts:
        raise ShotError("its surfaces enclose no volume", path=body, found="no triangles", remedy=_REMEDY)
    united = _unite(parts, body)
    pieces = [piece for piece in united.split(only_watertight=False, repair=False) if len(piece.faces) > 3]
    outer = [piece for piece in pieces if piece.volume > 0.0]
    if len(outer) > 1:
        united = _without_loose_pieces(united, pieces, repairs, body)
    if not united.volume > 0.0:
        raise ShotError("its surfaces enclose no volume", path=body, found=f"{united.volume:.3g} m^3", remedy=_REMEDY)
    volume = surface_volume(np.asarray(united.vertices), np.asarray(united.faces))
    return Solid(np.array(united.vertices, dtype=float), np.array(united.faces, dtype=np.int32), volume, tuple(repairs))


def simplified(solid: Solid, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a solid without detail below a tolerance [m]: halves the time on dense scans and CAD."""
    import manifold3d

    surface = manifold3d.Mesh64(solid.points, solid.triangles.astype(np.uint64))
    coarse = manifold3d.Manifold(surface).simplify(tolerance)
    if coarse.is_empty():  # not a manifold to the last edge: the tetrahedraliser copes with it as it is
        return solid.points, solid.triangles
    mesh = coarse.to_mesh64()
    return np.array(mesh.vert_properties, dtype=float)[:, :3], np.array(mesh.tri_verts, dtype=np.int32)


def _without_copies(surfaces: Sequence[SurfaceMesh], repairs: list[str]) -> list[SurfaceMesh]:
    """Surfaces without those that repeat another one, as collision geometry often does."""
    kept: list[SurfaceMesh] = []
    for surface in surfaces:
        if len(surface.triangles) == 0:
            continue
        for other in kept:
            same = surface.points.shape == other.points.shape and surface.triangles.shape == other.triangles.shape
            if same and np.allclose(surface.points, other.points, rtol=0.0, atol=1e-6 * np.ptp(other.points)):
                repairs.append(f"left out {surface.path}, a copy of {other.path}")
                break
        else:
            kept.append(surface)
    return kept


def _closed_parts(surface: SurfaceMesh, repairs: list[str]) -> list[trimesh.Trimesh]:
    """The connected parts of a surface, each closed and outward, cavities joined to the part around them."""
    points = np.asarray(surface.points, dtype=float)
    if not np.isfinite(points).all():
        raise ShotError("a point is not finite", path=surface.path, attribute="points", remedy=_REMEDY)
    mesh = trimesh.Trimesh(points, surface.triangles, process=False)
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    digits = int(np.clip(-np.floor(np.log10(max(_MERGE * diagonal, 1e-12))), 0, 12))
    mesh.merge_vertices(merge_tex=True, merge_norm=True, digits_vertex=digits)
    before = len(mesh.faces)
    mesh.update_faces(mesh.nondegenerate_faces() & mesh.unique_faces())
    if len(mesh.faces) < before:
        repairs.append(f"{surface.path}: dropped {before - len(mesh.faces)} degenerate or repeated triangles")
    area = mesh.area
    parts, crumbs = [], 0
    for part in mesh.split(only_watertight=False, repair=False):
        if part.area < _CRUMB * area and not part.is_watertight:
            crumbs += 1
            continue
        parts.append(_closed_part(part, surface.path, repairs))
    if crumbs:
        repairs.append(f"{surface.path}: dropped {crumbs} stray scraps of surface")
    return _outward([part for part in parts if abs(part.volume) > 1e-9 * part.area**1.5], surface.path, repairs)


def _closed_part(part: trimesh.Trimesh, path: str, repairs: list[str]) -> trimesh.Trimesh:
    if not part.is_winding_consistent:
        trimesh.repair.fix_winding(part)
        repairs.append(f"{path}: made the orientation of the triangles agree")
    closure = close(np.asarray(part.vertices), np.asarray(part.faces))
    if len(closure.areas) == 0:
        return part
    area = surface_area(np.asarray(part.vertices), np.asarray(part.faces))
    if closure.areas.max() > _HOLE * area or closure.areas.sum() > _HOLES * area:
        raise ShotError(
            "is an open surface, so it has no inside to fill with tetrahedra", path=path,
            found=f"{len(closure.areas)} holes, the largest {100.0 * closure.areas.max() / area:.3g}% of the surface",
            remedy=_REMEDY,
        )  # fmt: skip
    holes = f"{len(closure.areas)} hole" + ("s" if len(closure.areas) > 1 else "")
    repairs.append(f"{path}: closed {holes}, {100.0 * closure.areas.sum() / area:.2g}% of the surface")
    return trimesh.Trimesh(closure.points, closure.triangles, process=False)


def _outward(parts: list[trimesh.Trimesh], path: str, repairs: list[str]) -> list[trimesh.Trimesh]:
    """Turns parts that are inside out; those inside another part are cavities, and stay inward as part of it."""
    if sum(part.volume for part in parts) < 0.0:
        repairs.append(f"{path}: turned the surface, which was inside out")
        for part in parts:
            part.invert()
    solids = sorted((part for part in parts if part.volume > 0.0), key=lambda part: part.volume)
    for part in [part for part in parts if part.volume < 0.0]:
        around = [s for s in solids if _holds(s, part.vertices[0]) and s.volume > -part.volume]
        if around:
            at = next(i for i, solid in enumerate(solids) if solid is around[0])
            solids[at] = trimesh.util.concatenate([solids[at], part])
        else:
            part.invert()
            repairs.append(f"{path}: turned a part that was inside out")
            solids.append(part)
    return solids


def _holds(solid: trimesh.Trimesh, point: np.ndarray) -> bool:
    return winding_number(np.asarray(point), np.asarray(solid.vertices), np.asarray(solid.faces)) > 0.5


def _unite(parts: list[trimesh.Trimesh], body: str) -> trimesh.Trimesh:
    """The union; also of one part, since that resolves where it runs through itself."""
    try:
        return trimesh.boolean.union(parts, engine="manifold", check_volume=False)
    except Exception as error:
        raise ShotError(
            "its surfaces cannot be united into one solid", path=body, found=str(error), remedy=_REMEDY
        ) from error


def _without_loose_pieces(
    united: trimesh.Trimesh, pieces: list[trimesh.Trimesh], repairs: list[str], body: str
) -> trimesh.Trimesh:
    """Without small solids that touch nothing; they cannot be part of a body that holds together."""
    least = _LOOSE * united.volume
    loose = [piece for piece in pieces if 0.0 < piece.volume < least]
    if sum(piece.volume > 0.0 for piece in pieces) - len(loose) > 1:
        sizes = ", ".join(f"{1e6 * piece.volume:.3g}" for piece in pieces if piece.volume >= least)
        raise ShotError(
            "its surfaces are separate solids that touch nowhere", path=body, found=f"{sizes} cm^3",
            remedy="Make them overlap, or split them into several bodies",
        )  # fmt: skip
    inward = [piece for piece in pieces if piece.volume < 0.0]
    cavities = [piece for piece in inward if not any(_holds(solid, piece.vertices[0]) for solid in loose)]
    lost = sum(piece.volume for piece in loose)
    repairs.append(f"left out {len(loose)} loose pieces, {100.0 * lost / united.volume:.2g}% of the volume")
    return trimesh.util.concatenate([piece for piece in pieces if piece.volume >= least] + cavities)
