"""A body with fixed interfaces on a mesh that is bisected from a coarser one, begun from what that one has.

Static responses and modes of two such meshes differ by as much as the error of the coarser one, a few percent of
energy. One step of inverse iteration takes away all of that but what decides nothing: it costs the solves for as many
columns as there are modes, a third to a fifth of Lanczos' method from the start. Large meshes are not factorised.

Source: Bathe, Finite Element Procedures, 11.6 (subspace iteration).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.linear_algebra.multigrid_solver import MultigridSolver
from calmotion.linear_algebra.sparse_solver import Solver, SparseSolver
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.reduction.elements.nested_meshes import NestedMeshes

_FACTORISED = 60_000  # nodes up to which factors take no more time than a multigrid cycle for all the columns
# Relative energy of the error of a solution without factors: the mesh leaves a hundred times as much. Static responses
# to accelerations complete the modes, and decide less.
_ACCURACY, _ACCURACY_INERTIAL = 1e-6, 1e-4


@dataclass(frozen=True, eq=False)
class CoarserBody:
    """A body with fixed interfaces on a coarser mesh.

    Attributes:
        mesh: Of n nodes.
        free: Its nodes in no patch, shape [n].
        meshes: The mesh and coarser ones.
        constraint: Static response to each motion of the patches, shape [3n, 6p].
        energy: Twice the strain energy of each, shape [6p].
        inertial: Static response of the free nodes to the unit accelerations, shape [i, 12]; None if not asked for.
        normal: By the squared frequency up to which they were asked for: omega^2 [1/s^2] and modes, shape [i, k].
    """

    mesh: QuadraticMesh
    free: BoolArray
    meshes: NestedMeshes
    constraint: Array
    energy: Array
    inertial: Array | None
    normal: Mapping[float, tuple[Array, Array]]

    def on(self, mesh: QuadraticMesh, free: BoolArray, K: Any) -> Begun | None:
        """The body on a finer mesh; None if that is not bisected from this one.

        Args:
            mesh: That.
            free: Its nodes in no patch.
            K: Its stiffness at these, sparse, shape [j, j].
        """
        finer = self.meshes.finer(mesh, free, K)
        if finer is None:
            return None

        def factorised() -> SparseSolver:
            return SparseSolver(K, mesh.nodes[free])

        many = len(mesh.nodes) > _FACTORISED
        solver: Solver
        if many:
            solver = MultigridSolver(finer.order, finer.stiffness, finer.cycle, _ACCURACY, factorised)
        else:
            solver = factorised()
        return Begun(solver, self, finer.prolongation[free])


@dataclass(frozen=True, eq=False)
class Begun:
    """What a body on a finer mesh begins with.

    Attributes:
        solver: Of its stiffness at the free nodes.
        coarser: The body on the coarser mesh.
        prolongation: Values at the free nodes from those at all nodes of that mesh, sparse.
    """

    solver: Solver
    coarser: CoarserBody
    prolongation: Any

    def constraint(self, loads: Array) -> Array:
        """Static response of the free nodes to loads by the motions of the patches, both of shape [j, 6p]."""
        # the patch alone, moved in a body that stays, has a million times the energy
        return self.solver.solve(loads, self._moved(self.coarser.constraint), _ACCURACY * self.coarser.energy)

    def inertial(self, loads: Array) -> Array:
        """Static response of the free nodes to loads by the unit accelerations, both of shape [j, 12]."""
        if self.coarser.inertial is None:
            return self.solver.solve(loads)
        start = self._of_free(self.coarser.inertial)
        return self.solver.solve(loads, start, _ACCURACY_INERTIAL * np.abs(np.einsum("ij,ij->j", start, loads)))

    def modes(self, K: Any, M: Any, bound: float) -> tuple[Array, Array] | None:
        """As many modes as the coarser body has; None if these were not asked for.

        Args:
            K, M: Stiffness and mass at the free nodes, sparse, shape [j, j].
            bound: Squared frequency [1/s^2].

        Returns:
            omega^2 [1/s^2], ascending, and M-orthonormal modes, shape [j, k].
        """
        known = self.coarser.normal.get(bound)
        return None if known is None else improved(K, M, self.solver, known[0], self._of_free(known[1]))

    def _of_free(self, columns: Array) -> Array:
        whole = np.zeros((3 * len(self.coarser.free), columns.shape[1]))
        whole[np.repeat(self.coarser.free, 3)] = columns
        return self._moved(whole)

    def _moved(self, columns: Array) -> Array:
        n, k = len(self.coarser.free), columns.shape[1]
        return np.asarray(self.prolongation @ columns.reshape(n, 3 * k)).reshape(-1, k)


def improved(K: Any, M: Any, solver: Solver, values: Array, start: Array) -> tuple[Array, Array]:
    """Eigenpairs by one step of inverse iteration.

    Args:
        K, M: Stiffness and mass, sparse, shape [n, n].
        solver: Of the stiffness.
        values: Approximate omega^2 [1/s^2], shape [k].
        start: Approximate lowest modes, shape [n, k].

    Returns:
        omega^2 [1/s^2], ascending, shape [k], and M-orthonormal modes, shape [n, k].
    """
    from scipy.linalg import eigh

    moved = solver.solve(M @ start, start / values)
    values, combined = eigh(moved.T @ (K @ moved), moved.T @ (M @ moved))
    return values, moved @ combined
