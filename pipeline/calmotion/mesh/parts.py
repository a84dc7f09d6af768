"""What the tetrahedra of a body are made of: skin and core of a printed part, or parts with their own materials."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy.spatial import cKDTree

from calmotion.arrays import Array, Indices, IntArray, box_diagonal
from calmotion.mesh.surfaces.closed_surfaces import winding_numbers
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import boundary_triangles, surface_volume, tet_volumes
from calmotion.model.character import ElasticMaterial
from calmotion.model.meshes import Core, Part
from calmotion.support.compilation import inlined_kernel, kernel

_PARTS = 6  # along an edge of an element, of which each is in one part of the body


@dataclass(frozen=True, eq=False)
class Makeup:
    """The materials in the tetrahedra of a body, relative to the material of the body.

    Attributes:
        places: Barycentric coordinates of the centers of equal parts of a tetrahedron, shape [p, 4].
        moduli: Young's modulus there, shape [e, p].
        densities: Shape [e, p].
        damping: Fraction of critical damping there, absolute, shape [e, p]; None where it is that of the body.
        parts: Index of the part of the body there, shape [e, p]; None of a body without parts.
    """

    places: Array
    moduli: Array
    densities: Array
    damping: Array | None = None
    parts: Indices | None = None

    @property
    def density(self) -> Array:
        """Mean of each tetrahedron, shape [e]."""
        return np.asarray(self.densities.mean(axis=1))


def makeup_of(points: Array, tets: IntArray, material: ElasticMaterial) -> Makeup | None:
    """What tetrahedra are made of; None where all are of the material of the body.

    Args:
        points: Corners [m], shape [n, 3].
        tets: Shape [e, 4], positive volumes.
        material: Of the body, with its core or its parts.
    """
    if material.core is not None:
        core, skin = material.core, skin_share(points, tets, material.core)
        moduli, densities = (low + (1.0 - low) * skin.shares for low in (core.stiffness, core.infill))
        return Makeup(skin.places, moduli, densities)
    if not material.parts:
        return None
    places = places_of(_PARTS)
    part = part_of_places(points, tets, material.parts, places)
    moduli, densities, damping = np.array([(p.modulus, p.density, p.damping) for p in material.parts]).T
    return Makeup(places, moduli[part], densities[part], damping[part], part)


# Near the corners and in the middle of a tetrahedron: where all are in one part, all of it is taken for that
_PROBES = np.vstack([np.full((4, 4), 0.02) + 0.92 * np.eye(4), np.full((1, 4), 0.25)])
_REACH = 0.02  # of the size of all parts: how exactly the nearest part of a place in none is known


def holders(places: Array, parts: Sequence[Part]) -> Indices:
    """Index of the part that holds each place, shape [k].

    Where several do, the one with the least volume: an insert is inside the shell around it. Where none does, as in
    the struts that join separate parts, the nearest one.

    Args:
        places: [m], shape [k, 3].
        parts: At least one.
    """
    found = np.full(len(places), -1)
    for index in np.argsort([-abs(surface_volume(part.points, part.triangles)) for part in parts], kind="stable"):
        part = parts[index]
        corners = part.points[part.triangles].reshape(-1, 3)
        near = np.flatnonzero(((places >= corners.min(axis=0)) & (places <= corners.max(axis=0))).all(axis=1))
        if len(near):
            wound = np.abs(winding_numbers(places[near], part.points, part.triangles)) > 0.5
            found[near[wound]] = index
    size = box_diagonal(np.vstack([part.points[part.triangles.ravel()] for part in parts]))
    left = np.flatnonzero(found < 0)
    if len(left):
        found[left] = _nearest(places[left], parts, _REACH * size)
    return found


def _nearest(places: Array, parts: Sequence[Part], reach: float) -> Indices:
    """Index of the part with the nearest surface, shape [k]; beyond reach, of that with the nearest corner."""
    least, found = np.full(len(places), np.inf), np.zeros(len(places), np.int64)
    for index, part in enumerate(parts):
        closest = NearbyTriangles(part.points, part.triangles, reach).closest(places)
        away = np.linalg.norm(closest - places, axis=1)
        far = np.isnan(away)
        if far.any():
            away[far] = reach + cKDTree(part.points[np.unique(part.triangles)]).query(places[far])[0]
        found[away < least] = index
        least = np.minimum(least, away)
    return found


def part_of_places(points: Array, tets: IntArray, parts: Sequence[Part], places: Array) -> Indices:
    """Index of the part at places in tetrahedra, shape [e, p].

    Args:
        points: Corners [m], shape [n, 3].
        tets: Shape [e, 4].
        parts: At least one.
        places: Barycentric coordinates, shape [p, 4].
    """
    probed = holders(np.einsum("pc,eci->epi", _PROBES, points[tets]).reshape(-1, 3), parts).reshape(len(tets), -1)
    found = np.repeat(probed[:, -1:], len(places), axis=1)
    mixed = np.flatnonzero((probed != probed[:, :1]).any(axis=1))
    if len(mixed):
        at = np.einsum("pc,eci->epi", places, points[tets[mixed]]).reshape(-1, 3)
        found[mixed] = holders(at, parts).reshape(len(mixed), -1)
    return found


# An edge has as many parts as make them as long as the skin is thick, within limits, of all samples too
_FINE, _FEWEST, _MOST, _SAMPLES = 1.0, 4, 20, 3_000_000
_CHUNK = 500_000  # samples at a time
_REGULAR = 0.118  # volume of a regular tetrahedron of edge 1

# Relative error of frequencies by elements of a length that is that of the skin: 0.02 to 0.29% for the first three of
# five printed bars, 3:1 to 15:1, with elements of 4 to 8 times the skin, and up to 0.4% with larger ones
_CORE_ERROR = 3e-3


def error_of_core(points: Array, tets: IntArray, core: Core | None) -> float:
    """Relative error of the stiffness of a printed body by elements that skin and core share; 0 without a core.

    Such an element strains as a whole, where the core shears more than the skin; two meshes that are nearly as fine
    hardly tell it.

    Args:
        points: Corners [m], shape [n, 3].
        tets: Shape [e, 4].
    """
    if core is None:
        return 0.0
    volumes = tet_volumes(points, tets)
    edge = float(np.cbrt(volumes @ volumes / volumes.sum() / _REGULAR))
    return 2.0 * _CORE_ERROR * edge / core.skin


@dataclass(frozen=True, eq=False)
class SkinShare:
    """The skin in the tetrahedra of a body.

    Attributes:
        places: Barycentric coordinates of the parts of a tetrahedron, shape [p, 4].
        shares: Of each part that is skin, shape [e, p].
    """

    places: Array
    shares: Array


def skin_share(points: Array, tets: IntArray, core: Core) -> SkinShare:
    """The skin of tetrahedra, below their boundary.

    Args:
        points: Corners [m], shape [n, 3].
        tets: Shape [e, 4], positive volumes.
    """
    corners = points[tets]
    volumes = tet_volumes(points, tets)
    edge = float(np.cbrt(np.quantile(volumes, 0.9) / _REGULAR))
    most = min(_MOST, int(np.cbrt(_SAMPLES / len(tets))))
    parts = max(min(int(np.ceil(_FINE * edge / core.skin)), most), _FEWEST)
    places, ends = parts_of(parts)
    away = ends - places[:, None]
    size = float(np.linalg.norm(corners[:, 1:] - corners[:, :1], axis=2).max()) / parts
    boundary = NearbyTriangles(points, boundary_triangles(tets), core.skin + 2.0 * size)
    shares = np.zeros((len(tets), len(places)))
    step = max(_CHUNK // len(places), 1)
    for start in range(0, len(tets), step):
        part = corners[start : start + step]
        at = np.einsum("pc,eci->epi", places, part)
        inward = at - boundary.closest(at.reshape(-1, 3)).reshape(at.shape)
        depth = np.linalg.norm(inward, axis=2)
        # the nearest side goes on as a plane within a part
        slopes = np.einsum("epi,eci->epc", inward / depth[:, :, None], part)
        heights = np.einsum("epc,pkc->epk", slopes, away)
        heights += depth[:, :, None] - core.skin
        heights = np.sort(np.nan_to_num(heights, nan=np.inf).reshape(-1, 4), axis=1)
        _shares_below(heights, shares[start : start + step].ravel())
    return SkinShare(places, shares)


@kernel
def _shares_below(heights: Array, shares: Array) -> None:
    """The shares of tetrahedra where a linear field is negative.

    Args:
        heights: Of the field at the corners, ascending, shape [k, 4].
        shares: The result, shape [k].
    """
    for k in range(len(heights)):
        a, b, c, d = heights[k, 0], heights[k, 1], heights[k, 2], heights[k, 3]
        if d <= 0.0:
            shares[k] = 1.0
        elif a >= 0.0:
            shares[k] = 0.0
        elif b >= 0.0:
            shares[k] = _to_zero(a, b) * _to_zero(a, c) * _to_zero(a, d)
        elif c <= 0.0:
            shares[k] = 1.0 - _to_zero(d, a) * _to_zero(d, b) * _to_zero(d, c)
        else:
            ac, ad, bc, bd = _to_zero(a, c), _to_zero(a, d), _to_zero(b, c), _to_zero(b, d)
            shares[k] = ac * ad + bc * bd * (1.0 - ac) + bd * ac * (1.0 - ad)


@inlined_kernel
def _to_zero(one: float, other: float) -> float:
    """Where a linear field is zero on the way from one value to another of the other sign, of the way."""
    return one / (one - other)


def parts_of(parts: int) -> tuple[Array, Array]:
    """Barycentric coordinates of the centers of the equal parts of a tetrahedron, shape [parts^3, 4], and of their
    corners, shape [parts^3, 4, 4].

    The tetrahedron 1 >= x >= y >= z >= 0 consists of all of its like in the cells of a grid that are within it.
    """
    cells = np.stack(np.meshgrid(*(np.arange(parts),) * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    ways = (np.cumsum([np.zeros(3, dtype=int), *order], axis=0) for order in permutations(np.eye(3, dtype=int)))
    corners = np.concatenate([cells + way for way in ways])
    corners = corners[(np.diff(corners, axis=2) <= 0).all(axis=(1, 2))]
    # sums of whole numbers are exact, so that centers in the plane between two parts lie in it
    return _barycentric(corners.sum(axis=1) / (4 * parts)), _barycentric(corners / parts)


def _barycentric(places: Array) -> Array:
    x, y, z = np.moveaxis(places, -1, 0)
    return np.stack([1.0 - x, x - y, y - z, z], axis=-1)


def places_of(parts: int) -> Array:
    """Barycentric coordinates of the centers of the equal parts of a tetrahedron, shape [parts^3, 4]."""
    return parts_of(parts)[0]


@dataclass(frozen=True, eq=False)
class Filling:
    """The materials in the elements of a body.

    Attributes:
        makeup: Of its elements, e of them.
        points: Barycentric coordinates of the rule, shape [e, 4, 4].
        weights: Of the rule, relative to the volume of the element in the material of the body, shape [e, 4], positive.
    """

    makeup: Makeup
    points: Array
    weights: Array


def filling_of(makeup: Makeup) -> Filling:
    """The rules of the elements.

    With S the mean of g x x^T, where x are barycentric coordinates and g the relative modulus, any factor S = L L^T is
    a rule: the columns of L, divided by their sums, are its points, and the squares of these sums its weights. The
    symmetric root gives the usual rule of four points where g is constant.
    """
    places, least = makeup.places, makeup.moduli.min(axis=1)
    n = round(len(places) ** (1.0 / 3.0))
    whole = (np.eye(4) + 1.0) / 20.0
    within = (np.eye(4) / 20.0 - 1.0 / 80.0) / n**2  # of a part about its center
    squares = np.einsum("pa,pb->pab", places, places) + within
    S = least[:, None, None] * whole + np.tensordot(makeup.moduli - least[:, None], squares, 1) / len(places)
    values, vectors = np.linalg.eigh(S)
    root = np.einsum("eij,ej,ekj->eik", vectors, np.sqrt(values), vectors)
    sums = root.sum(axis=1)
    return Filling(makeup, np.swapaxes(root, 1, 2) / sums[:, :, None], sums**2)


def element_masses(filling: Filling, shapes: Array, exact: Array) -> Array:
    """Mass matrices of ten-node tetrahedra relative to that of their volume in the body's material, shape [e, 10, 10].

    Args:
        shapes: The ten shape functions at the places of the makeup, shape [p, 10].
        exact: The matrix of a homogeneous element of volume and density 1, shape [10, 10].
    """
    densities = filling.makeup.densities
    least = densities.min(axis=1)
    more = densities - least[:, None]
    products = np.einsum("pa,pb->pab", shapes, shapes)
    # products that are sampled have another sum than exact ones: what is denser takes the share that is right for all
    sampled = products.mean(axis=0)
    denser = np.tensordot(more, products, 1) / len(shapes)
    share = more.mean(axis=1)[:, None, None]
    return np.asarray(least[:, None, None] * exact + denser + share * (exact - sampled))
