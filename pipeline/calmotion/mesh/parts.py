"""What the tetrahedra of a body are made of: skin and core of a printed part, or parts with their own materials."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from calmotion.arrays import Array, Indices, IntArray, box_diagonal
from calmotion.mesh.surfaces.closed_surfaces import winding_numbers
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import boundary_triangles, surface_volume
from calmotion.model.character import ElasticMaterial
from calmotion.model.meshes import Core, Part

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


# An edge has as many parts as make them half as long as the skin is thick, within limits, of all samples too
_FINE, _FEWEST, _MOST, _SAMPLES = 2.0, 4, 20, 3_000_000
_EXTENT = 1.4  # of a part across the skin, of the cube root of its volume
_CHUNK = 500_000  # samples at a time
_REGULAR = 0.118  # volume of a regular tetrahedron of edge 1


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
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    edge = float(np.cbrt(np.quantile(volumes, 0.9) / _REGULAR))
    most = min(_MOST, int(np.cbrt(_SAMPLES / len(tets))))
    parts = max(min(int(np.ceil(_FINE * edge / core.skin)), most), _FEWEST)
    places = places_of(parts)
    extents = _EXTENT * np.cbrt(volumes) / parts
    boundary = NearbyTriangles(points, boundary_triangles(tets), core.skin + float(extents.max()))
    shares = np.zeros((len(tets), len(places)))
    step = max(_CHUNK // len(places), 1)
    for start in range(0, len(tets), step):
        part = corners[start : start + step]
        at = np.einsum("pc,eci->epi", places, part).reshape(-1, 3)
        depth = np.linalg.norm(at - boundary.closest(at), axis=1).reshape(len(part), -1)
        # a part across the inner side of the skin is skin in proportion
        share = np.clip((core.skin - depth) / extents[start : start + step, None] + 0.5, 0.0, 1.0)
        shares[start : start + step] = np.nan_to_num(share, nan=0.0)
    return SkinShare(places, shares)


def places_of(parts: int) -> Array:
    """Barycentric coordinates of the centers of the equal parts of a tetrahedron, shape [parts^3, 4].

    The tetrahedron 1 >= x >= y >= z >= 0 consists of all of its like in the cells of a grid that are within it.
    """
    cells = np.stack(np.meshgrid(*(np.arange(parts),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    centers = []
    for first, second, third in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
        center = np.zeros(3)
        center[first], center[second], center[third] = 0.75, 0.5, 0.25
        centers.append((cells + center) / parts)
    x, y, z = np.concatenate(centers).T
    within = (x > y) & (y > z)
    x, y, z = x[within], y[within], z[within]
    return np.stack([1.0 - x, x - y, y - z, z], axis=1)


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
