"""A body with every patch held: its constraint modes, normal modes and residual vectors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from calmotion.geometry.tetrahedra import Indices
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.reduction.basis.natural_modes import lowest_modes, vector_mass
from calmotion.reduction.basis.residual_flexibility import residual_vectors
from calmotion.reduction.basis.static_loads import UNIFORM, unit_accelerations
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.interfaces.rigid_patch import rigid_patch
from calmotion.shot.character import Array, FlexibleSettings, IntArray

_DEPENDENT = 1e-12  # share of unit mass that a combination of unit columns has where it is rounding
_FEWEST = 4  # fixed-interface modes that are always kept: two bending pairs, or bending and twist of a plate
_MOST = 8  # and at most, when they are chosen automatically
_CANDIDATES = 64  # at most, when the shot says what is needed
_FREQUENCY_RATIO = 3.0
_COMPLIANCE_LEFT = 1e-3


@dataclass(frozen=True, eq=False)
class FixedInterface:
    """A body with every patch held.

    Attributes:
        model: Full model, n nodes.
        patches: Nodes of the p moving patches.
        interior: Degrees of freedom of the nodes in no patch, shape [i].
        K, M: Of the interior, sparse, shape [i, i].
        mass: Of the whole body, sparse, shape [3n, 3n].
        solver: Of K.
        constraint: Static response of the body to each motion of its patches, shape [3n, 6p].
    """

    model: FEModel
    patches: Sequence[IntArray]
    interior: Indices
    K: Any
    M: Any
    mass: Any
    solver: SparseSolver
    constraint: Array
    _normal: dict[float, tuple[Array, Array]] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(
        cls, model: FEModel, root: IntArray, patches: Sequence[IntArray], centers: Sequence[Array]
    ) -> FixedInterface:
        """Factorises the interior and solves for the constraint modes; arguments as of `reduced_basis`."""
        nodes = model.mesh.nodes
        n = len(nodes)
        free = np.ones(n, dtype=bool)
        free[root] = False
        for patch in patches:
            free[patch] = False
        interior = np.flatnonzero(np.repeat(free, 3))
        mass = vector_mass(model.mass)
        K, M = model.stiffness[interior][:, interior], mass[interior][:, interior]
        solver = SparseSolver(K, nodes[free])
        constraint = np.zeros((n, 3, 6 * len(patches)))
        for k, (patch, center) in enumerate(zip(patches, centers, strict=True)):
            constraint[patch, :, 6 * k : 6 * k + 6] = rigid_patch(nodes[patch], center)
        flat = constraint.reshape(3 * n, -1)
        if len(patches):
            # static response of the interior to a motion of the patches; the interior rows of `flat` are zero before
            flat[interior] = -solver.solve((model.stiffness @ flat)[interior])
        return cls(model, patches, interior, K, M, mass, solver, flat)

    def lowest(self, count: int) -> Array:
        """Constraint modes and enough normal modes for `count` good ones of the body, shape [3n, 6p + k]."""
        # as many as are kept: constraint modes alone would make the lowest frequencies too high
        count = min(max(count, _FEWEST), len(self.interior))
        return self._columns(lowest_modes(self.K, self.M, count, solver=self.solver)[1])

    def usual(self, settings: FlexibleSettings) -> tuple[Array, int]:
        """Constraint modes, normal modes and residual vectors of a body of which nobody says what excites it.

        Returns:
            Columns, shape [3n, 6p + k], and how many of them, the last ones, are residual vectors.
        """
        if settings.max_frequency >= 0.0:
            limit = (2.0 * np.pi * settings.max_frequency) ** 2
            values, vectors = lowest_modes(self.K, self.M, 1, solver=self.solver, below=limit)
            values, vectors = values[values <= limit], vectors[:, values <= limit]
        else:
            values, vectors = lowest_modes(self.K, self.M, min(_MOST, len(self.interior)), solver=self.solver)
            count = self._automatic_count(values, vectors)
            values, vectors = values[:count], vectors[:, :count]
        residual = self._residual(values, vectors, self._work_weight(), _COMPLIANCE_LEFT)
        return self._columns(vectors, residual), residual.shape[1]

    def all_needed(self, limit: float, peaks: Array) -> Array:
        """Constraint modes, normal modes up to twice a frequency [Hz], and all residual vectors of the accelerations.

        Args:
            peaks: Of the twelve unit accelerations; those of peak zero are left out.
        """
        if limit not in self._normal:  # a body is asked again with other loads
            below, least = (2.0 * 2.0 * np.pi * limit) ** 2, min(_MOST, len(self.interior))
            self._normal[limit] = lowest_modes(self.K, self.M, least, solver=self.solver, below=below, most=_CANDIDATES)
        values, vectors = self._normal[limit]
        return self._columns(vectors, self._residual(values, vectors, peaks, 0.0))

    def balance(self, force: Array, bent: Array) -> tuple[Array, Array]:
        """Where the body comes to rest under forces with displacements imposed on top of rigid motions of its patches.

        Args:
            force: Nodal [N], shape [3n, k].
            bent: [m], shape [3n, k]; zero in the interior.

        Returns:
            Displacements, shape [3n, k], and the motion of each patch in them, shape [p, 6, k].
        """
        load = force - self.model.stiffness @ bent
        result = bent.copy()
        result[self.interior] += self.solver.solve(load[self.interior])
        motion = np.zeros((0, load.shape[1]))
        if self.constraint.shape[1]:
            # what patches do and what the interior does are orthogonal in K, so that each follows by itself
            motion = self._by_patches(self.constraint.T @ load)
            result += self.constraint @ motion
        return result, motion.reshape(len(self.patches), 6, load.shape[1])

    def _by_patches(self, work: Array) -> Array:
        """Motions of the patches under loads that do this work on unit ones, shape [6p, k]."""
        K_r = self.constraint.T @ (self.model.stiffness @ self.constraint)
        scale = 1.0 / np.sqrt(np.diag(K_r))
        motion = np.linalg.solve(K_r * np.outer(scale, scale), scale[:, None] * work)
        return np.asarray(scale[:, None] * motion)

    def _columns(self, normal: Array, residual: Array | None = None) -> Array:
        parts = [normal] if residual is None else [normal, residual]
        fixed = np.hstack(parts)
        first = self.constraint.shape[1]
        columns = np.zeros((len(self.constraint), first + fixed.shape[1]))
        columns[:, :first] = self.constraint
        columns[self.interior, first:] = fixed
        return columns

    def _weight(self, count: int) -> Array:
        """Nodal forces of the first unit accelerations, shape [3n, count]."""
        fields = unit_accelerations(self.model.mesh.nodes)[:, :, :count]
        return self.mass @ fields.reshape(len(self.constraint), count)

    def _residual(self, values: Array, vectors: Array, weight: Array, least: float) -> Array:
        used = weight > 0.0
        loads = self._weight(len(weight))[self.interior][:, used]
        residual, work = residual_vectors(self.K, loads, weight[used], values, vectors, self.solver)
        return residual[:, work > least]

    def _work(self, loads: Array) -> Array:
        """Twice the work of loads on the whole body [J], shape [l]."""
        inner = loads[self.interior]
        work = np.einsum("ij,ij->j", inner, self.solver.solve(inner))
        if self.constraint.shape[1]:
            # constraint and fixed-interface displacements are orthogonal in K, so their shares of the work add
            load = self.constraint.T @ loads
            work += np.einsum("ij,ij->j", load, self._by_patches(load))
        return work

    def _work_weight(self) -> Array:
        """Accelerations that do at most unit work on the body, the linear ones alike and the angular ones alike."""
        work = self._work(self._weight(UNIFORM))
        return np.repeat(1.0 / np.sqrt([work[:3].max(), work[3:].max()]), 3)

    def _automatic_count(self, values: Array, vectors: Array) -> int:
        """How many normal modes a shot needs when nobody says.

        Motors excite a body up to a few times its first frequency, hence all modes below three times that; and its
        own weight, and an acceleration of its base, must bend it by the right amount, hence as many as hold all but
        0.1% of the work that a uniform acceleration does on the body. Both are usually met by four; more than eight
        are never taken, since every mode costs a row and a column of each step's system; what they miss is left to
        residual vectors.
        """
        weight = self._weight(3)
        first = values[0]
        if self.constraint.shape[1]:
            first = min(first, ritz_modes(self.model, self.constraint)[0][0])
        inner = weight[self.interior]
        left = np.einsum("ij,ij->j", inner, self.solver.solve(inner))
        held = np.cumsum((vectors.T @ inner) ** 2 / values[:, None], axis=0)
        enough = np.flatnonzero((left - held).max(axis=1) <= _COMPLIANCE_LEFT * self._work(weight).max())
        below = int(np.count_nonzero(values <= _FREQUENCY_RATIO**2 * first))
        count = max(below, _FEWEST, int(enough[0]) + 1 if len(enough) else len(values))
        return min(count, len(values))


def frequency_limit(settings: FlexibleSettings, excited: float) -> float:
    """Up to which frequency modes are kept [Hz]: as the settings say, else as the body is excited."""
    return settings.max_frequency if settings.max_frequency >= 0.0 else excited


def ritz_modes(model: FEModel, columns: Array) -> tuple[Array, Array]:
    """Modes of a body in the span of columns of shape [3n, r].

    Returns:
        omega^2 [1/s^2] ascending, shape [m], and combinations that are orthonormal in mass, shape [r, m]; m < r where
        columns depend on each other but for rounding.
    """
    from scipy.linalg import eigh

    if columns.shape[1] == 0:
        return np.zeros(0), np.zeros((0, 0))
    mass = model.mass @ columns.reshape(len(model.mesh.nodes), -1)
    # rotations and translations differ by a length: equal kinetic energy keeps the small eigenproblem well scaled
    M_r = columns.T @ mass.reshape(columns.shape)
    scale = 1.0 / np.sqrt(np.diag(M_r))
    K_r = columns.T @ (model.stiffness @ columns)
    size, directions = eigh(M_r * np.outer(scale, scale))
    own = size > _DEPENDENT * size[-1]
    free = scale[:, None] * (directions[:, own] / np.sqrt(size[own]))
    omega_squared, U = eigh(free.T @ K_r @ free)
    return omega_squared, free @ U


def mode_signs(modes: Array) -> Array:
    """+1 or -1 for each column: the first entry that is (nearly) the largest becomes positive; shape [r]."""
    if modes.shape[1] == 0:
        return np.zeros(0)
    size = np.abs(modes)
    # "nearly": symmetric modes have entries equal but for rounding, and rounding must not choose between them
    first = (size >= (1.0 - 1e-6) * size.max(axis=0)).argmax(axis=0)
    return np.where(modes[first, np.arange(modes.shape[1])] < 0.0, -1.0, 1.0)
