"""A small basis for a body held by rigid patches: constraint modes, fixed-interface modes and residual vectors.

Source: Craig and Bampton, Coupling of Substructures for Dynamic Analyses, AIAA Journal 6(7), 1968; rigid patches as
in Seed, Sec. 2 (components are coupled at rigid interfaces).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.reduction.basis.fixed_interface import FixedInterface, frequency_limit, mode_signs, ritz_modes
from calmotion.reduction.basis.residual_flexibility import (
    StaticModel,
    displacement_alone,
    largest_displacement,
    needed_coordinates,
)
from calmotion.reduction.basis.static_loads import ACCELERATIONS, peak_loads, unit_accelerations
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.interfaces.rigid_patch import rigid_patch
from calmotion.reduction.load_envelope import LoadEnvelope, load_direction_envelope
from calmotion.shot.character import Array, FlexibleSettings, IntArray

__all__ = ["Basis", "mode_signs", "reduced_basis", "rigid_patch"]

_BAND = 2.0  # modes up to this times the highest excited frequency move on their own: above, by a third too little
_MATTERS = 10.0  # tolerances
_OUTPUTS = 1000  # nodes that are looked at on a body with neither targets nor moving interfaces


@dataclass(frozen=True, eq=False)
class Basis:
    """Mass-orthonormal modes.

    Attributes:
        modes: Nodal displacements, shape [n, 3, r]; zero on the root patch.
        omega_squared: Diagonal of the reduced stiffness [1/s^2], ascending, shape [r].
        patch_motion: Motion of each moving patch (translation of its anchor, then rotation vector), shape [p, 6, r].
        residual: How many of the modes stand for those that were left out, by their static response.
        cut_error_m: Bound of the static displacement that is missing at the targets [m]; None when nobody said what
            excites the body.
        patch_squares: Second order of a rotation that each mode holds of each patch (see `patch_rotation`), shape
            [p, 6, r]; None where every patch moves as a rigid one.
        load_envelope: The loads by which modes were chosen for a tolerance: those of the shot, in any direction.
        first_order: Of a basis extended by modal derivatives, the modes that it extends in its coordinates, shape
            [r, c].
        second_order: And the derivatives of pairs of their first ones, shape [r, pairs].
    """

    modes: Array
    omega_squared: Array
    patch_motion: Array
    residual: int = 0
    cut_error_m: float | None = None
    patch_squares: Array | None = None
    load_envelope: LoadEnvelope | None = None
    first_order: Array | None = None
    second_order: Array | None = None


@one_blas_thread()
def reduced_basis(
    model: FEModel, root: IntArray, patches: Sequence[IntArray], centers: Sequence[Array],
    settings: FlexibleSettings, *, load_envelope: LoadEnvelope | None = None, tolerance: float | None = None,
    targets: Any = None, fixed: FixedInterface | None = None,
) -> Basis:  # fmt: skip
    """The reduced basis of a body.

    With `mode_count` the lowest modes of constraint modes and fixed-interface modes, exactly as many. With an
    load_envelope and a tolerance the modes up to `max_frequency`, or else those in the excited band and those whose own
    motion, beyond following their load, moves the outputs by more than the tolerance; and residual vectors until all
    that is missing of the static displacement is below it.
    With neither all constraint modes, fixed-interface modes up to `max_frequency` or as a shot usually needs, and the
    residual vectors that hold more than 0.1% of the work of a uniform (angular) acceleration.

    The outputs are the translation of each moving patch, its rotation times the load_envelope's reach, and the targets.

    Args:
        model: Full model, n nodes.
        root: Nodes of the clamped patch.
        patches: Nodes of the p patches that move as rigid ones, disjoint from each other and from the root.
        centers: Anchor of each [m], shape [3].
        settings: `mode_count` and `max_frequency`; negative is automatic.
        load_envelope: Peaks over the shot, one row of forces for each patch; None when they are not known.
        tolerance: Static displacement at the outputs that may be missing [m].
        targets: Function from nodal fields, shape [n, 3, r], to displacements of the body's targets, shape [k, 3, r];
            `embedding.embed(...).displacements` is one.
        fixed: The body with every patch held, where that is known.

    Returns:
        The basis; it may be empty with an load_envelope that does not bend the body.

    Raises:
        NotPositiveDefinite: The root patch does not hold the body.
    """
    fixed = fixed or FixedInterface.of(model, root, patches, centers)
    places = None if load_envelope is None else _Places(fixed, load_envelope, targets)
    if places is not None and tolerance is not None and settings.mode_count < 0:
        return _chosen(fixed, places, settings, tolerance)
    if settings.mode_count >= 0:
        columns, residual = fixed.lowest(settings.mode_count), 0
    else:
        columns, residual = fixed.usual(settings)
    omega_squared, U = ritz_modes(model, columns)
    if settings.mode_count >= 0:
        omega_squared, U = omega_squared[: settings.mode_count], U[:, : settings.mode_count]
    basis = _basis(fixed, columns, omega_squared, U, residual)
    return basis if places is None else _with_error(basis, places, frequency_limit(settings, 0.0))


def _basis(fixed: FixedInterface, columns: Array, omega_squared: Array, U: Array, residual: int) -> Basis:
    """The basis of combinations U of columns, the first of which are the constraint modes."""
    n, p = len(fixed.model.mesh.nodes), len(fixed.patches)
    modes = columns @ U
    sign = mode_signs(modes)
    modes *= sign
    patch_motion = (U[: 6 * p] * sign).reshape(p, 6, U.shape[1])
    return Basis(np.ascontiguousarray(modes.reshape(n, 3, U.shape[1])), omega_squared, patch_motion, residual)


@dataclass(frozen=True, eq=False)
class _Places:
    """What is looked at, and under which loads.

    Attributes:
        targets: As of `reduced_basis`.
    """

    fixed: FixedInterface
    load_envelope: LoadEnvelope
    targets: Any

    def static_model(self, omega_squared: Array, modes: Array, patch_motion: Array) -> StaticModel:
        """The static behaviour of a basis of shapes [r], [3n, r] and [p, 6, r] under the peak loads."""
        mesh, mass = self.fixed.model.mesh, self.fixed.model.mass
        n, r = len(mesh.nodes), len(omega_squared)
        weight = mass @ unit_accelerations(mesh.nodes).reshape(n, 36)
        inertia = modes.T @ weight.reshape(3 * n, 12)
        # a wrench does work on the motion of its patch alone
        loads = np.hstack([inertia, patch_motion.reshape(-1, r).T])
        nodal = modes.reshape(n, 3, r)
        outputs = [patch_motion[:, :3], self.load_envelope.lever[:, None, None] * patch_motion[:, 3:]]
        if self.targets is not None:
            outputs.append(self.targets(nodal))
        if sum(map(len, outputs)) == 0:
            surface = mesh.surface_nodes
            outputs.append(nodal[surface[:: max(1, len(surface) // _OUTPUTS)]])
        return StaticModel(omega_squared, loads * peak_loads(self.load_envelope), np.concatenate(outputs))


def _chosen(fixed: FixedInterface, places: _Places, settings: FlexibleSettings, tolerance: float) -> Basis:
    """As many of all candidates as the tolerance needs."""
    limit = frequency_limit(settings, _BAND * places.load_envelope.frequency)
    columns, U, static = _candidates(fixed, places, limit)
    size = float(np.linalg.norm(np.ptp(fixed.model.mesh.nodes, axis=0)))
    places = replace(
        places,
        load_envelope=load_direction_envelope(places.load_envelope, largest_displacement(static.response) / size, size),
    )
    columns, U, static = _candidates(fixed, places, limit)
    kept = static.omega_squared <= (2.0 * np.pi * limit) ** 2
    if settings.max_frequency < 0.0:
        kept |= displacement_alone(static) * _lag(static.omega_squared, limit) > tolerance
    combination, residual, error = needed_coordinates(static, kept, tolerance)
    if places.load_envelope.closed and combination.shape[1]:
        # A loop locks whatever motion of an interface its bodies have no coordinate for, and with it all that is
        # coupled to that motion even slightly.
        giving = _giving_way(static, tolerance)
        combination, residual, _ = needed_coordinates(giving, kept, tolerance)
    omega_squared = np.einsum("ij,i,ij->j", combination, static.omega_squared, combination)
    basis = _basis(fixed, columns, omega_squared, U @ combination, int(residual.sum()))
    return replace(basis, cut_error_m=error, load_envelope=places.load_envelope)


def _giving_way(static: StaticModel, tolerance: float) -> StaticModel:
    """The static behaviour with every wrench so large that its response matters."""
    alone = np.linalg.norm(static.response[:, :, ACCELERATIONS:], axis=1).max(axis=0, initial=0.0)
    factor = np.ones(static.loads.shape[1])
    factor[ACCELERATIONS:] = np.maximum(1.0, _MATTERS * tolerance / np.maximum(alone, 1e-300))
    return replace(static, loads=static.loads * factor)


def _lag(omega_squared: Array, limit: float) -> Array:
    """How much modes move beyond following a load of at most a frequency [Hz], as a share of following it.

    A mode above the limit answers 1 / (1 - r^2) times as far as at rest, r the ratio of the frequencies. Where
    nothing is known of the load_envelope all of a mode's motion counts as its own.
    """
    if limit <= 0.0:
        return np.ones_like(omega_squared)
    squared = np.minimum((2.0 * np.pi * limit) ** 2 / omega_squared, 0.5)
    return squared / (1.0 - squared)


def _with_error(basis: Basis, places: _Places, limit: float) -> Basis:
    """The basis with the difference between its static responses and the exact ones."""
    exact = _candidates(places.fixed, places, limit)[2]
    flat = basis.modes.reshape(-1, len(basis.omega_squared))
    own = places.static_model(basis.omega_squared, flat, basis.patch_motion)
    return replace(basis, cut_error_m=largest_displacement(exact.response - own.response))


def _candidates(fixed: FixedInterface, places: _Places, limit: float) -> tuple[Array, Array, StaticModel]:
    """Columns, their combinations, and the static behaviour of more modes than are needed up to a frequency [Hz];
    with all residual vectors, so that static responses are those of the full model."""
    columns = fixed.all_needed(limit, peak_loads(places.load_envelope)[:ACCELERATIONS])
    omega_squared, U = ritz_modes(fixed.model, columns)
    motion = U[: 6 * len(fixed.patches)].reshape(len(fixed.patches), 6, U.shape[1])
    return columns, U, places.static_model(omega_squared, columns @ U, motion)
