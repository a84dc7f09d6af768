"""Residual vectors: the static response of the modes that a basis omits (static correction).

A mode far above the frequencies of the loads responds to its load statically. The sum of these responses over all
omitted modes is the static response of the body minus that of the modes that are kept; one vector for each load
represents it exactly.

Source: MacNeal, A Hybrid Method of Component Mode Synthesis, Computers and Structures 1, 1971; Rixen, A Dual
Craig-Bampton Method for Dynamic Substructuring, Journal of Computational and Applied Mathematics 168, 2004.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, BoolArray

_MISSING = 0.01  # energy of a load that may be missing, of the largest: half of it is the error of a frequency
_ROUNDING = 1e-19  # of the work of a load: rounding of the static response


def residual_vectors(
    stiffness: Callable[[Array], Array], loads: Array, weight: Array, values: Array, modes: Array, static: Array
) -> tuple[Array, Array]:
    """Static responses to loads minus those of modes, as orthogonal vectors by descending work.

    Args:
        stiffness: Displacements of shape [n, k] -> the forces that hold them.
        loads: Shape [n, l].
        weight: Factor of each load, shape [l]; it affects only the order.
        values, modes: Eigenpairs of the stiffness K and the mass matrix, mass-orthonormal, shapes [k] and [n, k].
        static: Static response to each load, shape [n, l].

    Returns:
        Vectors with V^T K V = E, orthogonal to the modes in stiffness and mass, shape [n, v], v <= l, and the work of
        the weighted loads on each [J], shape [v], descending.
    """
    loads, static = loads * weight, static * weight
    work = np.einsum("ij,ij->j", loads, static)
    rest = static - modes @ ((modes.T @ loads) / values[:, None])
    gram = rest.T @ stiffness(rest)
    energy, directions = np.linalg.eigh(0.5 * (gram + gram.T))
    energy, directions = energy[::-1], directions[:, ::-1]
    keep = energy > _ROUNDING * work.max(initial=0.0)
    return rest @ (directions[:, keep] / np.sqrt(energy[keep])), energy[keep]


@dataclass(frozen=True, eq=False)
class StaticModel:
    """The static behaviour of a body in coordinates of unit mass and diagonal stiffness.

    Attributes:
        omega_squared: Diagonal of the stiffness [1/s^2], shape [r].
        loads: Generalised forces of each load at its peak, shape [r, l].
        outputs: Displacement of each output by each mode [m], shape [k, 3, r].
    """

    omega_squared: Array
    loads: Array
    outputs: Array

    @property
    def response(self) -> Array:
        """Displacement of each output under each load [m], shape [k, 3, l]."""
        return self.outputs @ (self.loads / self.omega_squared[:, None])


def largest_displacement_by_mode(static: StaticModel) -> Array:
    """Bound of the displacement of any output by each mode under all loads [m], shape [r]."""
    share = np.abs(static.loads / static.omega_squared[:, None]).sum(axis=1)
    return np.asarray(np.linalg.norm(static.outputs, axis=1).max(axis=0, initial=0.0) * share)


def largest_displacement(response: Array) -> float:
    """Bound of the displacement of any output under all loads together [m], from responses of shape [k, 3, l]."""
    return float(np.linalg.norm(response, axis=1).sum(axis=1).max(initial=0.0))


def needed_coordinates(
    static: StaticModel, kept: BoolArray, tolerance: float
) -> tuple[Array, BoolArray, float]:  # fmt: skip
    """The modes that are kept, and the fewest residual vectors of the others within a tolerance.

    Where there are any, each load finds nearly all of its energy in them: what the tip moves by a force alone says
    nothing of how it turns, and a strip whose load turns with it was 10% too fast.

    Args:
        static: With r modes.
        kept: Whether each mode is kept, shape [r].
        tolerance: Acceptable error at the outputs [m].

    Returns:
        Combinations of the modes, of unit mass and diagonal stiffness, ascending in frequency, shape [r, c]; whether
        each is a residual vector, shape [c]; and the bound of the missing displacement [m].
    """
    omega = np.sqrt(static.omega_squared)
    others = np.flatnonzero(~kept)
    # directions of unit stiffness, orthogonal in stiffness: the response is the sum of their parts
    U, size, Vt = np.linalg.svd(static.loads[others] / omega[others, None], full_matrices=False)
    directions = U / omega[others, None]
    moved = static.outputs[:, :, others] @ directions
    parts = np.einsum("kid,d,dl->dkil", moved, size, Vt)
    energy = (size[:, None] * Vt) ** 2  # of each direction in each load, twice
    largest = float(((static.loads / omega[:, None]) ** 2).sum(axis=0).max(initial=0.0))
    order = np.argsort([-largest_displacement(part) for part in parts], kind="stable")
    missing, count = parts.sum(axis=0), 0
    while count < len(order) and largest_displacement(missing) > tolerance:
        count += 1
        missing = parts[order[count:]].sum(axis=0)
    while (count or kept.any()) and energy[order[count:]].sum(axis=0).max(initial=0.0) > _MISSING * largest:
        next_one = count + int(energy[order[count:]].max(axis=1).argmax())
        order[[count, next_one]] = order[[next_one, count]]
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
