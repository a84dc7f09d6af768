"""Closed parts of a surface: welded, consistently oriented, without sheets, with capped holes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from calmotion.arrays import box_diagonal
from calmotion.errors import ShotError
from calmotion.mesh.repair.junctions import split_at_junctions
from calmotion.mesh.sources.caps import capped
from calmotion.mesh.surfaces.closed_surfaces import Closure, boundary_walks, close
from calmotion.mesh.surfaces.orientation import closing_signs, patch_boundaries, patches_of
from calmotion.mesh.tetrahedra import surface_area, surface_volume

REMEDY = "Close the mesh, or name a closed one in calm:flexible:meshFile, or author a TetMesh below the body"

# tolerances of the diagonal: STL files repeat corners in single precision, modelled surfaces less accurately
_WELDS = (1e-6, 1e-5, 1e-4)
_CRUMB = 1e-3  # of the area: stray triangles
_SHEET, _FIN = 0.05, 0.3  # of the area: separate labels, sheets connected to a closed part
_SHEETS = 0.5  # of the area: each sheet where holes of any size are capped
_HOLE, _HOLES = 5e-3, 2e-2  # of the area of a part: one hole, all holes


@dataclass(frozen=True, eq=False)
class Part:
    """A closed, consistently oriented surface: points, shape [n, 3], and triangles, shape [m, 3]."""

    points: np.ndarray
    triangles: np.ndarray

    @cached_property
    def volume(self) -> float:
        """Volume; negative where the part is inside out."""
        return surface_volume(self.points, self.triangles)


@dataclass(frozen=True, eq=False)
class _Welded:
    points: np.ndarray
    triangles: np.ndarray
    dropped: int


def closed_parts(
    points: np.ndarray, triangles: np.ndarray, path: str, repairs: list[str], any_hole: bool = False
) -> list[Part]:
    """The connected parts of a surface, each closed; parts may be inside out.

    Args:
        points: Finite, scaled to a size of about one, shape [n, 3].
        triangles: Shape [m, 3].
        path: Mesh prim or file, for errors.
        repairs: Messages are appended.
        any_hole: Whether holes of any size are capped; sheets are left out then, as far as they are a small part.

    Raises:
        ShotError: The surface has large holes, or only one side.
    """
    welded = _best_welded(points, triangles, path, repairs)
    matched, splits = split_at_junctions(welded.points, welded.triangles, _WELDS[0])
    if splits:
        repairs.append(f"{path}: split {splits} triangles at corners of other triangles on their edges")
        welded = _Welded(welded.points, matched, welded.dropped)
    if welded.dropped:
        repairs.append(f"{path}: removed {welded.dropped} degenerate or repeated triangles")
    parts: list[Part] = []
    opened: list[tuple[Part, ShotError]] = []
    crumbs = 0
    caps: list[Closure] = []
    area = surface_area(welded.points, welded.triangles)
    for piece in connected_pieces(welded.points, welded.triangles):
        try:
            closure = _closed(piece, path, repairs, any_hole)
            parts.append(Part(closure.points, closure.triangles))
            caps += [closure] if len(closure.areas) else []
        except ShotError as error:
            if surface_area(piece.points, piece.triangles) < _CRUMB * area:
                crumbs += 1
            else:
                opened.append((piece, error))
    if caps:
        count = sum(len(closure.areas) for closure in caps)
        share = 100.0 * sum(closure.areas.sum() for closure in caps) / area
        repairs.append(f"{path}: closed {count} hole" + ("s" if count > 1 else "") + f", {share:.2g}% of the surface")
    if crumbs:
        repairs.append(f"{path}: removed {crumbs} stray scraps of surface")
    # a set of a million points takes seconds: only where there are open pieces
    points_of_parts = {tuple(point) for part in parts for point in part.points.tolist()} if opened else set()
    for piece, reason in opened:
        on_a_part = sum(tuple(point) in points_of_parts for point in piece.points.tolist()) >= 2
        largest = _SHEETS if any_hole else _FIN if on_a_part else _SHEET
        if not parts or surface_area(piece.points, piece.triangles) > largest * area:
            raise reason
        repairs.append(f"{path}: removed an open sheet")
    return [part for part in parts if not _is_flat(part)]


def connected_pieces(points: np.ndarray, triangles: np.ndarray) -> list[Part]:
    """Connected pieces of a surface with the points that they use, the largest first.

    Closed surfaces that only touch along an edge are separate pieces, so that a union can resolve overlaps.
    """
    patches = patches_of(triangles, _areas(Part(points, triangles)))
    rows, columns = np.nonzero(patch_boundaries(_flipped(triangles, patches.flip), patches.label, patches.count))
    bounds = coo_matrix((np.ones(len(rows)), (columns, rows)), shape=(patches.count, int(rows.max(initial=0)) + 1))
    count, group = connected_components(bounds @ bounds.T, directed=False)
    label = group[patches.label]
    pieces = []
    for k in np.argsort(-np.bincount(label, minlength=count), kind="stable"):
        used, corners = np.unique(triangles[label == k], return_inverse=True)
        pieces.append(Part(points[used], corners.reshape(-1, 3)))
    return pieces


def concatenated(parts: Sequence[Part]) -> Part:
    """Surfaces as one."""
    starts = np.cumsum([0] + [len(part.points) for part in parts[:-1]])
    triangles = np.vstack([part.triangles + start for part, start in zip(parts, starts, strict=True)])
    return Part(np.vstack([part.points for part in parts]), triangles)


def _is_flat(part: Part) -> bool:
    return bool(abs(part.volume) <= 1e-9 * surface_area(part.points, part.triangles) ** 1.5)


def _best_welded(points: np.ndarray, triangles: np.ndarray, path: str, repairs: list[str]) -> _Welded:
    """Welded with the least tolerance that closes the surface, or else with the fewest open edges."""
    diagonal = box_diagonal(points[triangles.ravel()])
    best, fewest = None, np.inf
    for tolerance in _WELDS:
        welded = _welded(points, triangles, tolerance * diagonal)
        flipped = _flipped(welded.triangles, patches_of(welded.triangles, _areas(welded)).flip)
        count = sum(len(walk) for walk in boundary_walks(flipped))
        if best is None or (count < fewest and len(flipped)):
            best, fewest, used = welded, count, tolerance
        if count == 0:
            break
    assert best is not None
    if used > _WELDS[0]:
        repairs.append(f"{path}: welded points up to {used:.0e} of the size of the surface apart")
    return best


def _welded(points: np.ndarray, triangles: np.ndarray, tolerance: float) -> _Welded:
    used, corners = np.unique(triangles, return_inverse=True)
    places = points[used]
    pairs = cKDTree(places).query_pairs(tolerance, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), pairs.T.reshape(2, -1)), shape=(len(places), len(places)))
    count, label = connected_components(graph, directed=False)
    first = np.full(count, len(places))
    np.minimum.at(first, label, np.arange(len(places)))
    faces = label[corners].reshape(-1, 3)
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[whole]
    single = np.sort(np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1])
    return _Welded(places[first], faces[single], len(triangles) - len(single))


def _areas(surface: _Welded | Part) -> np.ndarray:
    x = surface.points[surface.triangles]
    return np.asarray(0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1))


def _flipped(triangles: np.ndarray, flip: np.ndarray) -> np.ndarray:
    return np.where(flip[:, None], triangles[:, ::-1], triangles)


def _closed(piece: Part, path: str, repairs: list[str], any_hole: bool) -> Closure:
    """A connected piece with its holes capped."""
    triangles = piece.triangles
    if boundary_walks(triangles):
        triangles = _oriented(piece, path, repairs)
    closure = (capped if any_hole else close)(piece.points, triangles)
    if len(closure.areas) == 0:
        return Closure(piece.points, triangles, closure.areas, closure.sides)
    area = surface_area(piece.points, triangles)
    if area == 0.0:
        raise ShotError(
            "all triangles of this surface are without area",
            path=path,
            found=f"{len(triangles)} triangles",
            remedy=REMEDY,
        )
    # a single missing triangle is unique, however large it is
    doubtful = closure.areas[closure.sides > 3]
    large = len(doubtful) and (doubtful.max() > _HOLE * area or doubtful.sum() > _HOLES * area)
    if (large and not any_hole) or _is_flat(Part(closure.points, closure.triangles)):
        raise ShotError(
            "this is an open surface, which tetrahedra cannot fill",
            path=path,
            found=f"{len(closure.areas)} holes, the largest {100.0 * closure.areas.max() / area:.3g}% of the surface",
            remedy=REMEDY,
        )
    return closure


def _oriented(piece: Part, path: str, repairs: list[str]) -> np.ndarray:
    """Consistently oriented triangles, without sheets that keep the rest from closing."""
    areas = _areas(piece)
    patches = patches_of(piece.triangles, areas)
    if len(patches.one_sided):
        raise ShotError(
            "this surface has only one side, such as a Moebius strip",
            path=path,
            found=f"{int(np.isin(patches.label, patches.one_sided).sum())} triangles",
            remedy=REMEDY,
        )
    triangles = _flipped(piece.triangles, patches.flip)
    boundaries = patch_boundaries(triangles, patches.label, patches.count)
    signs = closing_signs(boundaries)
    triangles = _flipped(triangles, signs[patches.label] < 0.0)
    if (triangles != piece.triangles).any():
        repairs.append(f"{path}: made the orientation of the triangles consistent")
    sheets = _sheets(piece.points, triangles, patches.label, boundaries * signs)
    if sheets:
        repairs.append(f"{path}: removed {len(sheets)} sheets that divide the inside or stick out of it")
        triangles = triangles[~np.isin(patches.label, sheets)]
    return triangles


def _sheets(points: np.ndarray, triangles: np.ndarray, label: np.ndarray, boundaries: np.ndarray) -> list[int]:
    """Patches whose removal closes the rest; of several choices the one of largest volume."""
    sheets: list[int] = []
    kept = list(range(boundaries.shape[1]))
    total = boundaries.sum(axis=1)
    while np.any(total) and len(kept) > 1:
        rest = np.abs(total[:, None] - boundaries[:, kept]).sum(axis=0)
        best = [kept[k] for k in np.flatnonzero(rest == rest.min())]
        if rest.min() >= np.abs(total).sum():
            return []
        volumes = [abs(surface_volume(points, triangles[~np.isin(label, [*sheets, k])])) for k in best]
        chosen = best[int(np.argmax(volumes))]
        sheets.append(chosen)
        kept.remove(chosen)
        total = total - boundaries[:, chosen]
    return sheets if not np.any(total) else []
