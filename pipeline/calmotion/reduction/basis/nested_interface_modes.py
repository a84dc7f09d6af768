"""Fixed-interface modes of a mesh from those of a coarser one that it is bisected from.

Modes of two such meshes differ by as much as the error of the coarser one, a few percent of energy. One step of inverse
iteration takes away all of that but what decides nothing: it costs the solves for as many columns as there are modes, a
third to a fifth of Lanczos' method from the start.

Source: Bathe, Finite Element Procedures, 11.6 (subspace iteration).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from calmotion.geometry.tetrahedra import Indices
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.reduction.elements.assembly import QuadraticMesh
from calmotion.reduction.elements.nesting import prolongation
from calmotion.shot.character import Array


@dataclass(frozen=True, eq=False)
class CoarserModes:
    """Modes of a coarser mesh.

    Attributes:
        mesh: That.
        interior: Degrees of freedom of its nodes in no patch, shape [i].
        normal: By the squared frequency up to which they were asked for: omega^2 [1/s^2] and modes, shape [i, k].
    """

    mesh: QuadraticMesh
    interior: Indices
    normal: Mapping[float, tuple[Array, Array]]

    def on(
        self, mesh: QuadraticMesh, interior: Indices, M: Any, solver: SparseSolver, bound: float
    ) -> tuple[Array, Array] | None:
        """As many modes of a finer mesh; None if it is not bisected from the coarser one, or nothing was asked for.

        Args:
            mesh, interior: Finer mesh.
            M: Mass of the interior, sparse, shape [j, j].
            solver: Of its stiffness.
            bound: Squared frequency [1/s^2].

        Returns:
            omega^2 [1/s^2], ascending, and M-orthonormal modes, shape [j, k].
        """
        known = self.normal.get(bound)
        nested = None if known is None else prolongation(self.mesh, mesh)
        if known is None or nested is None:
            return None
        count, coarse = known[1].shape[1], len(self.mesh.nodes)
        modes = np.zeros((3 * coarse, count))
        modes[self.interior] = known[1]
        start = (nested[0] @ modes.reshape(coarse, -1)).reshape(-1, count)[interior]
        return improved(M, solver, start)


def improved(M: Any, solver: SparseSolver, start: Array) -> tuple[Array, Array]:
    """Eigenpairs by one step of inverse iteration.

    Args:
        M: Mass, sparse, shape [n, n].
        solver: Of the stiffness.
        start: Approximate lowest modes, shape [n, k].

    Returns:
        omega^2 [1/s^2], ascending, shape [k], and M-orthonormal modes, shape [n, k].
    """
    from scipy.linalg import eigh

    load = M @ start
    moved = solver.solve(load)
    values, combined = eigh(moved.T @ load, moved.T @ (M @ moved))  # the stiffness of what moved is the load
    return values, moved @ combined
