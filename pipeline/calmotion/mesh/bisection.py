"""Local refinement of tetrahedra by longest-edge bisection."""

from __future__ import annotations

import logging
import threading

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.tetrahedra import tet_volumes

_ONE = threading.Lock()


def bisected(points: Array, tets: IntArray, marked: IntArray) -> tuple[Array, IntArray]:
    """Tetrahedra of which the marked ones are smaller; neighbours are bisected as far as they have to be.

    The boundary stays where it is.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], positive volumes.
        marked: Indices of tetrahedra.

    Returns:
        Points, of which the first n are the given ones, and tetrahedra with positive volumes.

    Source: Rivara 1984, Mesh Refinement Processes Based on the Generalized Bisection of Simplices; by scikit-fem.
    """
    from skfem import MeshTet

    log = logging.getLogger("skfem")
    with _ONE:  # threads share the logger
        level = log.level
        log.setLevel(logging.ERROR)  # it warns about the memory layout of arrays that it makes itself
        try:
            mesh = MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tets.T, dtype=np.int64))
            finer = mesh.refined(np.ascontiguousarray(marked))
        finally:
            log.setLevel(level)
    new, split = np.ascontiguousarray(finer.p.T), np.ascontiguousarray(finer.t.T).astype(np.int32)
    flipped = tet_volumes(new, split) < 0.0
    split[flipped] = split[flipped][:, [1, 0, 2, 3]]
    return new, split
