"""Mode shapes as files: `.vtu`, `.png` and `modes.csv`."""

import csv
import io
import itertools
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from calmotion.arrays import box_diagonal
from calmotion.errors import file_access
from calmotion.model import Body
from calmotion.reduction import LinearModes, inertia_integrals, modal_damping
from calmotion.support import replaced, write_text

from .picture import draw_modes

SHOWN = 0.1  # largest displacement of a mode in the files, of the size of the body
COLUMNS = ("body", "mode", "frequency_hz", "damping_ratio", "mass_x_kg", "mass_y_kg", "mass_z_kg", "mass_kg")
Progress = Callable[[float, str], None]


def write_modes(
    folder: str, modes: Iterable[tuple[Body, LinearModes]], *, total: int, dpi: int = 150, pictures: int = 8,
    progress: Progress = lambda fraction, message: None,
) -> list[str]:  # fmt: skip
    """Write the modes of each body.

    Args:
        folder: Folder of the files; it is created where it does not exist.
        modes: Bodies with their linear modes; each is computed after the previous one is written.
        total: Number of bodies, for the progress.
        dpi: Of the pictures, dots per inch.
        pictures: Largest number of modes in the picture of a body.
        progress: Called with a fraction in 0..1 and a message.

    Returns:
        Paths of the files: `<body>.vtu` (quadratic tetrahedra in metres, and a vector field for each mode, scaled to a
        largest displacement of a tenth of the size of the body), `<body>.png`, and `modes.csv` (effective masses for
        excitation of the root along the axes of the body frame, damping of the single body without loads).

    Raises:
        ShotError: The folder cannot be written, or a body cannot be reduced.
    """
    target = Path(folder)
    written: list[str] = []
    rows: list[tuple[object, ...]] = []
    used: set[str] = set()
    with file_access("the mode shapes cannot be written", folder, "Choose another --modes."):
        target.mkdir(parents=True, exist_ok=True)
        for k, (body, linear) in enumerate(modes):
            progress(k / total, body.path)
            name = _file_name(body.path, used)
            shapes = scaled_modes(linear)
            frequencies = np.sqrt(np.maximum(linear.basis.omega_squared, 0.0)) / (2.0 * np.pi)
            path = target / f"{name}.vtu"
            write_vtu(path, linear, shapes)
            written.append(str(path))
            if len(frequencies):
                picture = target / f"{name}.png"
                draw_modes(picture, body.path, linear.model.mesh, shapes[:, :, :pictures], frequencies, dpi)
                written.append(str(picture))
            rows += table_rows(body, linear, frequencies)
        table = target / "modes.csv"
        text = io.StringIO(newline="")
        csv.writer(text).writerows([COLUMNS, *rows])
        write_text(table, text.getvalue())
        written.append(str(table))
    return written


def _file_name(path: str, used: set[str]) -> str:
    """A name for the files of a body that no other has, also where capitals make no difference.

    Args:
        path: Of the body.
        used: Names of others, in small letters; that of this body is added.
    """
    parts = path.strip("/").split("/")
    short = ("_".join(parts[-count:]) for count in range(1, len(parts) + 1))
    numbered = (f"{'_'.join(parts)}_{number}" for number in itertools.count(2))
    name = next(name for name in itertools.chain(short, numbered) if name.casefold() not in used)
    used.add(name.casefold())
    return name


def scaled_modes(linear: LinearModes) -> np.ndarray:
    """Modes scaled to a largest displacement of a tenth of the size of the body [m], shape [n, 3, r]."""
    modes = linear.basis.modes
    size = box_diagonal(linear.model.mesh.nodes)
    largest = np.linalg.norm(modes, axis=1).max(axis=0, initial=0.0)
    return modes * (SHOWN * size / np.where(largest > 0.0, largest, 1.0))


def write_vtu(path: Path, linear: LinearModes, shapes: np.ndarray) -> None:
    """Write one body; the nodes of a quadratic tetrahedron are in the order of VTK already."""
    import meshio

    mesh = linear.model.mesh
    fields = {f"mode_{k + 1:02d}": np.ascontiguousarray(shapes[:, :, k]) for k in range(shapes.shape[2])}
    with replaced(path) as temporary:
        meshio.Mesh(mesh.nodes, [("tetra10", mesh.tets)], point_data=fields).write(temporary)


def table_rows(body: Body, linear: LinearModes, frequencies: np.ndarray) -> list[tuple[object, ...]]:
    """Rows of `modes.csv`."""
    assert body.flexible is not None
    omega = 2.0 * np.pi * frequencies
    damping = modal_damping(linear.basis.omega_squared, body.flexible.material)
    integrals = inertia_integrals(linear.model.mesh.nodes, linear.model.mass, linear.basis.modes)
    effective = integrals.M3**2  # of mass-orthonormal modes
    return [
        (body.path, k + 1, f"{frequencies[k]:.6g}", f"{damping[k] / (2.0 * omega[k]):.6g}")
        + tuple(f"{value:.6g}" for value in effective[k])
        + (f"{integrals.mass:.6g}",)
        for k in range(len(frequencies))
    ]
