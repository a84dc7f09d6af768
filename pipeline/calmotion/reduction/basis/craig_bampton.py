"""Reduced basis of a body with rigid interface patches: constraint modes, fixed-interface modes, residual vectors.

Source: Craig and Bampton, Coupling of Substructures for Dynamic Analyses, AIAA Journal 6(7), 1968; rigid patches as
in Seed, Sec. 2 (components are coupled at rigid interfaces).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray, box_diagonal
from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.model.character import FlexibleSettings
from calmotion.reduction.basis.fixed_interface import FixedInterface, frequency_limit, mode_signs, ritz_modes
from calmotion.reduction.basis.residual_flexibility import (
    StaticModel,
    largest_displacement,
    largest_displacement_by_mode,
    needed_coordinates,
)
from calmotion.reduction.basis.static_loads import ACCELERATIONS, peak_loads, unit_accelerations
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.patch_rotation import rigid_patch
from calmotion.reduction.load_envelope import LoadEnvelope, load_direction_envelope

__all__ = ["Basis", "mode_signs", "reduced_basis", "rigid_patch"]

_BAND = 2.0  # modes up to this times the highest excited frequency; above, the dynamic amplification is at most 4/3
_COUPLED = 10.0  # tolerances that a wrench in a closed chain is scaled to
_OUTPUTS = 1000  # output nodes of a body with neither targets nor moving interfaces


@dataclass(frozen=True, eq=False)
class Basis:
    """Mass-orthonormal modes.

    Attributes:
        modes: Nodal displacements, shape [n, 3, r]; zero on the root patch.
        omega_squared: Diagonal of the reduced stiffness [1/s^2], ascending, shape [r].
        patch_motion: Motion of each moving patch (translation of its center, then rotation vector), shape [p, 6, r].
        residual: Number of residual vectors among the modes: the static response of the modes that are omitted.
        cut_error_m: Bound of the missing static displacement at the targets [m]; None when the loads are not known.
        patch_squares: Second order of the rotation of each patch in each mode (see `patch_rotation`), shape [p, 6, r];
            None where the patches have no coordinates for it.
        load_envelope: The loads for which modes were chosen: the load-direction envelope of the shot.
        first_order: Of a basis with modal derivatives: its c linear modes in its coordinates, shape [r, c].
        second_order: Of a basis with modal derivatives: the derivatives of the pairs in its coordinates, shape
            [r, pairs].
        dropped: Of a basis with modal derivatives: share of the largest strain energy among them that the largest of
            those has which there was no room for.
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
    dropped: float = 0.0


@one_blas_thread()
def reduced_basis(
    model: FEModel, root: IntArray, patches: Sequence[IntArray], centers: Sequence[Array],
    settings: FlexibleSettings, *, load_envelope: LoadEnvelope | None = None, tolerance: float | None = None,
    targets: Any = None, fixed: FixedInterface | None = None,
) -> Basis:  # fmt: skip
    """The reduced basis of a body.

    - With `mode_count`: that number of lowest modes in the span of constraint modes and fixed-interface modes.
    - With a load envelope and a tolerance: the modes up to `max_frequency`, or else those in the excited band and those
      whose dynamic response moves the outputs by more than the tolerance; then residual vectors until the missing
      static displacement is below the tolerance, and each load finds nearly all of its energy.
    - Otherwise: all constraint modes, fixed-interface modes up to `max_frequency` or a usual number of them, and the
      residual vectors with more than 0.1% of the work of a uniform linear or angular acceleration.

    The outputs are the translation of each moving patch, its rotation times the lever arm of the load envelope, and the
    targets.

    Args:
        model: Full model, n nodes.
        root: Nodes of the clamped patch.
        patches: Nodes of the p moving patches, disjoint from each other and from the root.
        centers: Center of each, the origin of its attachment frame [m], shape [3].
        settings: `mode_count` and `max_frequency`; negative is automatic.
        load_envelope: Loads of the shot, one row for each patch; None when they are not known.
        tolerance: Acceptable error of the static displacement at the outputs [m].
        targets: Function from nodal fields, shape [n, 3, r], to displacements of the targets, shape [k, 3, r], such as
            `embedding.embed(...).displacements`.
        fixed: The body with all interfaces fixed, where it is known.

    Returns:
        The basis; it is empty where the loads cause no deflection.

    Raises:
        NotPositiveDefinite: The root patch does not constrain all rigid motions of the body.
    """
    fixed = fixed or FixedInterface.of(model, root, patches, centers)
    outputs = None if load_envelope is None else _Outputs(fixed, load_envelope, targets)
    if outputs is not None and tolerance is not None and settings.mode_count < 0:
        return _chosen(fixed, outputs, settings, tolerance)
    if settings.mode_count >= 0:
        columns, residual = fixed.lowest(settings.mode_count), 0
    else:
        columns, residual = fixed.usual(settings)
    omega_squared, U = ritz_modes(model, columns)
    if settings.mode_count >= 0:
        omega_squared, U = omega_squared[: settings.mode_count], U[:, : settings.mode_count]
    basis = _basis(fixed, columns, omega_squared, U, residual)
    return basis if outputs is None else _with_error(basis, outputs, frequency_limit(settings, 0.0))


def _basis(fixed: FixedInterface, columns: Array, omega_squared: Array, U: Array, residual: int) -> Basis:
    """The basis of combinations U of columns, the first of which are the constraint modes."""
    n, p = len(fixed.model.mesh.nodes), len(fixed.patches)
    modes = columns @ U
    sign = mode_signs(modes)
    modes *= sign
    patch_motion = (U[: 6 * p] * sign).reshape(p, 6, U.shape[1])
    return Basis(np.ascontiguousarray(modes.reshape(n, 3, U.shape[1])), omega_squared, patch_motion, residual)


@dataclass(frozen=True, eq=False)
class _Outputs:
    """Displacements that must be accurate, and the loads that cause them.

    Attributes:
        targets: As of `reduced_basis`.
    """

    fixed: FixedInterface
    load_envelope: LoadEnvelope
    targets: Any

    def at_peaks(self, static: StaticModel) -> StaticModel:
        """The static behaviour under the peak loads, from that under unit loads."""
        return replace(static, loads=static.loads * peak_loads(self.load_envelope))

    def static_model(self, omega_squared: Array, modes: Array, patch_motion: Array) -> StaticModel:
        """The static behaviour of a basis of shapes [r], [3n, r] and [p, 6, r] under unit loads."""
        mesh, mass = self.fixed.model.mesh, self.fixed.model.mass
        n, r = len(mesh.nodes), len(omega_squared)
        weight = mass @ unit_accelerations(mesh.nodes).reshape(n, 36)
        inertia = modes.T @ weight.reshape(3 * n, 12)
        # a wrench does work only on the motion of its patch
        loads = np.hstack([inertia, patch_motion.reshape(-1, r).T])
        nodal = modes.reshape(n, 3, r)
        outputs = [patch_motion[:, :3], self.load_envelope.lever_arm[:, None, None] * patch_motion[:, 3:]]
        if self.targets is not None:
            outputs.append(self.targets(nodal))
        if sum(map(len, outputs)) == 0:
            surface = mesh.surface_nodes
            outputs.append(nodal[surface[:: max(1, len(surface) // _OUTPUTS)]])
        return StaticModel(omega_squared, loads, np.concatenate(outputs))


def _chosen(fixed: FixedInterface, outputs: _Outputs, settings: FlexibleSettings, tolerance: float) -> Basis:
    """The smallest basis within the tolerance."""
    limit = frequency_limit(settings, _BAND * outputs.load_envelope.frequency)
    columns, U, units = _candidates(fixed, outputs, limit)
    static = outputs.at_peaks(units)
    if not outputs.load_envelope.directed:
        used, size = _used(outputs), box_diagonal(fixed.model.mesh.nodes)
        angle = largest_displacement(static.response) / size
        outputs = replace(outputs, load_envelope=load_direction_envelope(outputs.load_envelope, angle, size))
        if not np.array_equal(used, _used(outputs)):  # else the same vectors, whatever the sizes of their loads
            columns, U, units = _candidates(fixed, outputs, limit)
        static = outputs.at_peaks(units)
    kept = static.omega_squared <= (2.0 * np.pi * limit) ** 2
    if settings.max_frequency < 0.0:
        kept |= largest_displacement_by_mode(static) * _dynamic_part(static.omega_squared, limit) > tolerance
    combination, residual, error = needed_coordinates(static, kept, tolerance)
    if outputs.load_envelope.closed_chain and combination.shape[1]:
        # In a closed chain, a motion of an interface for which a body has no coordinate is locked, and with it all
        # motions that are coupled to it even slightly.
        scaled = _scaled_wrenches(static, tolerance)
        combination, residual, _ = needed_coordinates(scaled, kept, tolerance)
    omega_squared = np.einsum("ij,i,ij->j", combination, static.omega_squared, combination)
    basis = _basis(fixed, columns, omega_squared, U @ combination, int(residual.sum()))
    return replace(basis, cut_error_m=error, load_envelope=outputs.load_envelope)


def _used(outputs: _Outputs) -> BoolArray:
    """The unit accelerations that act, shape [12]."""
    return np.asarray(peak_loads(outputs.load_envelope)[:ACCELERATIONS] > 0.0)


def _scaled_wrenches(static: StaticModel, tolerance: float) -> StaticModel:
    """The static model with every wrench scaled so that its response exceeds the tolerance."""
    size = np.linalg.norm(static.response[:, :, ACCELERATIONS:], axis=1).max(axis=0, initial=0.0)
    factor = np.ones(static.loads.shape[1])
    factor[ACCELERATIONS:] = np.maximum(1.0, _COUPLED * tolerance / np.maximum(size, 1e-300))
    return replace(static, loads=static.loads * factor)


def _dynamic_part(omega_squared: Array, limit: float) -> Array:
    """Dynamic amplification of modes by a load of at most a frequency [Hz], minus one.

    A mode above the limit responds by 1 / (1 - r^2) times its static response, r the ratio of the frequencies. Where
    the frequency is not known, the result is one.
    """
    if limit <= 0.0:
        return np.ones_like(omega_squared)
    squared = np.minimum((2.0 * np.pi * limit) ** 2 / omega_squared, 0.5)
    return squared / (1.0 - squared)


def _with_error(basis: Basis, outputs: _Outputs, limit: float) -> Basis:
    """The basis with the difference between its static responses and the exact ones."""
    exact = outputs.at_peaks(_candidates(outputs.fixed, outputs, limit)[2])
    flat = basis.modes.reshape(-1, len(basis.omega_squared))
    reduced = outputs.at_peaks(outputs.static_model(basis.omega_squared, flat, basis.patch_motion))
    return replace(basis, cut_error_m=largest_displacement(exact.response - reduced.response))


def _candidates(fixed: FixedInterface, outputs: _Outputs, limit: float) -> tuple[Array, Array, StaticModel]:
    """Columns, their combinations and the static model under unit loads of all modes up to a frequency [Hz] and above,
    with all residual vectors: the static response is that of the full model."""
    columns = fixed.all_needed(limit, peak_loads(outputs.load_envelope)[:ACCELERATIONS])
    omega_squared, U = ritz_modes(fixed.model, columns)
    motion = U[: 6 * len(fixed.patches)].reshape(len(fixed.patches), 6, U.shape[1])
    return columns, U, outputs.static_model(omega_squared, columns @ U, motion)
