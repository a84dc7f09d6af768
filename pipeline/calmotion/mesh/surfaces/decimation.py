"""A closed surface with fewer triangles, which stays as close as it can to what it was.

CAD surfaces of printed parts and motors have tens of thousands of triangles, most of them in fillets, threads and
letters. Edges are collapsed, the cheapest first, into the point that is closest to the planes of all triangles that
have been merged there: flat walls keep their thickness, edges and corners their place.

Libraries do not keep the walls of such parts: to 3,000 triangles fast-simplification changed the volume of five links
by 0.1 to 1.5% and left up to 276 edges with more than two triangles, and `Manifold.simplify` stopped at twice as many
triangles with 0.5 to 4% less volume; here the volume changes by 0.03 to 0.4%, and the surface stays closed.

Source: Garland and Heckbert 1997, Surface Simplification Using Quadric Error Metrics; the link condition of Dey,
Edelsbrunner, Guha and Nekhayev 1999 keeps the surface closed.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array, BoolArray, Indices

_PASSES = 200
_FEW, _PATIENCE = 3e-4, 15  # share of the triangles, and passes in a row with fewer collapses that end it
_CHEAPEST = 0.5  # share of the edges among which those of a pass are
_SHORT = 1e-6  # of the length of an edge: what it counts beside its distance, for edges in planes
_AHEAD = 1e-3  # of the trace of a quadric: how firmly the point stays at the middle where planes do not determine it
_TURNED = 0.2  # least cosine of the angle by which a triangle turns
_SLIVER = 2e-3  # least ratio of the height of a triangle to its longest side, unless it was as bad before


@dataclass(eq=False)
class _Edges:
    """What edges would be collapsed to: keys, ascending, and `_places`."""

    keys: Indices
    places: Array
    squares: Array
    costs: Array


@dataclass(eq=False)
class _Surface:
    """A surface that is being decimated.

    Attributes:
        points: Shape [n, 3].
        triangles: Shape [m, 3].
        normal, offset, weight: The quadric of each point, sum of w (n.x)^2 over its planes: their sum of w n n^T, of
            w d n and of w d^2, with d = -n.x of the plane, and of w; shapes [n, 3, 3], [n, 3] and [n, 2].
        changed: Points that have moved since the last pass, shape [n].
        known: Edges of the last pass; those without a changed end keep their places.
    """

    points: Array
    triangles: Indices
    normal: Array
    offset: Array
    weight: Array
    changed: BoolArray
    known: _Edges


def decimated(points: Array, triangles: Indices, count: int, distance: float) -> tuple[Array, Indices]:
    """Points [m], shape [k, 3], and triangles, shape [l, 3], of a coarser surface.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], closed; edges of more than two triangles stay as they are.
        count: Number of triangles that is wanted.
        distance: From the planes of the triangles that are merged in a point, root mean square [m]: no point is merged
            farther away, however many triangles are left.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    center, scale = 0.5 * (low + high), float(np.linalg.norm(high - low))
    surface = _with_quadrics((points - center) / scale, np.asarray(triangles, np.int32))
    none = np.zeros(0, np.int64)
    refused, collapsed, slow = none, True, 0
    for _ in range(_PASSES):
        excess = (len(surface.triangles) - count + 1) // 2
        if excess <= 0:
            break
        edges, places, costs = _candidates(surface, distance / scale, refused)
        if not len(edges):
            if not collapsed:
                break
            refused, collapsed = none, False  # what was refused may do where others have been collapsed
            continue
        chosen = _apart(surface.triangles, edges, np.argsort(np.argsort(costs, kind="stable")), len(surface.points))
        chosen = chosen[np.argsort(costs[chosen], kind="stable")][:excess]
        good = _keeps_triangles(surface, edges[chosen], places[chosen])
        refused = np.union1d(refused, _keys(edges[chosen[~good]], len(surface.points)))
        _collapse(surface, edges[chosen[good]], places[chosen[good]])
        collapsed |= bool(good.any())
        slow = slow + 1 if good.sum() < _FEW * len(surface.triangles) else 0
        if slow == _PATIENCE:
            break
    used, number = np.unique(surface.triangles, return_inverse=True)
    return surface.points[used] * scale + center, number.reshape(-1, 3).astype(np.int32)


def _with_quadrics(points: Array, triangles: Indices) -> _Surface:
    x = points[triangles]
    n = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    area = np.linalg.norm(n, axis=1)
    n /= np.maximum(area, np.finfo(float).tiny)[:, None]
    d = -np.einsum("tx,tx->t", n, x.mean(axis=1))
    count, none = len(points), np.zeros(0)
    surface = _Surface(
        points.copy(), triangles, np.zeros((count, 3, 3)), np.zeros((count, 3)), np.zeros((count, 2)),
        np.zeros(count, dtype=bool), _Edges(np.zeros(0, np.int64), np.zeros((0, 3)), none, none),
    )  # fmt: skip
    parts = (area[:, None, None] * n[:, :, None] * n[:, None], area[:, None] * d[:, None] * n)
    for corner in triangles.T:
        np.add.at(surface.normal, corner, parts[0])
        np.add.at(surface.offset, corner, parts[1])
        np.add.at(surface.weight, corner, np.stack([area * d * d, area], axis=1))
    return surface


def _candidates(surface: _Surface, distance: float, refused: Indices) -> tuple[Indices, Array, Array]:
    """The cheapest edges that may be collapsed, shape [k, 2], where to, shape [k, 3], and their costs, shape [k]."""
    n = len(surface.points)
    keys, repeated = np.unique(_keys(_edges(surface.triangles), n), return_counts=True)
    edges = np.stack([keys // n, keys % n], axis=1)
    # points on an edge of more than two triangles stay
    free = np.ones(n, dtype=bool)
    free[edges[repeated != 2]] = False
    allowed = free[edges].all(axis=1) & ~np.isin(keys, refused)
    edges = edges[allowed]
    made = surface.known = _updated(surface, keys[allowed], edges)
    surface.changed[:] = False
    kept = made.squares <= distance**2
    kept &= made.costs <= np.quantile(made.costs, _CHEAPEST) if len(edges) else True
    kept[kept] = _closed_after(keys, edges[kept], n)
    return edges[kept], made.places[kept], made.costs[kept]


def _updated(surface: _Surface, keys: Indices, edges: Indices) -> _Edges:
    """What edges would be collapsed to, with the work of `_places` for those that are new or have changed."""
    known, at = surface.known, np.searchsorted(surface.known.keys, keys)
    same = np.zeros(len(keys), dtype=bool)
    inside = at < len(known.keys)
    same[inside] = (known.keys[at[inside]] == keys[inside]) & ~surface.changed[edges[inside]].any(axis=1)
    made = _Edges(keys, np.empty((len(keys), 3)), np.empty(len(keys)), np.empty(len(keys)))
    fresh = _places(surface, edges[~same])
    for values, old, new in zip(
        (made.places, made.squares, made.costs), (known.places, known.squares, known.costs), fresh, strict=True
    ):
        values[same], values[~same] = old[at[same]], new
    return made


def _edges(triangles: Indices) -> Indices:
    return np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)


def _keys(edges: Indices, count: int) -> Indices:
    return np.asarray(edges[:, 0].astype(np.int64) * count + edges[:, 1])


def _places(surface: _Surface, edges: Indices) -> tuple[Array, Array, Array]:
    """Where edges are collapsed to, mean square of the distance to their planes there, and costs."""
    a, b = edges.T
    N, o = surface.normal[a] + surface.normal[b], surface.offset[a] + surface.offset[b]
    square, weight = (surface.weight[a] + surface.weight[b]).T
    middle = 0.5 * (surface.points[a] + surface.points[b])
    ahead = _AHEAD * np.trace(N, axis1=1, axis2=2) + np.finfo(float).tiny
    gradient = np.einsum("exy,ey->ex", N, middle) + o
    best = middle - np.linalg.solve(N + ahead[:, None, None] * np.eye(3), gradient[:, :, None])[:, :, 0]
    tried = np.stack([best, surface.points[a], surface.points[b]])  # corners stay where they are
    sums = np.einsum("kex,exy,key->ke", tried, N, tried) + 2.0 * np.einsum("ex,kex->ke", o, tried) + square
    least = sums.argmin(axis=0)
    places, sums = tried[least, np.arange(len(edges))], np.maximum(sums.min(axis=0), 0.0)
    length = np.linalg.norm(surface.points[a] - surface.points[b], axis=1)
    return places, sums / np.maximum(weight, np.finfo(float).tiny), sums + _SHORT * weight * length**2


def _closed_after(keys: Indices, edges: Indices, count: int) -> BoolArray:
    """Whether the ends of an edge have two neighbours in common: more would be merged into a fin.

    Args:
        keys: Of all edges, one each.
        edges: Shape [k, 2].
        count: Number of points.
    """
    both = np.sort(np.concatenate([keys, keys % count * count + keys // count]))
    begins = np.searchsorted(both, count * np.arange(count + 1))
    near = csr_matrix((np.ones(len(both), np.int32), both % count, begins), shape=(count, count))
    common = near[edges[:, 0]].multiply(near[edges[:, 1]]).sum(axis=1)
    return np.asarray(np.asarray(common).ravel() == 2)


def _apart(triangles: Indices, edges: Indices, rank: Indices, count: int) -> Indices:
    """Edges that come before all others around the neighbours of their ends: no triangle has points of two of them."""
    first = np.full(count, len(edges), np.int64)
    for end in edges.T:
        np.minimum.at(first, end, rank)
    around = first.copy()
    for corner in range(3):
        np.minimum.at(around, triangles[:, corner], first[triangles].min(axis=1))
    return np.flatnonzero((around[edges[:, 0]] == rank) & (around[edges[:, 1]] == rank))


def _keeps_triangles(surface: _Surface, edges: Indices, places: Array) -> BoolArray:
    """Whether no triangle around an edge turns over or becomes a sliver, for edges that are apart."""
    owner = np.full(len(surface.points), -1)
    moved = surface.points.copy()
    for end in edges.T:
        owner[end] = np.arange(len(edges))
        moved[end] = places
    owners = owner[surface.triangles]
    of = owners.max(axis=1)
    changed = np.flatnonzero((of >= 0) & ((owners >= 0).sum(axis=1) == 1))
    before, after = (x[surface.triangles[changed]] for x in (surface.points, moved))
    n0, n1 = (np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) for x in (before, after))
    a0, a1 = np.linalg.norm(n0, axis=1), np.linalg.norm(n1, axis=1)
    bad = np.einsum("tx,tx->t", n0, n1) < _TURNED * a0 * a1
    bad |= _slimness(after, a1) < np.minimum(_SLIVER, 0.5 * _slimness(before, a0))
    good = np.ones(len(edges), dtype=bool)
    good[of[changed[bad]]] = False
    return good


def _slimness(x: Array, doubled: Array) -> Array:
    """Height over longest side of triangles with twice an area."""
    sides = x[:, [1, 2, 0]] - x
    longest = np.einsum("tsx,tsx->ts", sides, sides).max(axis=1)
    return np.asarray(doubled / np.maximum(longest, np.finfo(float).tiny))


def _collapse(surface: _Surface, edges: Indices, places: Array) -> None:
    kept, gone = edges.T
    surface.points[kept] = places
    surface.changed[kept] = True
    for quadric in (surface.normal, surface.offset, surface.weight):
        quadric[kept] += quadric[gone]
    number = np.arange(len(surface.points), dtype=np.int32)
    number[gone] = kept
    triangles = number[surface.triangles]
    a, b, c = triangles.T
    surface.triangles = triangles[(a != b) & (b != c) & (c != a)]
