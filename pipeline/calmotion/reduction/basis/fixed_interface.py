"""A body with all interfaces fixed: its constraint modes, normal modes and residual vectors."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh

from calmotion.arrays import Array, Indices, IntArray
from calmotion.linear_algebra.sparse_solver import SparseSolver
from calmotion.model.character import FlexibleSettings
from calmotion.reduction.basis.natural_modes import lowest_modes
from calmotion.reduction.basis.residual_flexibility import residual_vectors
from calmotion.reduction.basis.static_loads import ACCELERATIONS, UNIFORM, unit_accelerations
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.patch_rotation import rigid_patch

_DEPENDENT = 1e-12  # mass of a combination of columns of unit mass below which they are linearly dependent
_FEWEST = 4  # least number of fixed-interface modes: two bending pairs, or bending and twist of a plate
_MOST = 8  # largest number when it is chosen automatically
_CANDIDATES = 64  # largest number when the loads are known
_GRID = 1.5  # ratio of squared frequencies up to which modes are computed, so that a softer body has them too
_FREQUENCY_RATIO = 3.0  # of the highest mode to the first
_COMPLIANCE_LEFT = 1e-3  # of the work of uniform accelerations that may be missing


@dataclass(frozen=True, eq=False)
class FixedInterface:
    """A body with all interfaces fixed.

    Attributes:
        model: Full model, n nodes.
        patches: Nodes of the p moving patches.
        interior: Degrees of freedom of the nodes in no patch, shape [i].
        solver: Of the stiffness of the interior.
        constraint: Static response of the body to each motion of its patches, shape [3n, 6p].
    """

    model: FEModel
    patches: Sequence[IntArray]
    interior: Indices
    solver: SparseSolver
    constraint: Array
    _softer: tuple[FixedInterface, float] | None = field(default=None, repr=False)  # see `scaled`
    _normal: list[tuple[Array, Array]] = field(default_factory=list, init=False, repr=False)
    _inertial: list[tuple[Array, Array]] = field(default_factory=list, init=False, repr=False)
    # links that are copies are reduced in several threads
    _lock: threading.RLock = field(default_factory=threading.RLock, init=False, repr=False)

    @classmethod
    def of(
        cls, model: FEModel, root: IntArray, patches: Sequence[IntArray], centers: Sequence[Array]
    ) -> FixedInterface:
        """Factorise the interior and solve for the constraint modes; arguments as of `reduced_basis`."""
        nodes = model.mesh.nodes
        n = len(nodes)
        free = np.ones(n, dtype=bool)
        free[root] = False
        for patch in patches:
            free[patch] = False
        interior = np.flatnonzero(np.repeat(free, 3))
        solver = SparseSolver(model.stiffness[interior][:, interior], nodes[free])
        constraint = np.zeros((n, 3, 6 * len(patches)))
        for k, (patch, center) in enumerate(zip(patches, centers, strict=True)):
            constraint[patch, :, 6 * k : 6 * k + 6] = rigid_patch(nodes[patch], center)
        flat = constraint.reshape(3 * n, -1)
        if len(patches):
            # static response of the interior to a motion of the patches; the interior rows of `flat` were zero
            flat[interior] = solver.solve(-(model.stiffness @ flat)[interior])
        return cls(model, patches, interior, solver, flat)

    def scaled(self, model: FEModel, factor: float) -> FixedInterface:
        """The same with another stiffness, without a new factorisation.

        Args:
            model: The full model with its stiffness times the factor, and the same mass.
            factor: Positive.
        """
        solver, own = self.solver.scaled(factor), (self, factor)
        return FixedInterface(model, self.patches, self.interior, solver, self.constraint, own)

    def lowest(self, count: int) -> Array:
        """Constraint modes and enough normal modes for `count` accurate modes of the body, shape [3n, 6p + k]."""
        # as many as modes are kept: with constraint modes alone the lowest frequencies would be too high
        count = min(max(count, _FEWEST), len(self.interior))
        return self._columns(self._normal_modes(count)[1][:, :count])

    def usual(self, settings: FlexibleSettings) -> tuple[Array, int]:
        """Constraint modes, normal modes and residual vectors of a body whose loads are not known.

        Returns:
            Columns, shape [3n, 6p + k], and the number of residual vectors, which are the last columns.
        """
        if settings.max_frequency >= 0.0:
            limit = (2.0 * np.pi * settings.max_frequency) ** 2
            values, vectors = self._normal_modes(1, limit)
            values, vectors = values[values <= limit], vectors[:, values <= limit]
        else:
            most = min(_MOST, len(self.interior))
            values, vectors = (part[..., :most] for part in self._normal_modes(most))
            count = self._automatic_count(values, vectors)
            values, vectors = values[:count], vectors[:, :count]
        residual = self._residual(values, vectors, self._work_weight(), _COMPLIANCE_LEFT)
        return self._columns(vectors, residual), residual.shape[1]

    def all_needed(self, limit: float, peaks: Array) -> Array:
        """Constraint modes, normal modes up to twice a frequency [Hz], and all residual vectors of the accelerations.

        Args:
            peaks: Of the twelve unit accelerations, shape [12]; those of peak zero are omitted.
        """
        values, vectors = self._up_to((2.0 * 2.0 * np.pi * limit) ** 2)
        return self._columns(vectors, self._residual(values, vectors, peaks, 0.0))

    def _up_to(self, below: float) -> tuple[Array, Array]:
        """Normal modes up to a squared frequency [1/s^2] and one above, some at least."""
        least = min(_MOST, len(self.interior))
        values, vectors = self._normal_modes(least, below, _CANDIDATES)
        count = max(least, int(np.count_nonzero(values <= below)) + 1)
        return values[:count], vectors[:, :count]

    def _normal_modes(self, count: int, below: float = 0.0, most: int | None = None) -> tuple[Array, Array]:
        """At least `count` normal modes, those up to a squared frequency [1/s^2] and one above, as far as there are
        `most`; what was found is kept."""
        if self._softer is not None:
            other, factor = self._softer
            values, vectors = other._normal_modes(count, below / factor, most)
            return factor * values, vectors
        with self._lock:
            if not self._normal or not self._is_enough(self._normal[0][0], count, below, most):
                bound = _GRID ** np.ceil(np.log(below) / np.log(_GRID)) if below > 0.0 else None
                count = min(max(count, _MOST), len(self.interior))
                K, M = self.model.among(self.interior[::3] // 3)
                self._normal[:] = [
                    lowest_modes(K, M, count, solver=self.solver, below=bound, most=most and max(most, count))
                ]
            return self._normal[0]

    def _is_enough(self, values: Array, count: int, below: float, most: int | None) -> bool:
        """Whether known modes are all that are asked for."""
        if len(values) >= min(len(self.interior), np.inf if most is None else most):
            return True
        return len(values) >= count and bool(values[-1] > below)

    def balance(self, force: Array, imposed: Array) -> tuple[Array, Array]:
        """Static equilibrium under forces, with displacements imposed on the patches besides their rigid motions.

        Args:
            force: Nodal [N], shape [3n, k].
            imposed: [m], shape [3n, k]; zero in the interior.

        Returns:
            Displacements, shape [3n, k], and the motion of each patch in them, shape [p, 6, k].
        """
        load = force - self.model.stiffness @ imposed
        result = imposed.copy()
        result[self.interior] += self.solver.solve(load[self.interior])
        motion = np.zeros((0, load.shape[1]))
        if self.constraint.shape[1]:
            # constraint modes and displacements of the interior are orthogonal in K, so each is solved separately
            motion = self._by_patches(self.constraint.T @ load)
            result += self.constraint @ motion
        return result, motion.reshape(len(self.patches), 6, load.shape[1])

    def patch_stiffness(self) -> Array:
        """Static stiffness of the patches, root clamped: their wrenches by their motions, shape [6p, 6p]."""
        K = self.constraint.T @ (self.model.stiffness @ self.constraint)
        return np.asarray(0.5 * (K + K.T))

    def _by_patches(self, work: Array) -> Array:
        """Motions of the patches under generalised loads, both of shape [6p, k]."""
        K_r = self.patch_stiffness()
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
        return self.model.momentum(fields.reshape(len(self.constraint), count))

    def inertial(self) -> tuple[Array, Array]:
        """Nodal forces of the unit accelerations on the interior, and its static response, shape [i, 12] each."""
        with self._lock:
            if not self._inertial:
                loads = self._weight(ACCELERATIONS)[self.interior]
                self._inertial.append((loads, self.solver.solve(loads)))
        return self._inertial[0]

    def _residual(self, values: Array, vectors: Array, weight: Array, least: float) -> Array:
        used = np.flatnonzero(weight > 0.0)
        loads, static = (part[:, used] for part in self.inertial())
        residual, work = residual_vectors(self._force, loads, weight[used], values, vectors, static)
        return residual[:, work > least]

    def _force(self, displacement: Array) -> Array:
        """Forces that hold the interior at displacements, both of shape [i, k]."""
        whole = np.zeros((len(self.constraint), displacement.shape[1]))
        whole[self.interior] = displacement
        return np.asarray((self.model.stiffness @ whole)[self.interior])

    def _work(self, loads: Array) -> Array:
        """Twice the work of loads on the whole body [J], shape [l]."""
        inner = loads[self.interior]
        work = np.einsum("ij,ij->j", inner, self.solver.solve(inner))
        if self.constraint.shape[1]:
            # constraint and fixed-interface displacements are orthogonal in K, so their shares of the work add
            load = self.constraint.T @ loads
            work += np.einsum("ij,ij->j", load, self._by_patches(load))
        return np.asarray(work)

    def _work_weight(self) -> Array:
        """Accelerations that do at most unit work on the body, with one factor for linear and one for angular ones."""
        work = self._work(self._weight(UNIFORM))
        return np.repeat(1.0 / np.sqrt([work[:3].max(), work[3:].max()]), 3)

    def _automatic_count(self, values: Array, vectors: Array) -> int:
        """Number of normal modes when the loads are not known.

        Motors excite a body up to a few times its first frequency: all modes up to three times that are needed. The
        deflection by the weight of the body and by accelerations of its base must be accurate: the modes must cover
        all but 0.1% of the work of a uniform acceleration. Four modes usually suffice. At most eight are taken, because
        each mode adds a row and a column to the linear system of a time step; residual vectors cover the rest.
        """
        weight = self._weight(3)
        first = values[0]
        if self.constraint.shape[1]:
            first = min(first, ritz_modes(self.model, self.constraint)[0][0])
        inner = weight[self.interior]
        total = np.einsum("ij,ij->j", inner, self.solver.solve(inner))
        covered = np.cumsum((vectors.T @ inner) ** 2 / values[:, None], axis=0)
        enough = np.flatnonzero((total - covered).max(axis=1) <= _COMPLIANCE_LEFT * self._work(weight).max())
        below = int(np.count_nonzero(values <= _FREQUENCY_RATIO**2 * first))
        count = max(below, _FEWEST, int(enough[0]) + 1 if len(enough) else len(values))
        return min(count, len(values))


def frequency_limit(settings: FlexibleSettings, excited: float) -> float:
    """Highest frequency of the modes that are kept [Hz]: that of the settings, else the highest excited one."""
    return settings.max_frequency if settings.max_frequency >= 0.0 else excited


def ritz_modes(model: FEModel, columns: Array) -> tuple[Array, Array]:
    """Modes of a body in the span of columns of shape [3n, r].

    Returns:
        omega^2 [1/s^2] ascending, shape [m], and combinations that are orthonormal in mass, shape [r, m]; m < r where
        columns are linearly dependent.
    """
    if columns.shape[1] == 0:
        return np.zeros(0), np.zeros((0, 0))
    # rotations and translations differ by a length: equal kinetic energy keeps the small eigenproblem well scaled
    M_r = columns.T @ model.momentum(columns)
    scale = 1.0 / np.sqrt(np.diag(M_r))
    K_r = columns.T @ (model.stiffness @ columns)
    size, directions = eigh(M_r * np.outer(scale, scale))
    independent = size > _DEPENDENT * size[-1]
    free = scale[:, None] * (directions[:, independent] / np.sqrt(size[independent]))
    omega_squared, U = eigh(free.T @ K_r @ free)
    return omega_squared, free @ U


def mode_signs(modes: Array) -> Array:
    """+1 or -1 for each column: the first entry that is (nearly) the largest becomes positive; shape [r]."""
    if modes.shape[1] == 0:
        return np.zeros(0)
    size = np.abs(modes)
    # "nearly": entries of symmetric modes differ by rounding only, and rounding must not decide the sign
    first = (size >= (1.0 - 1e-6) * size.max(axis=0)).argmax(axis=0)
    return np.where(modes[first, np.arange(modes.shape[1])] < 0.0, -1.0, 1.0)
