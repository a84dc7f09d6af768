"""fTetWild in a separate process, because it may crash or not terminate."""

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
_TRIES = 3  # attempts at a mesh without flat elements
# Passes that improve the elements. With tens of thousands of surface triangles, more passes do not improve the smallest
# angles and take most of the time.
_PASSES, _DENSE_PASSES, _DENSE = 80, 12, 15_000


def tetrahedralize(
    points: np.ndarray, triangles: np.ndarray, element_size: float, envelope: float, path: str, time_limit: float,
    use_cache: bool,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Tetrahedra of a closed surface.

    fTetWild is not deterministic: the first mesh of a surface is stored and reused. A mesh with a flat element, which
    fTetWild sometimes makes, is made again.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
        element_size: Edge length [m].
        envelope: Largest distance to the surface, relative to the diagonal of the bounding box.
        path: Prim path, for errors.
        time_limit: [s].
        use_cache: Whether the cache folder is used.

    Returns:
        Points [m], shape [k, 3], and tetrahedra, shape [e, 4].

    Raises:
        ShotError: fTetWild crashed, exceeded the time limit, or made no tetrahedra.
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
    mesh = cache.load(key) if use_cache else None
    if mesh is None or flat_tets(*mesh).any():
        for _ in range(_TRIES):
            mesh = _run(points, triangles, element_size, envelope, passes, path, time_limit)
            if not flat_tets(*mesh).any():
                break
        assert mesh is not None
        if use_cache and not flat_tets(*mesh).any():
            mesh = cache.store(key, {"points": mesh[0], "tets": mesh[1]}, lambda kept: not flat_tets(*kept).any())
    return mesh[0], mesh[1]


def _run(
    points: np.ndarray, triangles: np.ndarray, element_size: float, envelope: float, passes: int, path: str,
    time_limit: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    # in units of the bounding box, about its center: the tolerances of fTetWild then fit any size
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
        # -P: the folder of the plugin must not precede the libraries on the path
        worker = Path(__file__).with_name("tetwild_worker.py")
        command = [sys.executable, "-P", str(worker), str(source), str(destination)]
        try:
            # fTetWild writes a file into its working folder
            done = subprocess.run(
                command, capture_output=True, timeout=time_limit, stdin=subprocess.DEVNULL, cwd=folder
            )
        except subprocess.TimeoutExpired:
            raise ShotError(
                "tetrahedralising exceeded the time limit", path=path,
                found=f"{len(triangles)} triangles, {time_limit:g} s",
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
