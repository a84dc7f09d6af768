"""Linear tetrahedra: volumes, orientation, dihedral angles, boundary."""

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, BoolArray, Indices, IntArray, box_diagonal
from calmotion.errors import ShotError
from calmotion.model.meshes import MeshQuality

MOST_POINTS = 2**21  # three numbers of corners fit in the 63 bits of one integer
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])  # face i is opposite corner i, outward


def tet_volumes(points: Array, tets: IntArray) -> Array:
    """Signed volumes [m^3], shape [m]; positive when corner 3 is on the right-hand side of 0, 1, 2."""
    x = points[tets]
    return np.asarray(np.einsum("ij,ij->i", np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), x[:, 3] - x[:, 0]) / 6.0)


def face_normals(points: Array, tets: IntArray) -> Array:
    """Outward unit normals of the four faces, face i opposite corner i, shape [m, 4, 3] (positive volumes)."""
    x = points[tets]
    a, b, c = (x[:, FACES[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    return np.asarray(n / np.maximum(np.linalg.norm(n, axis=-1, keepdims=True), np.finfo(float).tiny))


def boundary_triangles(tets: IntArray) -> IntArray:
    """Triangles that belong to one tetrahedron only, outward, shape [k, 3] (positive volumes)."""
    faces = tets[:, FACES].reshape(-1, 3)
    _, first, count = np.unique(corner_keys(faces), return_index=True, return_counts=True)
    return np.ascontiguousarray(faces[np.sort(first[count == 1])])


def corner_keys(corners: Indices) -> NDArray[np.int64]:
    """A number for each edge or triangle, whatever the order of its corners; comparing rows takes ten times as long.

    Args:
        corners: Indices below `MOST_POINTS`, shape [..., k] with k of at most 3.
    """
    ordered = np.sort(corners, axis=-1).astype(np.int64)
    return np.asarray(ordered @ MOST_POINTS ** np.arange(ordered.shape[-1])[::-1])


def min_dihedral_deg(points: Array, tets: IntArray) -> float:
    """Smallest dihedral angle of a mesh with positive volumes [deg]."""
    n = face_normals(points, tets)
    i, j = np.triu_indices(4, 1)
    cosine = np.clip(-np.einsum("mek,mek->me", n[:, i], n[:, j]), -1.0, 1.0)
    return float(np.degrees(np.arccos(cosine.max())))


def surface_volume(points: Array, triangles: Indices) -> float:
    """Volume enclosed by a closed, consistently outward surface [m^3] (divergence theorem)."""
    # about the centroid, against cancellation far from the origin
    x = (points - points.mean(axis=0))[triangles]
    return float(np.einsum("ij,ij->", np.cross(x[:, 0], x[:, 1]), x[:, 2]) / 6.0)


def surface_area(points: Array, triangles: Indices) -> float:
    """Area of a triangulated surface [m^2]."""
    x = points[triangles]
    return float(0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum())


_OUTWARD = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])  # faces of a tetrahedron of positive volume


def flat_tets(points: Array, tets: IntArray) -> BoolArray:
    """Whether each tetrahedron has no volume but rounding, shape [m]; points of shape [n, 3], tetrahedra [m, 4]."""
    x = points[tets]
    edge = np.linalg.norm(x[:, [1, 2, 3, 2, 3, 3]] - x[:, [0, 0, 0, 1, 1, 2]], axis=-1).max(axis=1)
    return np.asarray(np.abs(tet_volumes(points, tets)) <= 1e-9 * edge**3)


def oriented_tets(points: Array, tets: IntArray, path: str = "") -> tuple[IntArray, int]:
    """The tetrahedra with corners swapped where the volume was negative.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4].
        path: Prim path or file for the error.

    Returns:
        The tetrahedra, int32, shape [m, 4], and the number of swaps.

    Raises:
        ShotError: No tetrahedra, an index out of range, a point that is not finite, or a flat element; too many points.
    """
    tets = np.array(tets, dtype=np.int32).reshape(-1, 4)
    if len(points) > MOST_POINTS:
        raise ShotError(
            "the mesh has too many points",
            path=path,
            attribute="points",
            found=f"{len(points)}, at most {MOST_POINTS}",
            remedy="Author a coarser TetMesh, or remove it so that a closed Mesh is tetrahedralised",
        )
    remedy = "Author a TetMesh with valid elements, or remove it so that a closed Mesh is tetrahedralised"
    if len(tets) == 0:
        raise ShotError("the mesh has no tetrahedra", path=path, found=0, remedy=remedy)
    if tets.min() < 0 or tets.max() >= len(points):
        raise ShotError(
            "a tetrahedron names a point that does not exist",
            path=path,
            attribute="tetVertexIndices",
            found=int(tets.max()),
            remedy=remedy,
        )
    if not np.isfinite(points[tets]).all():
        raise ShotError("a point is not finite", path=path, attribute="points", remedy=remedy)
    volumes, flat = tet_volumes(points, tets), flat_tets(points, tets)
    if flat.any():
        element = int(np.flatnonzero(flat)[0])
        raise ShotError(
            "a tetrahedron has no volume",
            path=path,
            found=f"element {element}, {volumes[element]:.3g} m^3",
            remedy=remedy,
        )
    inverted = volumes < 0.0
    tets[inverted] = tets[inverted][:, [0, 2, 1, 3]]
    return tets, int(inverted.sum())


def refuse_bad_neighbours(tets: IntArray, path: str) -> None:
    """Refuse tetrahedra that lie in each other, and parts that hang together in a point or an edge alone.

    Neighbours have a face in common, which each has in the other's orientation. Parts whose faces do not fit each other
    need three points in common.

    Args:
        tets: Of positive volume, shape [m, 4].
        path: Prim path or file for the error.

    Raises:
        ShotError: Two have a face in the same orientation, so that both fill the same place; or the body would come
            apart at a hinge or a pivot.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    faces = np.asarray(tets)[:, _OUTWARD].reshape(-1, 3)
    odd = ((faces[:, 0] > faces[:, 1]) ^ (faces[:, 0] > faces[:, 2])) ^ (faces[:, 1] > faces[:, 2])
    corners = np.sort(faces, axis=1)
    order = np.lexsort((odd, corners[:, 2], corners[:, 1], corners[:, 0]))
    same = np.all(corners[order][1:] == corners[order][:-1], axis=1)
    twice = np.flatnonzero(same & (odd[order][1:] == odd[order][:-1]))
    if len(twice):
        one, other = sorted(order[[twice[0], twice[0] + 1]] // 4)
        raise ShotError(
            "two tetrahedra fill the same place, whose mass and stiffness would count twice",
            path=path,
            found=f"elements {one} and {other}",
            remedy="Remove one of them, or author the mesh again",
        )
    pairs = order[np.flatnonzero(same)] // 4, order[np.flatnonzero(same) + 1] // 4
    count = len(tets)
    graph = coo_matrix((np.ones(len(pairs[0])), pairs), shape=(count, count))
    parts, label = connected_components(graph, directed=False)
    if parts == 1:
        return
    corner = np.unique(tets, return_inverse=True)[1].reshape(-1)
    uses = coo_matrix((np.ones(len(corner)), (np.repeat(label, 4), corner)), shape=(parts, int(corner.max()) + 1))
    uses = (uses.tocsr() > 0).astype(float)
    count, label = connected_components((uses @ uses.T) >= 3.0, directed=False)
    if count > 1:
        raise ShotError(
            "parts of its tetrahedra are connected by points or edges only, about which they would turn freely",
            path=path,
            found=f"{count} parts",
            remedy="Join the parts by common faces, or split them into several bodies",
        )


def without_unused_points(points: Array, tets: IntArray) -> tuple[Array, IntArray]:
    """Points that tetrahedra use, in their order, and the renumbered tetrahedra."""
    used, inverse = np.unique(tets, return_inverse=True)
    return np.ascontiguousarray(points[used]), inverse.reshape(tets.shape).astype(np.int32)


def welded_tets(points: Array, tets: IntArray, tolerance: float) -> tuple[Array, IntArray, int]:
    """Tetrahedra with coincident points merged.

    Args:
        points: [m], shape [n, 3], every one used.
        tets: Shape [m, 4].
        tolerance: Largest distance of coincident points, relative to the diagonal of the bounding box.

    Returns:
        Points, tetrahedra, and the number of points that were merged into others.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    distance = tolerance * box_diagonal(points)
    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    n = len(points)
    graph = coo_matrix((np.ones(len(pairs)), pairs.T.reshape(2, -1)), shape=(n, n))
    count, label = connected_components(graph, directed=False)
    first = np.full(count, n)
    np.minimum.at(first, label, np.arange(n))
    return np.ascontiguousarray(points[first]), label[tets].astype(np.int32), n - int(count)


def connected_parts(tets: IntArray) -> int:
    """Number of parts that share no point; 1 for a connected body."""
    return int(part_of_each(tets).max()) + 1


def largest_part(points: Array, tets: IntArray) -> IntArray:
    """The tetrahedra of the part with the largest volume; parts share no side: what hangs at an edge is a hinge."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    first, second = shared_sides(tets)
    graph = coo_matrix((np.ones(len(first)), (first // 4, second // 4)), shape=(len(tets),) * 2)
    part = connected_components(graph, directed=False)[1]
    volumes = np.bincount(part, np.abs(tet_volumes(points, tets)))
    return np.asarray(tets[part == volumes.argmax()])


def shared_sides(tets: IntArray) -> tuple[Indices, Indices]:
    """Pairs of sides that two tetrahedra have in common, as 4 t + i for that of tetrahedron t opposite its corner i."""
    side = corner_keys(tets[:, FACES].reshape(-1, 3))
    order = np.argsort(side, kind="stable")
    twice = np.flatnonzero(side[order][1:] == side[order][:-1])
    return order[twice], order[twice + 1]


def part_of_each(cells: Indices) -> Indices:
    """Number of the part of each of m cells (tetrahedra, triangles; shape [m, k]), shape [m]; parts share no point."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    number = np.unique(cells, return_inverse=True)[1].reshape(cells.shape)
    n = int(number.max()) + 1
    rows, columns = np.repeat(number[:, 0], cells.shape[1] - 1), number[:, 1:].ravel()
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(n, n))
    label: Indices = connected_components(graph, directed=False)[1][number[:, 0]]
    return np.unique(label, return_inverse=True)[1].reshape(-1)


def measure_quality(
    points: Array, tets: IntArray, *, surface_volume: float | None = None, repairs: tuple[str, ...] = ()
) -> MeshQuality:
    """Smallest dihedral angle and volume of a mesh with positive volumes.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4].
        surface_volume: Volume of the surface that was meshed [m^3]; None where there was none.
        repairs: Repairs of this surface.
    """
    volume = float(tet_volumes(points, tets).sum())
    error = 0.0 if surface_volume is None else abs(volume - surface_volume) / surface_volume
    return MeshQuality(
        min_dihedral_deg=min_dihedral_deg(points, tets), volume=volume, volume_error=error, repairs=tuple(repairs)
    )


_APART = 0.05  # of the way to the middle of its elements, which a copy is moved
_THINNEST = 0.5  # least part of its volume that an element keeps


def without_contacts(points: Array, tets: IntArray) -> tuple[Array, IntArray]:
    """The tetrahedra with a point of its own for each side of a contact.

    Elements at a point are on one side where a way leads from one to the other through faces at this point; an edge
    both of whose ends are held in this way stays. Points of a contact are moved a little into their own sides: two in
    one place cannot be told apart.

    Args:
        points: [m], shape [n, 3].
        tets: Of positive volume, shape [m, 4].

    Returns:
        Points [m], shape [k, 3], and tetrahedra, shape [m, 4]; the same where there is no contact.
    """
    label, source = _sides(tets)
    doubled = np.bincount(source, minlength=len(points))[source] > 1
    if not doubled.any():
        return points, tets
    order = np.argsort(source, kind="stable")  # points that nothing touches keep their order
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    apart = number[label].reshape(tets.shape).astype(tets.dtype)
    return _moved(points[source[order]], apart, doubled[order]), apart


def _sides(tets: IntArray) -> tuple[Indices, Indices]:
    """The side to which each corner of each tetrahedron belongs, shape [4m], and the point of each side."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    corners = np.arange(4 * len(tets)).reshape(-1, 4)
    ways = []
    for faces in shared_sides(tets):  # the three corners of each, in the order of their numbers in the mesh
        at = corners[faces // 4][np.arange(len(faces))[:, None], FACES[faces % 4]]
        ways.append(np.take_along_axis(at, np.argsort(tets.ravel()[at], axis=1), axis=1).ravel())
    graph = coo_matrix((np.ones(len(ways[0])), tuple(ways)), shape=(corners.size,) * 2)
    label = connected_components(graph, directed=False)[1]
    _, first, numbered = np.unique(label, return_index=True, return_inverse=True)
    return numbered.reshape(-1), tets.ravel()[first].astype(np.int64)


def _moved(points: Array, tets: IntArray, chosen: BoolArray) -> Array:
    """The points with some of them moved into their elements, as far as no element becomes flat by that."""
    middle = np.repeat(points[tets].mean(axis=1), 4, axis=0)
    corner, uses = tets.ravel(), np.bincount(tets.ravel(), minlength=len(points))
    mean = np.stack([np.bincount(corner, middle[:, k], len(points)) for k in range(3)], axis=1) / uses[:, None]
    step = np.where(chosen[:, None], _APART * (mean - points), 0.0)
    least = _THINNEST * tet_volumes(points, tets)
    while (flattened := tet_volumes(points + step, tets) < least).any():
        step[np.unique(tets[flattened])] *= 0.5
    return np.asarray(points + step)
