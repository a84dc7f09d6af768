"""Subdivision of elements of all kinds into tetrahedra and triangles."""

from __future__ import annotations

import numpy as np

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
