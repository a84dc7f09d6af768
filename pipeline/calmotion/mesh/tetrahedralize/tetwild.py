"""fTetWild in a separate process, because it may crash or not terminate."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.errors import ShotError
from calmotion.mesh.tetrahedra import flat_tets, surface_volume
from calmotion.support.caching.cache_folder import MESHES
from calmotion.support.caching.caches import key_of, store_arrays, stored_arrays
from calmotion.support.files import temporary_folder
from calmotion.support.operating_system import TimeExceeded, run_limited

REMEDY = "Simplify or repair the Mesh, author a larger calm:flexible:elementSize, or give a TetMesh or a mesh file"
MORE_TIME = ", or allow more with --set fe.mesh.time_limit={:.0f}"
_TRIES = 3  # attempts at a mesh without flat elements
# Number of passes that improve the elements, and the energy of the worst element at which they end: of dense surfaces,
# of others of more than a few triangles, of large volumes, and of the rest. More passes take up to three quarters of
# the time and change frequencies by less than the error of the mesh. What worse elements cost is part of that error.
_QUICKEST, _QUICK, _LARGE, _NORMAL = (5, 50.0), (5, 30.0), (80, 20.0), (80, 10.0)
_CUBES = 1_000.0  # elements in a large volume
# Default limit of the processor time of a body [s]: three times the 20 s that a link may take on a fast machine, since
# slow and busy machines shall make the same meshes
TIME_LIMIT = 60.0
SIMPLE = 600  # triangles; below, the surface is that of a box or a tube: following it closely costs a second
DENSE = 2_500  # triangles to which surfaces are simplified where that takes away small details alone
# A process that takes no processor time, such as one that is blocked, ends after this many times its limit.
_PATIENCE = 100.0
# Processor time of a node [s]: three quarters of that measured with 4,000 to 130,000 nodes
_SECONDS = 2.1e-4


class OutOfTime(ShotError):
    """A mesh exceeded the limit of processor time."""


@dataclass
class ProcessorTime:
    """Processor time of fTetWild for one body. Unlike elapsed time it does not depend on what else a machine does.

    Attributes:
        limit: Allowed [s].
        used: So far [s].
    """

    limit: float
    used: float = 0.0

    def part(self, share: float) -> ProcessorTime:
        """The first part of what is left of it."""
        return ProcessorTime(self.used + share * (self.limit - self.used), self.used)

    @property
    def nodes(self) -> float:
        """Number of nodes of ten-node tetrahedra that the limit allows on any machine."""
        return self.limit / _SECONDS


def tetrahedralize(
    points: np.ndarray, triangles: np.ndarray, element_size: float, envelope: float, path: str, time: ProcessorTime,
    use_cache: bool,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Tetrahedra of a closed surface.

    A surface has one mesh, since fTetWild draws from a fixed sequence. Where it makes a flat element, the mesh is made
    again with another sequence.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
        element_size: Edge length [m].
        envelope: Largest distance to the surface, relative to the diagonal of the bounding box.
        path: Prim path, for errors.
        time: Of the body; increased by that of the mesh.
        use_cache: Whether the cache folder is used.

    Returns:
        Points [m], shape [k, 3], and tetrahedra, shape [e, 4].

    Raises:
        OutOfTime: It exceeded the limit of processor time.
        ShotError: fTetWild crashed, or made no tetrahedra.
    """
    passes, stop_energy = _improvement(points, triangles, element_size)
    settings: dict[str, Any] = {
        "element_size": element_size,
        "envelope": envelope,
        "stop_energy": stop_energy,
        "coarsen": True,
        "passes": passes,
        "sequence": 1,
        "pytetwild": version("pytetwild"),
    }
    key = key_of(points, triangles, settings)
    exceeded = key_of(points, triangles, settings, "exceeds")
    if use_cache:
        _refuse_hopeless(exceeded, f"{len(triangles)} triangles", path, time)
    mesh = _stored(key, "points", "tets") if use_cache else None
    if mesh is None or flat_tets(*mesh).any():
        for sequence in range(1, 1 + _TRIES):
            settings["sequence"] = sequence
            try:
                made, tets = _run(points, triangles, settings, path, time)
            except OutOfTime:
                if use_cache:
                    _keep_hopeless(exceeded, time.limit - time.used)
                raise
            mesh = made, tets
            if not flat_tets(*mesh).any():
                break
        assert mesh is not None
        if use_cache and not flat_tets(*mesh).any():
            store_arrays(MESHES, key, {"points": mesh[0], "tets": mesh[1]})
    return mesh[0], mesh[1]


def _stored(key: str, *names: str) -> tuple[np.ndarray, ...] | None:
    arrays = stored_arrays(MESHES, key)
    return None if arrays is None or set(names) - set(arrays) else tuple(arrays[name] for name in names)


def _improvement(points: np.ndarray, triangles: np.ndarray, element_size: float) -> tuple[int, float]:
    """Number of passes that improve the elements, and the energy of the worst one at which they end."""
    if len(triangles) > SIMPLE:
        return _QUICK if len(triangles) <= DENSE else _QUICKEST
    return _LARGE if surface_volume(points, triangles) > _CUBES * element_size**3 else _NORMAL


def _refuse_hopeless(key: str, size: str, path: str, time: ProcessorTime) -> None:
    """Refuse a mesh that has already taken as much time as there is: every shot of a robot would try it again."""
    taken = _stored(key, "seconds")
    if taken is not None and taken[0].shape == () and float(taken[0]) >= time.limit - time.used:
        raise _out_of_time(size, path, time)


def _keep_hopeless(key: str, taken: float) -> None:
    """Store that a mesh takes longer than a time [s]."""
    kept = _stored(key, "seconds")
    if kept is None or kept[0].shape != () or float(kept[0]) < taken:
        store_arrays(MESHES, key, {"seconds": np.array(taken)})


def _out_of_time(size: str, path: str, time: ProcessorTime) -> OutOfTime:
    return OutOfTime(
        "tetrahedralising exceeded the limit of processor time",
        path=path,
        found=f"{size}, {time.limit:g} s",
        remedy=REMEDY + MORE_TIME.format(4.0 * time.limit),
    )


def _run(
    points: np.ndarray, triangles: np.ndarray, settings: dict[str, Any], path: str, time: ProcessorTime
) -> tuple[np.ndarray, np.ndarray]:
    # in units of the bounding box, about its center: the tolerances of fTetWild then fit any size
    low, high = points.min(axis=0), points.max(axis=0)
    center, diagonal = 0.5 * (low + high), float(np.linalg.norm(high - low))
    with temporary_folder() as folder:
        source, destination = folder / "surface.npz", folder / "tetrahedra.npz"
        np.savez(
            source,
            points=np.ascontiguousarray((points - center) / diagonal, dtype=np.float64),
            triangles=np.ascontiguousarray(triangles, dtype=np.int32),
            element_size=settings["element_size"] / diagonal,
            **{name: settings[name] for name in ("envelope", "stop_energy", "passes", "sequence")},
        )
        # -P: the folder of the plugin must not precede the libraries on the path
        worker = Path(__file__).with_name("tetwild_worker.py")
        command = [sys.executable, "-P", str(worker), str(source), str(destination)]
        status, messages = _limited(command, folder, time, f"{len(triangles)} triangles", path)
        if status != 0 or not destination.is_file():
            last = messages.decode(errors="replace").strip().splitlines()[-1:] or ["no message"]
            raise ShotError(
                "the tetrahedraliser failed",
                path=path,
                found=f"exit status {status}: {last[0]}",
                remedy=REMEDY,
            )
        with np.load(destination) as file:
            made, tets = file["points"] * diagonal + center, file["tets"]
            time.used += float(file["seconds"])
    if len(tets) == 0:
        raise ShotError("the surface encloses no volume", path=path, found="no tetrahedra", remedy=REMEDY)
    return made, tets


def _limited(command: list[str], folder: Path, time: ProcessorTime, size: str, path: str) -> tuple[int, bytes]:
    """Exit status and standard error of a process with what is left of the processor time.

    Args:
        folder: Its working folder; fTetWild writes a file into it.
        size: Of the surface, for errors.
        path: Prim path of the body.
    """
    left = max(time.limit - time.used, 1.0)
    try:
        return run_limited(command, folder, left, _PATIENCE * left)
    except TimeExceeded as error:
        if error.processor:
            raise _out_of_time(size, path, time) from None
        raise ShotError(
            "the tetrahedraliser does not end",
            path=path,
            found=f"{size}, {_PATIENCE * left:g} s without using {left:.0f} s of processor time",
            remedy=REMEDY,
        ) from None
