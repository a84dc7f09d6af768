"""Reading of external meshes with meshio."""

from pathlib import Path
from typing import Any

import numpy as np

from calmotion.errors import ShotError
from calmotion.mesh.quadratic import CORNERS, TRIANGLES, tets_of, triangles_of
from calmotion.model import SurfaceMesh, TetGeometry
from calmotion.support.foreign_files import refuse_lfs_pointers
from calmotion.support.memory import too_large

_EXPANSION = 10.0  # memory of a mesh while it is read, by the size of a binary file
_CURVED = 1e-3  # distance of a midpoint from the center of its edge that is reported, of the edge


def read_mesh_file(path: str, scale: float, body: str) -> tuple[TetGeometry | tuple[SurfaceMesh, ...], tuple[str, ...]]:
    """The tetrahedra of a mesh file, or its surface where it has no volume elements, and messages about changes.

    Hexahedra, wedges and pyramids are cut into tetrahedra. Only the corners of quadratic elements are used; midpoints
    are computed later.

    Args:
        path: File in any format that meshio reads (Gmsh, VTK, Abaqus, Nastran, STL, OBJ, PLY, ...).
        scale: Metres per unit of the file.
        body: Prim path of the body, for errors.

    Raises:
        ShotError: The file is missing, cannot be read, is a pointer of Git LFS, or has neither volume elements nor
            faces.
    """

    def refuse(problem: str, found: object, remedy: str) -> ShotError:
        return ShotError(problem, path=body, attribute="calm:flexible:meshFile", found=found, remedy=remedy)

    if not Path(path).is_file():
        raise refuse("the mesh file does not exist", path, "Correct the asset path")
    refuse_lfs_pointers([path], path=body, attribute="calm:flexible:meshFile")
    if reason := too_large(path, _EXPANSION):
        raise refuse("the mesh file is too large for the memory", f"{path}: {reason}", "Give a coarser mesh")
    try:
        mesh = _read(path)
        points = np.asarray(mesh.points, dtype=float) * scale
        cells = [(block.type, np.asarray(block.data, dtype=np.int64)) for block in mesh.cells]
        cells = [(kind, data) for kind, data in cells if data.size]  # a face of no corners is none
    except (Exception, SystemExit) as error:  # meshio exits the process on an unknown format
        raise refuse("the mesh file cannot be read", f"{path}: {error}", "Use a format that meshio reads") from error
    if points.ndim != 2 or points.shape[1] != 3:
        raise refuse("the mesh file is not three-dimensional", path, "Give a volume mesh or a closed surface")
    for kind, data in cells:
        if data.min() < 0 or data.max() >= len(points):
            worst = int(data.min()) if data.min() < 0 else int(data.max())
            raise refuse(
                f"an element of the mesh file ({kind}) refers to a node that does not exist", worst, "Repair it"
            )
    volume = [(kind, data) for kind, data in cells if kind in CORNERS]
    if volume:
        tets = np.vstack([tets_of(kind, data) for kind, data in volume])
        if not np.isfinite(points[tets]).all():
            raise refuse("a node of the mesh file is not finite", path, "Repair the file")
        return TetGeometry(path, points, tets.astype(np.int32)), _changes(volume, points, path)
    faces = [(kind, data) for kind, data in cells if kind in TRIANGLES]
    if not faces:
        kinds = ", ".join(sorted({kind for kind, _ in cells})) or "nothing"
        raise refuse("the mesh file has neither volume elements nor faces", kinds, "Give tetrahedra or a surface")
    triangles = np.vstack([triangles_of(kind, data) for kind, data in faces])
    return (SurfaceMesh(path, points, triangles.astype(np.int32)),), ()


def _read(path: str) -> Any:
    import meshio

    # meshio tries ANSYS first for .msh, which is the suffix of Gmsh files
    return meshio.read(path, file_format="gmsh" if path.lower().endswith(".msh") else None)


def _changes(volume: list[tuple[str, np.ndarray]], points: np.ndarray, path: str) -> tuple[str, ...]:
    """Messages about the conversion of the elements of a file to linear tetrahedra."""
    messages = []
    for kind, data in volume:
        if not kind.startswith("tetra"):
            messages.append(f"{path}: cut {len(data)} elements of type {kind} into tetrahedra")
        if kind == "tetra10":
            # meshio has the order of VTK for midpoints: edges 01, 12, 20, 03, 13, 23
            ends = points[data[:, [0, 1, 2, 0, 1, 2]]], points[data[:, [1, 2, 0, 3, 3, 3]]]
            away = np.linalg.norm(points[data[:, 4:]] - 0.5 * (ends[0] + ends[1]), axis=-1)
            curved = int((away > _CURVED * np.linalg.norm(ends[1] - ends[0], axis=-1)).any(axis=1).sum())
            if curved:
                messages.append(f"{path}: straightened the edges of {curved} curved tetrahedra")
    return tuple(messages)
