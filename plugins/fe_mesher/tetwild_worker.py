"""Process of `tetwild.py`: surface.npz -> tetrahedra.npz."""

from __future__ import annotations

import importlib.util
import sys
import time
import types

import numpy as np


def main(source: str, destination: str) -> None:
    """Tetrahedralise the surface of the source file, and write the destination file."""
    # pytetwild 0.4 imports PyVista (and with it VTK) in its package's __init__ only to add a method to PyVista's
    # classes. A package without that __init__ gives the same compiled module and needs NumPy alone.
    spec = importlib.util.find_spec("pytetwild")
    if spec is None or spec.submodule_search_locations is None:
        raise SystemExit("pytetwild is not installed")
    package = types.ModuleType("pytetwild")
    package.__path__ = list(spec.submodule_search_locations)
    sys.modules["pytetwild"] = package
    from pytetwild.pytetwild import tetrahedralize

    with np.load(source) as file:
        points, tets = tetrahedralize(
            np.ascontiguousarray(file["points"]),
            np.ascontiguousarray(file["triangles"]),
            edge_length_abs=float(file["element_size"]),
            epsilon=float(file["envelope"]),
            stop_energy=float(file["stop_energy"]),
            num_opt_iter=int(file["passes"]),
            # up to the element size: a third of the elements, with the same volume error and better angles
            coarsen=True,
            vtk_ordering=True,
            num_threads=1,
        )
    tets = np.ascontiguousarray(tets, dtype=np.int32)
    np.savez(destination, points=points, tets=tets, seconds=time.process_time())


if __name__ == "__main__":
    main(*sys.argv[1:])
