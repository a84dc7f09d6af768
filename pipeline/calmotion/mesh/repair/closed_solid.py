"""One closed solid from the surfaces of a body: parts are closed one by one, manifold3d computes their union."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import box_diagonal
from calmotion.errors import ShotError
from calmotion.mesh.repair.closing import REMEDY, Part, closed_parts, concatenated, connected_pieces
from calmotion.mesh.repair.uniting import NotManifold, united, without_detail
from calmotion.mesh.sources.bridges import bridged, strutted
from calmotion.mesh.sources.slits import without_slits
from calmotion.mesh.surfaces.closed_surfaces import enclosed_volume, winding_number, winding_numbers
from calmotion.model import SurfaceMesh

# largest share of the surface that is inside out, and where holes of any size are capped; number of sample points
_INVERTED, _CROSSED, _PLACES = 0.02, 0.2, 200
_LOOSE = 1e-2  # of the volume: loose pieces such as screws
# Of the size: places on a grid are the same for links that are placed with another rounding (1e-16 of it), and differ
# from what the file says by less than its single precision does
_GRID = 2.0**-28
# Number of triangles from which a surface is decimated; distances, of the size, the largest half of the narrowest
# envelope of a mesh; largest change of the volume
_MANY, _TOLERANCES, _LOST = 200_000, (3e-5, 1e-4), 1e-3


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed surface.

    Attributes:
        points: [m], shape [n, 3], body frame.
        triangles: Shape [m, 3], outward.
        volume: [m^3].
        repairs: Messages about repairs.
        source: What it was made of, for the user.
    """

    points: np.ndarray
    triangles: np.ndarray
    volume: float
    repairs: tuple[str, ...]
    source: str = "visual surface"


def closed_solid(surfaces: Sequence[SurfaceMesh], body: str, any_hole: bool = False) -> Solid:
    """One solid from the surfaces of a body: repaired, then united.

    A closed shell inside another one is a cavity where it has the opposite orientation, and solid otherwise.

    Args:
        surfaces: Surfaces of the body, body frame.
        body: Prim path of the body.
        any_hole: Whether holes of any size are capped.

    Raises:
        ShotError: A surface is open or encloses no volume; the error has the path of its Mesh prim.
    """
    repairs: list[str] = []
    kept = _without_copies([_checked(surface, repairs) for surface in surfaces], repairs)
    if not kept:
        raise ShotError("its surfaces enclose no volume", path=body, found="no triangles", remedy=REMEDY)
    # centered and scaled to size one: tolerances do not depend on the unit or the position
    all_points = np.vstack([surface.points[surface.triangles.ravel()] for surface in kept])
    center, scale = 0.5 * (all_points.min(axis=0) + all_points.max(axis=0)), box_diagonal(all_points)
    if not scale > 0.0:
        raise ShotError("its surfaces enclose no volume", path=body, found="all points coincide", remedy=REMEDY)
    # links of one shape have one mesh, in whatever order a file has their parts and with whatever rounding it has them
    kept = [replace(surface, points=np.round((surface.points - center) / scale / _GRID) * _GRID) for surface in kept]
    kept.sort(key=lambda surface: (-len(surface.triangles), *np.round(surface.points.mean(axis=0), 6)))
    parts = _parts(kept, repairs, any_hole)
    if not parts:
        raise ShotError("its surfaces enclose no volume", path=body, found="no solid part", remedy=REMEDY)
    try:
        whole = united(parts)
    except NotManifold as error:
        raise ShotError(
            "its surfaces cannot be united into one solid", path=body, found=str(error), remedy=REMEDY
        ) from error
    if any_hole:
        whole = without_slits(whole, scale, repairs)
    whole = _in_one_piece(whole, scale, repairs, body, any_hole)
    if not whole.volume > 0.0:
        raise ShotError("its surfaces enclose no volume", path=body, found=f"{whole.volume:.3g} m^3", remedy=REMEDY)
    inverted = _inside_out(whole)
    crossed = inverted > _INVERTED
    if inverted > (_CROSSED if any_hole else _INVERTED):
        raise ShotError(
            "its surface intersects itself, and a part of it is inside out",
            path=body,
            found=f"{100.0 * inverted:.2g}% of the surface",
            remedy="Untwist it, or author a TetMesh below the body",
        )
    if crossed:
        repairs.append(
            f"its surface intersects itself, {100.0 * inverted:.2g}% of it inside out: all that it encloses counts as "
            "solid"
        )
    volume = (enclosed_volume(whole.points, whole.triangles) if crossed else whole.volume) * scale**3
    whole = _decimated(whole, scale, repairs)
    return Solid(whole.points * scale + center, whole.triangles.astype(np.int32), volume, tuple(repairs))


def simplified(solid: Solid, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a solid without detail below a tolerance [m]; this halves the time for dense surfaces."""
    coarse = without_detail(Part(solid.points, solid.triangles), tolerance)
    return coarse.points, coarse.triangles.astype(np.int32)


def _decimated(whole: Part, scale: float, repairs: list[str]) -> Part:
    """A huge surface without detail far below what the mesh resolves: each later step then takes seconds.

    The volume that meshes are compared with remains that of the whole surface.
    """
    count = len(whole.triangles)
    coarse, used, lost = whole, 0.0, 0.0
    for tolerance in _TOLERANCES:
        if len(coarse.triangles) <= _MANY:
            break
        made = without_detail(whole, tolerance)
        error = abs(made.volume / whole.volume - 1.0)
        if error > _LOST:
            break
        coarse, used, lost = made, tolerance, error
    if len(coarse.triangles) < count:
        repairs.append(
            f"decimated {count} triangles to {len(coarse.triangles)}: distance up to {1e3 * scale * used:.2g} mm, "
            f"volume error {lost:.2g}"
        )
    return coarse


def _checked(surface: SurfaceMesh, repairs: list[str]) -> SurfaceMesh:
    """A surface whose triangles refer to existing, finite points."""
    points = np.asarray(surface.points, dtype=float).reshape(-1, 3)
    triangles = np.asarray(surface.triangles).reshape(-1, 3)
    if len(triangles) == 0:
        return replace(surface, points=points, triangles=triangles)
    if triangles.min() < 0 or triangles.max() >= len(points):
        worst = int(triangles.min()) if triangles.min() < 0 else int(triangles.max())
        raise ShotError(
            f"a triangle refers to a point that does not exist ({len(points)} points)",
            path=surface.path,
            attribute="faceVertexIndices",
            found=worst,
            remedy="Correct the indices",
        )
    bad = ~np.isfinite(points).all(axis=1)
    if bad[triangles].any():
        raise ShotError(
            "a point is not finite",
            path=surface.path,
            attribute="points",
            found=f"point {int(triangles[bad[triangles]].min())}",
            remedy="Correct it, or remove its faces",
        )
    if bad.any():
        repairs.append(f"{surface.path}: ignored {int(bad.sum())} unused points that are not finite")
        points = np.where(bad[:, None], points[triangles[0, 0]], points)
    return replace(surface, points=points, triangles=triangles)


def _without_copies(surfaces: Sequence[SurfaceMesh], repairs: list[str]) -> list[SurfaceMesh]:
    """Surfaces without copies of other ones, which collision geometry often contains."""
    kept: list[SurfaceMesh] = []
    for surface in surfaces:
        if len(surface.triangles) == 0:
            continue
        for other in kept:
            same = surface.points.shape == other.points.shape and surface.triangles.shape == other.triangles.shape
            if same and np.allclose(surface.points, other.points, rtol=0.0, atol=1e-6 * np.ptp(other.points)):
                repairs.append(f"ignored {surface.path}, a copy of {other.path}")
                break
        else:
            kept.append(surface)
    return kept


def _parts(surfaces: list[SurfaceMesh], repairs: list[str], any_hole: bool) -> list[Part]:
    """Closed outward parts. Open surfaces are joined first: closed surfaces are often divided by color."""
    parts: list[Part] = []
    opened: list[tuple[SurfaceMesh, ShotError]] = []
    for surface in surfaces:
        try:
            parts += _closed_outward(surface, repairs)
        except ShotError as error:
            opened.append((surface, error))
    if not opened:
        return parts
    whole = opened[0][0]
    if len(opened) > 1:
        names = ", ".join(surface.path for surface, _ in opened)
        starts = np.cumsum([0] + [len(surface.points) for surface, _ in opened[:-1]])
        triangles = [s.triangles.astype(np.int64) + k for (s, _), k in zip(opened, starts, strict=True)]
        points = np.vstack([surface.points for surface, _ in opened])
        whole = replace(whole, points=points, triangles=np.vstack(triangles))
        noted = [f"joined {len(opened)} open surfaces: {names}"]
        try:
            parts += _closed_outward(whole, noted)
        except ShotError:
            if not any_hole:
                raise opened[0][1] from None
        else:
            repairs += noted
            return parts
    if not any_hole:
        raise opened[0][1]
    return parts + _closed_outward(whole, repairs, any_hole)


def _closed_outward(surface: SurfaceMesh, repairs: list[str], any_hole: bool = False) -> list[Part]:
    noted: list[str] = []
    parts = closed_parts(surface.points, surface.triangles, surface.path, noted, any_hole)
    parts = _outward(parts, surface.path, noted)
    repairs += noted
    return parts


def _outward(parts: list[Part], path: str, repairs: list[str]) -> list[Part]:
    """Reorient parts that are inside out; inward parts inside another part are its cavities."""
    if sum(part.volume for part in parts) < 0.0:
        repairs.append(f"{path}: reoriented the surface, which was inside out")
        parts = [_inverted(part) for part in parts]
    solids = sorted((part for part in parts if part.volume > 0.0), key=lambda part: part.volume)
    turned = 0
    for part in [part for part in parts if part.volume < 0.0]:
        around = [i for i, s in enumerate(solids) if s.volume > -part.volume and _contains(s, part.points[0])]
        if around:
            solids[around[0]] = concatenated([solids[around[0]], part])
        else:
            turned += 1
            solids.append(_inverted(part))
    if turned:
        told = "a part that was" if turned == 1 else f"{turned} parts that were"
        repairs.append(f"{path}: reoriented {told} inside out")
    inside = sum(any(t.volume > s.volume and _contains(t, s.points[0]) for t in solids) for s in solids)
    if inside:
        repairs.append(
            f"{path}: treated {inside} closed shells inside others as solid, because they face outward; "
            "reverse their orientation to make cavities"
        )
    return solids


def _inverted(part: Part) -> Part:
    return Part(part.points, part.triangles[:, ::-1])


def _contains(solid: Part, point: np.ndarray) -> bool:
    low, high = solid.points.min(axis=0), solid.points.max(axis=0)
    return bool(((point > low) & (point < high)).all()) and winding_number(point, solid.points, solid.triangles) > 0.5


def _inside_out(whole: Part) -> float:
    """Share of a surface without material just below it, from evenly distributed sample points."""
    x = whole.points[whole.triangles]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    area = np.linalg.norm(normal, axis=1)
    upto = np.cumsum(area)
    chosen = np.minimum(np.searchsorted(upto, upto[-1] * (np.arange(_PLACES) + 0.5) / _PLACES), len(x) - 1)
    weights = np.random.default_rng(2).dirichlet(np.full(3, 2.0), _PLACES)
    places = np.einsum("ij,ijk->ik", weights, x[chosen]) - 1e-6 * normal[chosen] / area[chosen, None]
    return float((winding_numbers(places, whole.points, whole.triangles) < 0.5).mean())


def _in_one_piece(whole: Part, scale: float, repairs: list[str], body: str, any_gap: bool) -> Part:
    """One connected solid: small loose solids are removed, narrow gaps between large ones are bridged, or any gap."""
    pieces = connected_pieces(whole.points, whole.triangles)
    solids = [piece for piece in pieces if piece.volume > 0.0]
    if len(solids) <= 1:
        return whole
    least = _LOOSE * whole.volume
    loose = [piece for piece in solids if piece.volume < least]
    large = [piece for piece in solids if piece.volume >= least]
    cavities = [p for p in pieces if p.volume < 0.0 and not any(_contains(solid, p.points[0]) for solid in loose)]
    if loose:
        lost = sum(piece.volume for piece in loose)
        repairs.append(f"removed {len(loose)} loose pieces, {100.0 * lost / whole.volume:.2g}% of the volume")
    if len(large) == 1:
        return concatenated([*large, *cavities])
    joined, gap = bridged(large)
    if joined is None and any_gap:
        joined, gap = strutted(large)
        repairs.append(f"joined {len(large)} separate solids by struts across gaps of up to {1e3 * scale * gap:.2g} mm")
        return concatenated([joined, *cavities])
    if joined is None:
        sizes = ", ".join(f"{1e6 * scale**3 * piece.volume:.3g}" for piece in large)
        raise ShotError(
            "its surfaces are separate solids that do not touch",
            path=body,
            found=f"{sizes} cm^3",
            remedy="Make them overlap, or divide them into several bodies",
        )
    repairs.append(f"bridged gaps of up to {1e3 * scale * gap:.2g} mm between {len(large)} separate solids")
    return concatenated([joined, *cavities])
