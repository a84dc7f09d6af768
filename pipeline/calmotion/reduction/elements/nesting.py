"""Displacements of a mesh on one with the same tetrahedra, of which some are divided."""

from __future__ import annotations

from typing import Any

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.mesh.quadratic import QuadraticMesh

_CANDIDATES = (8, 64, 4096)  # nearest tetrahedra that are searched for one that contains a point
_INSIDE, _ZERO = 1e-7, 1e-9  # rounding of barycentric coordinates


def prolongation(coarse: QuadraticMesh, fine: QuadraticMesh) -> tuple[Any, BoolArray] | None:
    """What displacements of a mesh are on a finer one, exactly.

    Args:
        coarse: The mesh.
        fine: The same, some tetrahedra divided; it begins with the corners of the coarse one.

    Returns:
        Values at the n nodes of the fine mesh from those at the m nodes of the coarse one, sparse CSR, shape [n, m],
        and which tetrahedra of the fine mesh are parts of one, shape [elements]; None if one mesh is not in the other.
    """
    from scipy.sparse import csr_matrix

    parents = _parents(coarse, fine)
    if parents is None:
        return None
    parent, divided = parents
    at = _barycentric(coarse, parent, fine.nodes[fine.tets[:, :4]])
    if at.min(initial=0.0) < -_INSIDE:
        return None
    i, j = np.array([0, 1, 0, 0, 1, 2]), np.array([1, 2, 2, 3, 3, 3])
    at = np.concatenate([at, 0.5 * (at[:, i] + at[:, j])], axis=1)  # [elements, 10 nodes, 4]
    n = len(fine.nodes)
    element, local = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    element[fine.tets] = np.arange(len(fine.tets))[:, None]
    local[fine.tets] = np.arange(10)
    at = at[element, local]
    shapes = np.hstack([at * (2.0 * at - 1.0), 4.0 * at[:, i] * at[:, j]])
    shapes[np.abs(shapes) < _ZERO] = 0.0
    rows = 10 * np.arange(n + 1)
    matrix = csr_matrix((shapes.ravel(), coarse.tets[parent[element]].ravel(), rows), shape=(n, len(coarse.nodes)))
    matrix.eliminate_zeros()
    return matrix, divided


def _parents(coarse: QuadraticMesh, fine: QuadraticMesh) -> tuple[IntArray, BoolArray] | None:
    """The coarse tetrahedron that contains each of the fine ones, and which of these are smaller."""
    from scipy.spatial import cKDTree

    before, after = np.sort(coarse.tets[:, :4], axis=1), np.sort(fine.tets[:, :4], axis=1)
    _, same = np.unique(np.vstack([before, after]), axis=0, return_inverse=True)
    same = same.ravel()
    of_group = np.full(same.max() + 1, -1)
    of_group[same[: len(before)]] = np.arange(len(before))
    parent = of_group[same[len(before) :]]
    divided = parent < 0
    gone = np.ones(len(before), dtype=bool)
    gone[parent[~divided]] = False
    candidates, open_ = np.flatnonzero(gone), np.flatnonzero(divided)
    if len(open_) and not len(candidates):
        return None
    centres = fine.nodes[fine.tets[:, :4]].mean(axis=1)
    tree = cKDTree(coarse.nodes[coarse.tets[candidates, :4]].mean(axis=1)) if len(candidates) else None
    for count in _CANDIDATES:
        if not len(open_) or tree is None:
            break
        near = tree.query(centres[open_], min(count, len(candidates)))[1].reshape(len(open_), -1)
        left = []
        for some in np.array_split(np.arange(len(open_)), 1 + near.size // 500_000):
            chosen = candidates[near[some]]
            places = np.repeat(centres[open_[some]][:, None], chosen.shape[1], axis=1).reshape(-1, 1, 3)
            least = _barycentric(coarse, chosen.ravel(), places)[:, 0].min(axis=1).reshape(chosen.shape)
            best = least.argmax(axis=1)
            found = least[np.arange(len(some)), best] > _INSIDE
            parent[open_[some[found]]] = chosen[found, best[found]]
            left.append(open_[some[~found]])
        open_ = np.concatenate(left)
    return None if len(open_) else (parent, divided)


def _barycentric(mesh: QuadraticMesh, elements: IntArray, places: Array) -> Array:
    """Coordinates of places, shape [k, p, 3], in one element for each row, shape [k, p, 4]."""
    corners = mesh.nodes[mesh.tets[elements, :4]]
    edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    rest = (np.linalg.inv(edges) @ (places - corners[:, :1]).transpose(0, 2, 1)).transpose(0, 2, 1)
    return np.concatenate([1.0 - rest.sum(axis=2, keepdims=True), rest], axis=2)
