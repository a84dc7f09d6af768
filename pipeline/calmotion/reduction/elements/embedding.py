"""Displacement and small rotation of arbitrary points of a body by its nodal displacements."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from calmotion.arrays import Array, Indices, IntArray
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.mesh.tetrahedra import face_normals, tet_volumes

_CANDIDATES = 24  # nearest elements of a point, by their centers
_ALL_PAIRS = 2_000_000  # largest number of pairs of point and element for an exhaustive search


@dataclass(frozen=True, eq=False)
class Embedding:
    """Points embedded in elements of a mesh.

    A point inside its element moves with the quadratic field. A point outside moves as if connected by a rigid arm to
    the nearest point of the nearest element (clamped barycentric coordinates), so rigid motions are exact everywhere.

    Attributes:
        nodes: Nodes of each point's element, shape [k, 10].
        values: Shape functions, shape [k, 10].
        gradients: Their gradients [1/m], shape [k, 10, 3].
        arms: From the nearest point of the element to the point [m], shape [k, 3]; zero inside.
    """

    nodes: IntArray
    values: Array
    gradients: Array
    arms: Array

    def displacements(self, modes: Array) -> Array:
        """Displacement of the points for nodal displacements `modes`, shape [n, 3, r] -> [k, 3, r]."""
        moved = self._sum(self.values, modes, np.arange(len(self.nodes)))
        outside = np.flatnonzero(np.abs(self.arms).max(axis=1, initial=0.0) > 0.0)
        if len(outside):
            rotation = self._curl(modes, outside)
            moved[outside] += np.cross(rotation, self.arms[outside][:, :, None], axis=1)
        return np.asarray(moved)

    def rotations(self, modes: Array) -> Array:
        """Small rotation (half the curl) at the points [rad per unit], shape [n, 3, r] -> [k, 3, r], body axes."""
        return self._curl(modes, np.arange(len(self.nodes)))

    def _curl(self, modes: Array, rows: Indices) -> Array:
        curl = np.zeros((len(rows), *modes.shape[1:]))
        for j in range(3):
            derivative, i, k = self._sum(self.gradients[rows, :, j], modes, rows), (j + 1) % 3, (j + 2) % 3
            curl[:, k] += derivative[:, i]
            curl[:, i] -= derivative[:, k]
        return 0.5 * curl

    def _sum(self, weights: Array, modes: Array, rows: Indices) -> Array:
        """Sums over the nodes of some points' elements; no array holds the modes of all of these nodes, ten a point.

        Args:
            weights: Shape [k, 10].
            modes: Shape [n, 3, r].
            rows: Shape [k].
        """
        k, n = len(rows), len(modes)
        begins = np.arange(0, weights.size + 1, weights.shape[1])
        S = csr_matrix((weights.ravel(), self.nodes[rows].ravel(), begins), shape=(k, n))
        return np.asarray(S @ modes.reshape(n, -1)).reshape(k, *modes.shape[1:])


def embed(mesh: QuadraticMesh, points: Array) -> Embedding:
    """Embed points in a mesh.

    Args:
        points: [m], shape [k, 3], body frame; inside or outside.
    """
    from skfem import ElementTetP2

    shape, mapping = ElementTetP2(), mesh.basis.mapping
    tets = mesh.tets[:, :4]
    x = mesh.nodes[tets]
    # outward for either orientation of the corners
    normals = face_normals(mesh.nodes, tets) * np.sign(tet_volumes(mesh.nodes, tets))[:, None, None]
    offsets = np.einsum("efk,efk->ef", normals, x[:, [1, 0, 0, 0]])
    element = _nearest_elements(mesh, x.mean(axis=1), normals, offsets, points)
    local = mapping.invF(points.T[:, :, None], tind=element)[:, :, 0]
    bary = np.vstack([1.0 - local.sum(axis=0), local])
    inside = bary.min(axis=0) >= -1e-9
    clamped = np.where(inside, bary, np.maximum(bary, 0.0))
    local = (clamped[1:] / clamped.sum(axis=0))[:, :, None]
    fields = [shape.gbasis(mapping, local, a, tind=element)[0] for a in range(10)]
    return Embedding(
        nodes=mesh.tets[element],
        values=np.stack([np.asarray(field)[:, 0] for field in fields], axis=1),
        gradients=np.stack([field.grad[:, :, 0].T for field in fields], axis=1),
        arms=np.where(inside[:, None], 0.0, points - mapping.F(local, tind=element)[:, :, 0].T),
    )


def _nearest_elements(mesh: QuadraticMesh, centers: Array, normals: Array, offsets: Array, points: Array) -> Indices:
    """The element that contains each point, or the one whose face planes it exceeds least."""
    element = np.empty(len(points), dtype=np.int64)
    if len(points) * len(centers) <= _ALL_PAIRS:
        rows = max(1, 200_000 // len(centers))
        for start in range(0, len(points), rows):
            part = points[start : start + rows]
            excess = np.full((len(part), len(centers)), -np.inf)
            for face in range(4):
                excess = np.maximum(excess, part @ normals[:, face].T - offsets[:, face])
            element[start : start + rows] = excess.argmin(axis=1)
        return element
    near_center = cKDTree(centers).query(points, k=min(_CANDIDATES, len(centers)))[1].reshape(len(points), -1)
    # the centers of many small elements may be nearer than that of the right large one: add those at the nearest node
    of_node = _elements_of_nodes(mesh)
    near_node = of_node[cKDTree(mesh.nodes).query(points)[1]]
    candidates = np.hstack([near_center, near_node])
    for start in range(0, len(points), 4096):
        part, chosen = points[start : start + 4096], candidates[start : start + 4096]
        excess = (np.einsum("kcfi,ki->kcf", normals[chosen], part, optimize=True) - offsets[chosen]).max(axis=2)
        element[start : start + 4096] = chosen[np.arange(len(part)), excess.argmin(axis=1)]
    return element


def _elements_of_nodes(mesh: QuadraticMesh) -> Indices:
    """Up to 32 elements of each node, shape [n, 32]; filled with the first."""
    node = mesh.tets.ravel()
    element = np.repeat(np.arange(len(mesh.tets)), mesh.tets.shape[1])
    order = np.argsort(node, kind="stable")
    node, element = node[order], element[order]
    first = np.searchsorted(node, np.arange(len(mesh.nodes)))
    count = np.searchsorted(node, np.arange(len(mesh.nodes)), side="right") - first
    slot = np.arange(32)[None, :]
    return element[first[:, None] + np.where(slot < count[:, None], slot, 0)]
