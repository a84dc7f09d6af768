"""A small basis for a body held by rigid patches: constraint modes and fixed-interface normal modes.

Source: Craig and Bampton, Coupling of Substructures for Dynamic Analyses, AIAA Journal 6(7), 1968; rigid patches as
in Seed, Sec. 2 (components are coupled at rigid interfaces).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..shot.character import Array, FlexibleSettings, IntArray
from .assembly import FEModel
from .natural_modes import SparseSolver, lowest_modes, vector_mass
from .tetrahedra import Indices

_FEWEST = 4  # fixed-interface modes that are always kept: two bending pairs, or bending and twist of a plate
_MOST = 8  # and at most, when they are chosen automatically
_FREQUENCY_RATIO = 3.0
_COMPLIANCE_LEFT = 1e-3


@dataclass(frozen=True, eq=False)
class Basis:
    """Mass-orthonormal modes.

    Attributes:
        modes: Nodal displacements, shape [n, 3, r]; zero on the root patch.
        omega_squared: Diagonal of the reduced stiffness [1/s^2], ascending, shape [r].
        patch_motion: Motion of each moving patch (translation of its anchor, then rotation vector), shape [p, 6, r].
    """

    modes: Array
    omega_squared: Array
    patch_motion: Array


def rigid_patch(nodes: Array, center: Array) -> Array:
    """Displacement of nodes for a unit translation and a unit small rotation about `center`, shape [k, 3, 6]."""
    motion = np.zeros((len(nodes), 3, 6))
    motion[:, :, :3] = np.eye(3)
    for axis in range(3):
        motion[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes - center)
    return motion


def reduced_basis(
    model: FEModel, root: IntArray, patches: Sequence[IntArray], centers: Sequence[Array], settings: FlexibleSettings
) -> Basis:
    """The reduced basis of a body.

    Args:
        model: Full model, n nodes.
        root: Nodes of the clamped patch.
        patches: Nodes of the p patches that move as rigid ones, disjoint from each other and from the root.
        centers: Anchor of each [m], shape [3].
        settings: `mode_count` and `max_frequency`; negative is automatic.

    Returns:
        6 p + (fixed-interface modes) modes, or the lowest `mode_count` of them.
    """
    from scipy.linalg import eigh

    n = len(model.mesh.nodes)
    free = np.ones(n, dtype=bool)
    free[root] = False
    for patch in patches:
        free[patch] = False
    interior = np.flatnonzero(np.repeat(free, 3))
    M = vector_mass(model.mass)
    K_ii, M_ii = model.stiffness[interior][:, interior], M[interior][:, interior]
    solver = SparseSolver(K_ii)

    constraint = np.zeros((n, 3, 6 * len(patches)))
    for k, (patch, center) in enumerate(zip(patches, centers, strict=True)):
        constraint[patch, :, 6 * k : 6 * k + 6] = rigid_patch(model.mesh.nodes[patch], center)
    flat = constraint.reshape(3 * n, -1)
    if len(patches):
        # static response of the interior to a motion of the patches; the interior rows of `flat` are zero before
        flat[interior] = -solver.solve((model.stiffness @ flat)[interior])

    normal = _fixed_interface_modes(model, K_ii, M_ii, M, interior, solver, flat, settings)
    ritz = np.zeros((3 * n, flat.shape[1] + normal.shape[1]))
    ritz[:, : flat.shape[1]] = flat
    ritz[interior, flat.shape[1] :] = normal
    if ritz.shape[1] == 0:
        return Basis(np.zeros((n, 3, 0)), np.zeros(0), np.zeros((len(patches), 6, 0)))
    # rotations and translations differ by a length: equal kinetic energy keeps the small eigenproblem well scaled
    M_r = ritz.T @ (M @ ritz)
    scale = 1.0 / np.sqrt(np.diag(M_r))
    K_r = ritz.T @ (model.stiffness @ ritz)
    omega_squared, U = eigh(K_r * np.outer(scale, scale), M_r * np.outer(scale, scale))
    U = scale[:, None] * U
    if settings.mode_count >= 0:
        omega_squared, U = omega_squared[: settings.mode_count], U[:, : settings.mode_count]
    modes = ritz @ U
    sign = mode_signs(modes)
    modes *= sign
    patch_motion = (U[: flat.shape[1]] * sign).reshape(len(patches), 6, U.shape[1])
    return Basis(np.ascontiguousarray(modes.reshape(n, 3, U.shape[1])), omega_squared, patch_motion)


def _fixed_interface_modes(
    model: FEModel, K: Any, M: Any, full_mass: Any, interior: Indices, solver: SparseSolver, constraint: Array,
    settings: FlexibleSettings,
) -> Array:  # fmt: skip
    """Modes with every patch held, shape [interior degrees of freedom, count]."""
    room = K.shape[0]
    if settings.mode_count >= 0:
        # as many as are kept: constraint modes alone would make the lowest frequencies too high
        return lowest_modes(K, M, min(max(settings.mode_count, _FEWEST), room), solver=solver)[1]
    if settings.max_frequency >= 0.0:
        limit = (2.0 * np.pi * settings.max_frequency) ** 2
        count = _FEWEST
        while True:
            values, vectors = lowest_modes(K, M, min(count, room), solver=solver)
            if count >= room or values[-1] > limit:
                return vectors[:, values <= limit]
            count *= 2
    values, vectors = lowest_modes(K, M, min(_MOST, room), solver=solver)
    return vectors[:, : _automatic_count(model, values, vectors, M, full_mass, interior, solver, constraint)]


def _automatic_count(
    model: FEModel, values: Array, vectors: Array, M: Any, full_mass: Any, interior: Indices, solver: SparseSolver,
    constraint: Array,
) -> int:  # fmt: skip
    """How many fixed-interface modes a shot needs when nobody says.

    Motors excite a body up to a few times its first frequency, hence all modes below three times that; and its own
    weight, and an acceleration of its base, must bend it by the right amount, hence as many as hold all but 0.1% of
    the work that a uniform acceleration does on the body. Both are usually met by four; more than eight are never
    taken, since every mode costs a row and a column of each step's system.
    """
    from scipy.linalg import cho_factor, cho_solve, eigh

    weight = full_mass @ np.tile(np.eye(3), (len(model.mesh.nodes), 1))
    first, work = values[0], np.zeros(3)
    if constraint.shape[1]:
        M_r = constraint.T @ (full_mass @ constraint)
        scale = 1.0 / np.sqrt(np.diag(M_r))
        K_r = constraint.T @ (model.stiffness @ constraint) * np.outer(scale, scale)
        first = min(first, eigh(K_r, M_r * np.outer(scale, scale), eigvals_only=True)[0])
        load = scale[:, None] * (constraint.T @ weight)
        # constraint and fixed-interface modes are orthogonal in K, so their shares of the work add
        work += np.einsum("ij,ij->j", load, cho_solve(cho_factor(K_r), load))
    inner = weight[interior]
    left = np.einsum("ij,ij->j", inner, solver.solve(inner))
    work += left
    held = np.cumsum((vectors.T @ inner) ** 2 / values[:, None], axis=0)
    enough = np.flatnonzero((left - held).max(axis=1) <= _COMPLIANCE_LEFT * work.max())
    below = int(np.count_nonzero(values <= _FREQUENCY_RATIO**2 * first))
    count = max(below, _FEWEST, int(enough[0]) + 1 if len(enough) else len(values))
    return min(count, len(values))


def mode_signs(modes: Array) -> Array:
    """+1 or -1 for each column: the first entry that is (nearly) the largest becomes positive; shape [r]."""
    size = np.abs(modes)
    # "nearly": symmetric modes have entries equal but for rounding, and rounding must not choose between them
    first = (size >= (1.0 - 1e-6) * size.max(axis=0)).argmax(axis=0)
    return np.where(modes[first, np.arange(modes.shape[1])] < 0.0, -1.0, 1.0)
