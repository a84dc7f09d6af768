"""Ever finer meshes of a clamped body, each bisected from the one before: a multigrid cycle over their stiffness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from calmotion.arrays import BoolArray, IntArray
from calmotion.linear_algebra.multigrid import Blocks, Level, Multigrid, near_order
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.reduction.elements.nesting import prolongation


@dataclass(frozen=True, eq=False)
class FinerMesh:
    """The finest of nested meshes.

    Attributes:
        order: Its n free nodes in the order of the stiffness, shape [n].
        stiffness: Of these.
        prolongation: Values at all its nodes from those at all nodes of the mesh before, sparse.
        cycle: Roughly the inverse of the stiffness.
    """

    order: IntArray
    stiffness: Blocks
    prolongation: Any
    cycle: Multigrid


class NestedMeshes:
    """Nested meshes, of which only the first is factorised.

    Args:
        mesh: The first mesh.
        free: Its nodes that are not clamped, shape [nodes].
        coarsest: Solver of its stiffness at these.
    """

    def __init__(self, mesh: QuadraticMesh, free: BoolArray, coarsest: SparseSolver):
        self._coarsest = coarsest
        self._levels: list[Level] = []
        self._mesh, self._nodes = mesh, np.flatnonzero(free)

    def finer(self, mesh: QuadraticMesh, free: BoolArray, stiffness: Any) -> FinerMesh | None:
        """The next mesh; None if it is not the last one, bisected.

        Args:
            mesh: That.
            free: Its nodes that are not clamped, shape [nodes]; a clamp may hold other places than on the last mesh.
            stiffness: At these, sparse, shape [3n, 3n].
        """
        nested = prolongation(self._mesh, mesh)
        if nested is None:
            return None
        matrix, divided = nested
        changed = mesh.tets[divided | (~free)[mesh.tets].any(axis=1)]
        touched = np.zeros(len(mesh.nodes), dtype=bool)
        touched[changed] = True
        order = near_order(stiffness)
        blocks, nodes = Blocks(stiffness, order), np.flatnonzero(free)[order]
        smoothed = np.flatnonzero(touched[nodes]).astype(np.int32)
        self._levels.append(Level(blocks, matrix[nodes][:, self._nodes], smoothed))
        self._mesh, self._nodes = mesh, nodes
        return FinerMesh(order, blocks, matrix, Multigrid(self._coarsest, list(self._levels)))
