"""Ten-node tetrahedra of a linear mesh, with scikit-fem's element."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.parts.filling import Filling
from calmotion.mesh.tetrahedra import boundary_triangles, corner_keys


@dataclass(frozen=True, eq=False)
class QuadraticMesh:
    """Straight-sided ten-node tetrahedra.

    Attributes:
        nodes: [m], shape [n, 3]: the corners in the order of the linear mesh, then the edge midpoints.
        tets: Shape [m, 10], nodes in the order of scikit-fem's ElementTetP2: corners 0..3, then the midpoints of
            edges 01, 12, 02, 03, 13, 23.
        surface: Outward boundary triangles, shape [k, 6]: three corners, then the midpoints of edges 01, 12, 20.
        basis: scikit-fem's scalar basis.
        filling: The materials in the elements of a body of several; None: all is of one.
    """

    nodes: Array
    tets: IntArray
    surface: IntArray
    basis: Any
    filling: Filling | None = None

    @property
    def surface_nodes(self) -> IntArray:
        """Nodes on the boundary, ascending."""
        return np.unique(self.surface)

    @property
    def volume(self) -> float:
        """[m^3]."""
        return float(self.basis.dx.sum())


def quadratic_mesh(points: Array, tets: IntArray) -> QuadraticMesh:
    """The ten-node tetrahedra of a linear mesh.

    Args:
        points: Corners [m], shape [n, 3], every one used.
        tets: Shape [m, 4], positive volumes.
    """
    from skfem import Basis, ElementTetP2, MeshTet

    mesh = MeshTet(np.ascontiguousarray(points.T, dtype=float), np.ascontiguousarray(tets.T, dtype=np.int64))
    # degree 4: products of two quadratic fields; this rule of scikit-fem is exact to rounding (tested)
    basis = Basis(mesh, ElementTetP2(), intorder=4)
    corners = boundary_triangles(tets)
    keys = corner_keys(mesh.edges.T)
    order = np.argsort(keys)
    sides = corner_keys(corners[:, [[0, 1], [1, 2], [2, 0]]])
    surface = np.hstack([corners, len(points) + order[np.searchsorted(keys, sides, sorter=order)]])
    return QuadraticMesh(
        nodes=np.ascontiguousarray(basis.doflocs.T),
        tets=basis.element_dofs.T.astype(np.int32),
        surface=surface.astype(np.int32),
        basis=basis,
    )


def quadratic_nodes(points: Array, tets: IntArray) -> int:
    """Number of nodes of the ten-node tetrahedra: corners and midpoints of edges."""
    edges = tets[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]]
    return len(points) + len(np.unique(corner_keys(edges)))
