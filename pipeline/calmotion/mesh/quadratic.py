"""Ten-node tetrahedra of a linear mesh, with scikit-fem's element, and elements of all kinds cut into tetrahedra."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.parts import Filling
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
    # a rule of one point: finer ones are made where they are used, since each holds megabytes
    basis = Basis(mesh, ElementTetP2(), intorder=1)
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


# Kind of meshio -> number of corners, which are the first nodes of all kinds.
CORNERS = {
    "tetra": 4, "tetra10": 4, "pyramid": 5, "pyramid13": 5, "wedge": 6, "wedge15": 6, "wedge18": 6,
    "hexahedron": 8, "hexahedron20": 8, "hexahedron24": 8, "hexahedron27": 8,
}  # fmt: skip
TRIANGLES = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}

# Faces by corners in the order of VTK; their orientation does not matter here.
_FACES: dict[int, list[list[int]]] = {
    5: [[0, 1, 2, 3], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
    6: [[0, 1, 2], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
    8: [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
}


def tets_of(kind: str, cells: np.ndarray) -> np.ndarray:
    """Tetrahedra of cells of one kind, shape [k, 4].

    The apex of all tetrahedra of a cell is its corner of lowest number. Their bases are the faces without this corner,
    each cut from its corner of lowest number. Two cells therefore cut their common face in the same way.

    Args:
        kind: One of `CORNERS`.
        cells: Node numbers, shape [m, nodes].

    Source: Dompierre, Labbe, Vallet and Camarero 1999, How to Subdivide Pyramids, Prisms and Hexahedra.
    """
    corners = cells[:, : CORNERS[kind]]
    if corners.shape[1] == 4:
        return corners
    faces = _FACES[corners.shape[1]]
    lowest = corners.argmin(axis=1)
    tets = []
    for apex in range(corners.shape[1]):
        cells_of_apex = corners[lowest == apex]
        for face in faces:
            if apex in face:
                continue
            for triangle in _cut(cells_of_apex[:, face]):
                tets.append(np.column_stack([triangle, cells_of_apex[:, apex]]))
    return np.vstack(tets)


def triangles_of(kind: str, cells: np.ndarray) -> np.ndarray:
    """Triangles of flat cells of one kind (of `TRIANGLES`), with the orientation of the cells, shape [k, 3]."""
    return np.vstack(_cut(cells[:, : TRIANGLES[kind]]))


def _cut(faces: np.ndarray) -> list[np.ndarray]:
    """Triangles of faces with three or four corners, quadrilaterals cut from their lowest corner."""
    if faces.shape[1] == 3:
        return [faces]
    first = faces.argmin(axis=1)
    rolled = np.take_along_axis(faces, (first[:, None] + np.arange(4)) % 4, axis=1)
    return [rolled[:, [0, 1, 2]], rolled[:, [0, 2, 3]]]
