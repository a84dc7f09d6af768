"""Modes of a clamped body on ever finer meshes, each begun from those of the mesh before.

The first mesh is factorised. Bisected meshes contain the coarser ones, so that a multigrid cycle over all of them
replaces factors: with 35,000 nodes it takes 2 s in place of 7.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.linear_algebra.multifrontal import expand
from calmotion.linear_algebra.multigrid import WIDTH
from calmotion.linear_algebra.preconditioned_modes import improved_modes
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.reduction.basis.natural_modes import lowest_modes, vector_mass
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.nested_meshes import NestedMeshes

_FEW = 300  # free nodes of meshes that are factorised each by itself


class NestedModes:
    """Lowest modes of ever finer meshes of a clamped body."""

    def __init__(self) -> None:
        self._meshes: NestedMeshes | None = None
        self._last: tuple[BoolArray, Array] | None = None  # free nodes of the last mesh, and its modes, [3 free, WIDTH]

    def lowest(self, model: FEModel, count: int, clamped: IntArray, accuracy: float) -> tuple[Array, Array]:
        """Lowest frequencies and modes; quickest where the mesh is that of the last call, bisected.

        Args:
            model: Matrices of a mesh.
            count: Number of modes, less than `WIDTH`.
            clamped: Clamped nodes, at least one.
            accuracy: Relative error of the squares of the frequencies: about that.

        Returns:
            Frequencies [Hz], shape [count], and modes, shape [n, 3, count].
        """
        n = len(model.mesh.nodes)
        free = np.ones(n, dtype=bool)
        free[clamped] = False
        dofs = np.flatnonzero(np.repeat(free, 3))
        K, m = model.stiffness[dofs][:, dofs], model.mass[free][:, free]
        found = self._finer(model.mesh, free, K, m, count, accuracy) or self._factorised(model.mesh, free, K, m)
        values, vectors = found[0][:count], found[1][:, :count]
        modes = np.zeros((3 * n, vectors.shape[1]))
        modes[dofs] = vectors
        return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi), modes.reshape(n, 3, -1)

    def _factorised(self, mesh: QuadraticMesh, free: BoolArray, K: Any, m: Any) -> tuple[Array, Array]:
        """The modes by factors of the matrix, which is the coarsest of the meshes that follow."""
        self._meshes, self._last = None, None
        count = min(WIDTH, K.shape[0])
        if m.shape[0] < _FEW:
            return lowest_modes(K, vector_mass(m), count)
        coarsest = SparseSolver(K, mesh.nodes[free])
        found = lowest_modes(K, vector_mass(m), count, solver=coarsest)
        self._meshes, self._last = NestedMeshes(mesh, free, coarsest), (free, found[1])
        return found

    def _finer(
        self, mesh: QuadraticMesh, free: BoolArray, K: Any, m: Any, count: int, accuracy: float
    ) -> tuple[Array, Array] | None:
        """The modes by those of the last mesh; None if this one is not in it, bisected, or they do not converge."""
        finer = None if self._meshes is None else self._meshes.finer(mesh, free, K)
        if finer is None or self._last is None:
            return None
        before, modes = self._last
        matrix, m = finer.prolongation[np.flatnonzero(free)[finer.order]][:, before], m[finer.order][:, finer.order]
        start = (matrix @ modes.reshape(matrix.shape[1], -1)).reshape(-1, WIDTH)

        def mass(x: Array) -> Array:
            return np.asarray(m @ x.reshape(m.shape[0], -1)).reshape(x.shape)

        found = improved_modes(finer.stiffness, mass, finer.cycle.solve, start, count, accuracy)
        if found is None:
            return None
        modes = np.empty_like(found[1])
        modes[expand(finer.order, 3)] = found[1]
        self._last = free, modes
        return found[0], modes
