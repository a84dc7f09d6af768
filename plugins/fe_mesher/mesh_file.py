"""External meshes, read with meshio."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from calmotion.errors import ShotError
from calmotion.shot import SurfaceMesh, TetGeometry


def read_mesh_file(path: str, scale: float, body: str) -> TetGeometry | tuple[SurfaceMesh, ...]:
    """The tetrahedra of a mesh file, or its surface where it has none.

    Args:
        path: File; quadratic elements give their corners.
        scale: Metres per unit of the file.
        body: Prim path of the body, for errors.

    Raises:
        ShotError: The file is missing, cannot be read, or has neither tetrahedra nor triangles.
    """
    import meshio

    def refuse(problem: str, found: object, remedy: str) -> ShotError:
        return ShotError(problem, path=body, attribute="calm:flexible:meshFile", found=found, remedy=remedy)

    if not Path(path).is_file():
        raise refuse("the mesh file does not exist", path, "Correct the asset path")
    try:
        # meshio takes .msh for ANSYS first; everybody else means Gmsh
        mesh = meshio.read(path, file_format="gmsh" if path.lower().endswith(".msh") else None)
    except (Exception, SystemExit) as error:  # meshio ends the process on a format it does not know
        raise refuse("the mesh file cannot be read", f"{path}: {error}", "Use a format that meshio reads") from error
    points = np.asarray(mesh.points, dtype=float) * scale
    if points.shape[1] != 3:
        raise refuse("the mesh file is not three-dimensional", path, "Give a volume mesh or a closed surface")
    tets = [block.data[:, :4] for block in mesh.cells if block.type in ("tetra", "tetra10")]
    if tets:
        return TetGeometry(path, points, np.vstack(tets).astype(np.int32))
    faces = [block.data[:, :3] for block in mesh.cells if block.type in ("triangle", "triangle6")]
    for block in mesh.cells:
        if block.type in ("quad", "quad8", "quad9"):
            faces += [block.data[:, [0, 1, 2]], block.data[:, [0, 2, 3]]]
    if not faces:
        kinds = ", ".join(sorted({block.type for block in mesh.cells})) or "nothing"
        raise refuse("the mesh file has neither tetrahedra nor triangles", kinds, "Give tetrahedra or a closed surface")
    return (SurfaceMesh(path, points, np.vstack(faces).astype(np.int32)),)
