"""fTetWild in a process of its own: it may crash or take forever, and then only that process is lost."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import numpy as np
from calmotion.errors import ShotError
from calmotion.geometry.tetrahedra import flat_tets

from . import cache

_REMEDY = "Simplify or repair the Mesh, author a larger calm:flexible:elementSize, or give a TetMesh or a mesh file"
_STOP_ENERGY = 10.0
_TRIES = 3  # to get a mesh without flat elements
# Passes that improve the elements. Where tens of thousands of triangles decide what there is to mesh, a few angles stay
# below a degree however many passes there are, and passes are all that the time goes to.
_PASSES, _DENSE_PASSES, _DENSE = 80, 12, 15_000


def tetrahedralize(
    points: np.ndarray, triangles: np.ndarray, element_size: float, envelope: float, path: str, time_limit: float,
    use_cache: bool,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Tetrahedra of a closed surface.

    fTetWild is not deterministic, so the first mesh of a surface is kept and used ever after; where it has an element
    without volume, as happens now and then, it is made again.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
        element_size: Edge length [m].
        envelope: Largest distance to the surface, as a part of the bounding box's diagonal.
        path: Prim path, for errors.
        time_limit: [s].
        use_cache: Whether the user's cache folder is read and written.

    Returns:
        Points [m], shape [k, 3], and tetrahedra, shape [e, 4].

    Raises:
        ShotError: It crashed, took too long, or made nothing.
    """
    passes = _DENSE_PASSES if len(triangles) > _DENSE else _PASSES
    settings: dict[str, object] = {
        "element_size": element_size,
        "envelope": envelope,
        "stop_energy": _STOP_ENERGY,
        "coarsen": True,
        "passes": passes,
        "pytetwild": version("pytetwild"),
    }
    key = cache.cache_key(points, triangles, settings)
    found = cache.load(key) if use_cache else None
    if found is None or flat_tets(*found).any():
        for _ in range(_TRIES):
            found = _run(points, triangles, element_size, envelope, passes, path, time_limit)
            if not flat_tets(*found).any():
                break
        assert found is not None
        if use_cache and not flat_tets(*found).any():
            found = cache.store(key, {"points": found[0], "tets": found[1]}, lambda kept: not flat_tets(*kept).any())
    return found[0], found[1]


def _run(
    points: np.ndarray, triangles: np.ndarray, element_size: float, envelope: float, passes: int, path: str,
    time_limit: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    # in units of the bounding box, about its centre: fTetWild's own tolerances then suit any robot
    low, high = points.min(axis=0), points.max(axis=0)
    center, diagonal = 0.5 * (low + high), float(np.linalg.norm(high - low))
    with tempfile.TemporaryDirectory(prefix="calmotion-") as folder:
        source, destination = Path(folder) / "surface.npz", Path(folder) / "tetrahedra.npz"
        np.savez(
            source,
            points=np.ascontiguousarray((points - center) / diagonal, dtype=np.float64),
            triangles=np.ascontiguousarray(triangles, dtype=np.int32),
            element_size=element_size / diagonal,
            envelope=envelope,
            stop_energy=_STOP_ENERGY,
            passes=passes,
        )
        # -P: the plugin's folder must not stand before the libraries on the path
        worker = Path(__file__).with_name("tetwild_worker.py")
        command = [sys.executable, "-P", str(worker), str(source), str(destination)]
        try:
            # the tetrahedraliser leaves a file in the folder it runs in
            done = subprocess.run(
                command, capture_output=True, timeout=time_limit, stdin=subprocess.DEVNULL, cwd=folder
            )
        except subprocess.TimeoutExpired:
            raise ShotError(
                "tetrahedralising took too long", path=path, found=f"{len(triangles)} triangles, {time_limit:g} s",
                remedy=_REMEDY + ", or allow more with --set fe.mesh.time_limit=",
            ) from None  # fmt: skip
        if done.returncode != 0 or not destination.is_file():
            last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no message"]
            raise ShotError(
                "the tetrahedraliser failed",
                path=path, found=f"exit status {done.returncode}: {last[0]}", remedy=_REMEDY,
            )  # fmt: skip
        with np.load(destination) as file:
            made, tets = file["points"] * diagonal + center, file["tets"]
    if len(tets) == 0:
        raise ShotError("the surface encloses no volume", path=path, found="no tetrahedra", remedy=_REMEDY)
    return made, tets
