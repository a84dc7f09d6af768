"""What the modes that are left out would still do under slow loads, kept in a few vectors (static correction).

A mode far above the load_envelope follows its load without delay. All such modes together follow as the static response
does less the part of the modes that are kept; one vector for each load holds it exactly, however many modes it stands
for.

Source: MacNeal, A Hybrid Method of Component Mode Synthesis, Computers and Structures 1, 1971; Rixen, A Dual
Craig-Bampton Method for Dynamic Substructuring, Journal of Computational and Applied Mathematics 168, 2004.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.shot.character import Array, BoolArray

_NOTHING = 1e-19  # of the work of a load: rounding of the static response


def residual_vectors(
    K: Any, loads: Array, weight: Array, values: Array, modes: Array, solver: SparseSolver
) -> tuple[Array, Array]:
    """Static responses to loads, less what modes give, as few vectors in the order of the work that they hold.

    Args:
        K: Stiffness, shape [n, n].
        loads: Shape [n, l].
        weight: Factor of each load, shape [l]; it decides about the order alone.
        values, modes: Eigenpairs of K and the mass matrix, mass-orthonormal, shapes [k] and [n, k].
        solver: Of K.

    Returns:
        Vectors with V^T K V = E, orthogonal to the modes in stiffness and mass, shape [n, v], v <= l, and the work of
        the weighted loads that each holds [J], shape [v], descending.
    """
    loads = loads * weight
    static = solver.solve(loads)
    work = np.einsum("ij,ij->j", loads, static)
    rest = static - modes @ ((modes.T @ loads) / values[:, None])
    gram = rest.T @ (K @ rest)
    held, directions = np.linalg.eigh(0.5 * (gram + gram.T))
    held, directions = held[::-1], directions[:, ::-1]
    keep = held > _NOTHING * work.max(initial=0.0)
    return rest @ (directions[:, keep] / np.sqrt(held[keep])), held[keep]


@dataclass(frozen=True, eq=False)
class StaticModel:
    """The static behaviour of a body in coordinates of unit mass and diagonal stiffness.

    Attributes:
        omega_squared: Diagonal of the stiffness [1/s^2], shape [r].
        loads: Generalised forces of each load at its peak, shape [r, l].
        outputs: Displacement of the places that matter [m], shape [k, 3, r].
    """

    omega_squared: Array
    loads: Array
    outputs: Array

    @property
    def response(self) -> Array:
        """Displacement of each output under each load [m], shape [k, 3, l]."""
        return self.outputs @ (self.loads / self.omega_squared[:, None])


def displacement_alone(static: StaticModel) -> Array:
    """The most that each mode moves an output under all loads [m], shape [r]."""
    share = np.abs(static.loads / static.omega_squared[:, None]).sum(axis=1)
    return np.linalg.norm(static.outputs, axis=1).max(axis=0, initial=0.0) * share


def largest_displacement(response: Array) -> float:
    """Bound [m] of what loads do together at the output that moves most, from responses of shape [k, 3, l]."""
    return float(np.linalg.norm(response, axis=1).sum(axis=1).max(initial=0.0))


def needed_coordinates(
    static: StaticModel, kept: BoolArray, tolerance: float
) -> tuple[Array, BoolArray, float]:  # fmt: skip
    """Modes that are kept, and as few vectors for all others as the tolerance needs.

    Args:
        static: With r modes.
        kept: Which modes, bool, shape [r].
        tolerance: At the outputs [m].

    Returns:
        Combinations of the modes, of unit mass and diagonal stiffness, ascending in frequency, shape [r, c]; which of
        them are residual vectors, bool, shape [c]; and the largest displacement that is missing [m].
    """
    omega = np.sqrt(static.omega_squared)
    others = np.flatnonzero(~kept)
    # directions of unit stiffness that are orthogonal in stiffness: each adds its own part of the response
    U, size, Vt = np.linalg.svd(static.loads[others] / omega[others, None], full_matrices=False)
    directions = U / omega[others, None]
    moved = static.outputs[:, :, others] @ directions
    parts = np.einsum("kid,d,dl->dkil", moved, size, Vt)
    order = np.argsort([-largest_displacement(part) for part in parts], kind="stable")
    missing, count = parts.sum(axis=0), 0
    while count < len(order) and largest_displacement(missing) > tolerance:
        count += 1
        missing = parts[order[count:]].sum(axis=0)
    extra = directions[:, order[:count]]
    mass, rotation = np.linalg.eigh(extra.T @ extra)
    modes = np.eye(len(omega))[:, kept]
    residual = np.zeros((len(omega), count))
    residual[others] = extra @ (rotation / np.sqrt(mass))
    values = np.concatenate([static.omega_squared[kept], 1.0 / mass])
    ascending = np.argsort(values, kind="stable")
    combination = np.hstack([modes, residual])[:, ascending]
    return combination, ascending >= modes.shape[1], largest_displacement(missing)
