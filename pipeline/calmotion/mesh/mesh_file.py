"""Reading of external meshes with meshio."""

import io
import re
from contextlib import redirect_stderr, redirect_stdout
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
# what decks of Abaqus say that meshio passes over, so that nodes would be elsewhere or missing
_PARTS = re.compile(r"^\*part\b", re.IGNORECASE | re.MULTILINE)
_MOVED = re.compile(r"^\*instance\b.*\n(?=[^*\n]*\d)", re.IGNORECASE | re.MULTILINE)
_GENERATED = re.compile(r"^\*(?:ngen|nfill|ncopy|elgen|elcopy|system\b|node\b.*system *= *[cs])", re.I | re.MULTILINE)
_NASTRAN = (".bdf", ".nas", ".fem")
_REMEDY = "Export the part alone, in its place and in Cartesian coordinates, as .vtu, .msh or .inp"


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
    if lost := _passed_over(path):
        raise refuse(lost[0], f"{path}: {lost[1]}", _REMEDY)
    try:
        mesh = _read(path)
        points = np.asarray(mesh.points, dtype=float) * scale
        cells = [(block.type, np.asarray(block.data, dtype=np.int64)) for block in mesh.cells]
        cells = [(kind, data) for kind, data in cells if data.size]  # a face of no corners is none
    except Exception as error:
        raise refuse("the mesh file cannot be read", f"{path}: {error}", _remedy(path, error)) from error
    if len(points) == 0:
        raise refuse("the mesh file has no nodes", path, "Give a volume mesh or a closed surface")
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
        once = np.sort(np.unique(np.sort(tets, axis=1), axis=0, return_index=True)[1])
        twice = (f"{path}: counted {len(tets) - len(once)} elements that are there twice once",)
        changes = _changes(volume, points, path) + twice * (len(once) < len(tets))
        return TetGeometry(path, points, tets[once].astype(np.int32)), changes
    faces = [(kind, data) for kind, data in cells if kind in TRIANGLES]
    if not faces:
        kinds = ", ".join(sorted({kind for kind, _ in cells})) or "nothing"
        raise refuse("the mesh file has neither volume elements nor faces", kinds, "Give tetrahedra or a surface")
    triangles = np.vstack([triangles_of(kind, data) for kind, data in faces])
    return (SurfaceMesh(path, points, triangles.astype(np.int32)),), ()


def _read(path: str) -> Any:
    """What meshio reads.

    Raises:
        Exception: Any, with what meshio says; else it prints that and exits the process.
    """
    import meshio

    # meshio tries ANSYS first for .msh, which is the suffix of Gmsh files
    with open(path, "rb") as file:
        gmsh = path.lower().endswith(".msh") and file.read(1) != b"("
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            return meshio.read(path, file_format="gmsh" if gmsh else None)
    except SystemExit:
        raise ValueError(" ".join(said.getvalue().split())) from None


def _remedy(path: str, error: Exception) -> str:
    """What to do about a file that meshio does not read."""
    import meshio

    if isinstance(error, ModuleNotFoundError):
        return f"Install {error.name} (pip install {error.name}), or export the mesh as .vtu or .msh"
    suffix = Path(path).suffix.lower()
    if suffix not in meshio.extension_to_filetypes:
        return (
            f"meshio reads no {suffix or 'file without a suffix'}; mesh a CAD file (.step, .iges, .geo) first, and "
            "export the mesh as .msh, .vtu, .inp or .bdf"
        )
    return "It is cut off, damaged, or of a version that meshio does not know: export it again, as .msh 4.1 or .vtu"


def _passed_over(path: str) -> tuple[str, str] | None:
    """What of a deck of Abaqus or Nastran meshio passes over without a word: the problem, and where; or None."""
    suffix = Path(path).suffix.lower()
    if suffix == ".inp":
        text = Path(path).read_text(encoding="utf-8", errors="replace")
        if (count := len(_PARTS.findall(text))) > 1:
            return "the deck has several parts, whose nodes have the same numbers", f"{count} times *PART"
        if match := _MOVED.search(text):
            return "the deck moves its part, which is not read", match.group().strip()
        if match := _GENERATED.search(text):
            return "the deck generates or transforms nodes or elements, which is not read", match.group().strip()
    if suffix in _NASTRAN:
        with open(path, encoding="utf-8", errors="replace") as lines:
            for line in lines:
                if line[:4].upper() == "GRID" and _system(line) not in ("", "0"):
                    return "nodes are in coordinate systems of their own, which are not read", line.strip()[:60]
    return None


def _system(grid: str) -> str:
    """The coordinate system of a GRID card of Nastran: its third field."""
    if "," in grid:
        return (*grid.split(","), "", "")[2].strip()
    return (grid[24:40] if grid[4:8].strip() == "*" else grid[16:24]).strip()


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
