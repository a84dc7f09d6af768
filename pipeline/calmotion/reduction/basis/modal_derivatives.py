"""Modal derivatives: the change of modes with the deflection, without which a nonlinear body is far too stiff.

A bending mode alone stretches a link, because its points move on straight lines. The static modal derivative of two
modes is the second-order displacement that keeps the body in equilibrium while both grow: with it the link bends
without stretching, and an axial force stiffens it.

Source: Idelsohn and Cardona, A reduction method for nonlinear structural dynamic analysis, 1985; Wu and Tiso,
Nonlinear model order reduction for flexible multibody dynamics: a modal derivatives approach, 2016; Barbic and
James 2005 (the choice by amplitude).
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh

from calmotion.arrays import Array, IntArray
from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.model.character import ElasticMaterial
from calmotion.reduction.basis.craig_bampton import Basis, mode_signs
from calmotion.reduction.basis.fixed_interface import FixedInterface
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.elastic_forms import LAW_ORDER, GradientRule, lame_constants
from calmotion.reduction.elements.patch_rotation import (
    shape_changes,
    spring_rows,
    springs,
    square_fields,
    squares,
    stiffness_of,
)
from calmotion.support import interrupts

MOST = 40  # directions of derivatives that are kept; the cost goes with the fourth power (samples have up to 37)
_AT_ONCE = 32  # right-hand sides that are solved together: of more, the memory alone grows
NEGLIGIBLE = 1e-3  # square root of the negligible share of the largest strain energy among the derivatives


@dataclass(frozen=True, eq=False)
class Support:
    """Supports of a body: the nodes of the clamped root patch, and the rigid moving patches with their centers."""

    root: IntArray
    patches: Sequence[IntArray]
    centers: Sequence[Array]
    _fixed: dict[FEModel, FixedInterface] = field(default_factory=dict, init=False, repr=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False, repr=False)

    def known(self, model: FEModel, fixed: FixedInterface) -> Support:
        """This support, with what `fixed` gives for a model."""
        self._fixed[model] = fixed
        return self

    def fixed(self, model: FEModel) -> FixedInterface:
        """The body with all interfaces fixed, factorised once.

        Args:
            model: Of the body.

        Raises:
            NotPositiveDefinite: The root patch does not constrain all rigid motions of the body.
        """
        with self._lock:  # links that are alike are reduced in several threads
            if model in self._fixed:
                return self._fixed[model]
            with one_blas_thread():
                self._fixed[model] = FixedInterface.of(model, self.root, self.patches, self.centers)
        return self._fixed[model]


@dataclass(frozen=True, eq=False)
class Derivatives:
    """The second order of a body's deflection.

    Attributes:
        count: Number c of modes that are paired.
        fields: theta_ij with x = sum phi_i u_i + sum_ij theta_ij u_i u_j / 2 to second order, i <= j, shape
            [n, 3, c (c + 1) / 2].
        motion: Motion of each patch in the fields (translation, rotation vector), shape [p, 6, c (c + 1) / 2].
        changes: Changes of shape of rotating patches, see `patch_rotation`, orthonormal, shape [p, 6, s].
        change_sizes: Size of each change in the fields, shape [s, c (c + 1) / 2].
        shapes: Response of the body to each change, shape [n, 3, s].
        shape_motion: Motion of each patch in this response, shape [p, 6, s].
    """

    count: int
    fields: Array
    motion: Array
    changes: Array
    change_sizes: Array
    shapes: Array
    shape_motion: Array


def modal_derivatives(
    model: FEModel, support: Support, basis: Basis, count: int, material: ElasticMaterial, law: str,
    known: Derivatives | None = None,
) -> Derivatives:  # fmt: skip
    """Modal derivatives of the first modes of a basis.

    Args:
        model: Full model, n nodes.
        support: Its root patch is clamped. The second order of the finite rotation of each of the other p patches is
            imposed; otherwise they are free to move as rigid bodies.
        basis: Mass-orthonormal modes.
        count: Number c of modes that are paired.
        material: Elastic constants.
        law: `stvk` or `neohookean`.
        known: Those of fewer of its first modes, with the same law.
    """
    nodes = model.mesh.nodes
    n, p = len(nodes), len(support.patches)
    lame, mu = lame_constants(material.youngs_modulus, material.poissons_ratio)
    rule = GradientRule(model.mesh, LAW_ORDER)
    gradients = np.ascontiguousarray(rule.gradients(np.ascontiguousarray(basis.modes[:, :, :count])))
    first, second = np.triu_indices(count)
    pairs = len(first)
    arms = [nodes[patch] - center for patch, center in zip(support.patches, support.centers, strict=True)]
    patch_changes = [shape_changes(arm) for arm in arms]
    changes = np.zeros((p, 6, sum(change.shape[1] for change in patch_changes)))
    at = 0
    for k, change in enumerate(patch_changes):
        changes[k, :, at : at + change.shape[1]] = change
        at += change.shape[1]
    change_sizes = np.einsum("pms,pmq->sq", changes, squares(basis.patch_motion[:, 3:, :count]))
    fields, motion = np.empty((n, 3, pairs)), np.empty((p, 6, pairs))
    shapes, shape_motion = np.empty((n, 3, at)), np.empty((p, 6, at))
    first_new = 0 if known is None else known.count
    new = np.append(np.flatnonzero(second >= first_new), pairs + np.arange(at))
    sizes = np.hstack([change_sizes, np.eye(at)])
    for start in range(0, len(new), _AT_ONCE):
        some = new[start : start + _AT_ONCE]
        force, imposed = np.zeros((n, 3, len(some))), np.zeros((n, 3, len(some)))
        for k, pair in enumerate(some[some < pairs]):
            interrupts.check()
            force[:, :, k] = rule.second_order_force(gradients[first[pair]], gradients[second[pair]], lame, mu, law)
        for k, (patch, arm) in enumerate(zip(support.patches, arms, strict=True)):
            imposed[patch] = square_fields(arm) @ changes[k] @ sizes[:, some]
        flat, moved = support.fixed(model).balance(-force.reshape(3 * n, -1), imposed.reshape(3 * n, -1))
        found, paired = flat.reshape(n, 3, -1), some < pairs
        fields[:, :, some[paired]], motion[:, :, some[paired]] = found[:, :, paired], moved[:, :, paired]
        others = some[~paired] - pairs
        shapes[:, :, others], shape_motion[:, :, others] = found[:, :, ~paired], moved[:, :, ~paired]
    if known is not None:
        old = np.flatnonzero(second < first_new)
        fields[:, :, old], motion[:, :, old] = known.fields, known.motion
    return Derivatives(count, fields, motion, changes, change_sizes, shapes, shape_motion)


def extended_basis(
    model: FEModel, support: Support, basis: Basis, count: int, material: ElasticMaterial, law: str,
    negligible: float = NEGLIGIBLE, deflections: Array | None = None, stiff: float = 1.0,
    known: Derivatives | None = None,
) -> Basis:  # fmt: skip
    """A basis and the modal derivatives of its first modes, made mass-orthonormal.

    A derivative is weighted by the deflections of its modes under the same load (by 1/omega^2), or, where the bending
    of other modes or the loads move them farther, by that; directions whose strain energy is negligible with these
    weights are dropped. Without these, more modes made a link of 0.29 m with a deflection of 27 mm stiffer, by 1.4%.
    The changes of shape of rotating patches are coordinates of their own, which penalty springs couple to the rotations
    (see `patch_rotation`).

    Args:
        model, support, basis, material, law: As of `modal_derivatives`.
        count: Number of the first modes that are paired.
        negligible: Square root of the negligible share of the largest strain energy among the derivatives.
        deflections: Amplitude of each mode by the loads; None: not known.
        stiff: As of `patch_rotation.springs`.
        known: As of `modal_derivatives`.

    Returns:
        The basis: its stiffness, with that of the springs, is diagonal; its lowest modes are nearly those of `basis`.
    """
    count = min(count, len(basis.omega_squared))
    if count == 0:
        return basis
    derivatives = modal_derivatives(model, support, basis, count, material, law, known)
    n, p = len(model.mesh.nodes), len(support.patches)
    amplitude = static = basis.omega_squared[0] / basis.omega_squared[:count]
    if deflections is not None:
        amplitude = np.maximum(static, _moved(model, basis, derivatives, deflections[:count]))
    first, second = np.triu_indices(count)
    weight, static_weight = amplitude[first] * amplitude[second], static[first] * static[second]
    change_sizes = derivatives.change_sizes * weight
    shapes, shape_motion = derivatives.shapes.reshape(3 * n, -1), derivatives.shape_motion
    # the derivatives without changes of shape, and the responses to these changes
    extra = derivatives.fields.reshape(3 * n, -1) * weight
    extra -= shapes @ change_sizes
    moved = derivatives.motion * weight - shape_motion @ change_sizes
    K = model.stiffness
    modes = basis.modes.reshape(3 * n, -1)
    for _ in range(2):  # the second pass removes the rounding of the first
        extra, moved = _without_modes(modes, basis.patch_motion, model, extra, moved)
        shapes, shape_motion = _without_modes(modes, basis.patch_motion, model, shapes, shape_motion)
    # Those that matter by either weight are kept. By the second alone, the energy of stiff modes that bending moves far
    # would hide the derivatives of the bending itself.
    strain_energy = extra.T @ (K @ extra)
    share = static_weight / weight
    first_energy = max(float(np.linalg.eigvalsh(strain_energy * np.outer(share, share))[-1]), np.finfo(float).tiny)
    second_energy = max(float(np.linalg.eigvalsh(strain_energy)[-1]), np.finfo(float).tiny)
    scale = np.sqrt(np.maximum(share**2 / first_energy, 1.0 / second_energy))
    extra, moved, change_sizes = extra * scale, moved * scale, change_sizes * scale
    kept, dropped = _largest(strain_energy * np.outer(scale, scale), negligible**2)
    extra, moved = extra @ kept, moved @ kept
    # the changes of shape that rotations of the patches cause; a missing one would make the springs resist the rotation
    root = _root(shapes.T @ (K @ shapes))
    strain, strength, _ = np.linalg.svd(root @ change_sizes, full_matrices=False)
    most = max((stiffness_of(int(own.any(axis=0).sum()), stiff) for own in derivatives.changes), default=0.0)
    taken = np.linalg.pinv(root) @ strain[:, most * strength**2 > negligible**2]
    ritz = np.hstack([modes, extra, shapes @ taken])
    motion = np.concatenate([basis.patch_motion, moved, shape_motion @ taken], axis=2)
    none = np.zeros((p, 6, modes.shape[1] + extra.shape[1]))
    shape = np.concatenate([none, derivatives.changes @ taken], axis=2)
    roots = springs(model.mesh.nodes, support.patches, material.youngs_modulus, stiff)
    extension = spring_rows(roots, shape, np.zeros((p, 3, ritz.shape[1])))[:, : ritz.shape[1]]
    added = extension.T @ extension if law == "stvk" else 0.0
    omega_squared, U = _orthonormal(ritz.T @ model.momentum(ritz), ritz.T @ (K @ ritz) + added)
    result = ritz @ U
    sign = mode_signs(result)
    U, result = U * sign, result * sign
    return Basis(
        np.ascontiguousarray(result.reshape(n, 3, -1)),
        omega_squared,
        np.ascontiguousarray(motion @ U),
        patch_squares=np.ascontiguousarray(shape @ U),
        first_order=result.T @ model.momentum(modes),
        second_order=result.T @ model.momentum(derivatives.fields.reshape(3 * n, -1)),
        dropped=dropped,
    )


def _largest(energy: Array, negligible: float) -> tuple[Array, float]:
    """Directions of the largest energies, and that of the largest which there is no room for; 0 without one."""
    values, directions = np.linalg.eigh(energy)
    first = len(values) - min(int(np.count_nonzero(values > negligible)), MOST)
    left = float(values[:first].max(initial=0.0))
    return directions[:, first:], left if left > negligible else 0.0


def _moved(model: FEModel, basis: Basis, derivatives: Derivatives, deflections: Array) -> Array:
    """How far modes move by the loads, or to second order where they bend together, over the first one, shape [c].

    A bending mode of large deflection moves axial and higher modes far more than the loads do.

    Args:
        deflections: Amplitude of each of the c modes that are paired by the loads.
    """
    count = len(deflections)
    modes = basis.modes[:, :, :count].reshape(-1, count)
    share = modes.T @ model.momentum(derivatives.fields.reshape(len(modes), -1))
    first, second = np.triu_indices(count)
    pairs = np.where(first == second, 0.5, 1.0) * deflections[first] * deflections[second]
    moved = np.linalg.norm(share * pairs, axis=1)
    largest = np.maximum(deflections, moved)
    return np.asarray(np.minimum(largest / max(deflections[0], np.finfo(float).tiny), 1.0))


def _without_modes(
    modes: Array, patch_motion: Array, model: FEModel, fields: Array, motion: Array
) -> tuple[Array, Array]:
    """Fields and the motion of their patches, made mass-orthogonal to the modes."""
    share = modes.T @ model.momentum(fields)
    return fields - modes @ share, motion - patch_motion @ share


def _root(K: Array) -> Array:
    """Symmetric square root of a semidefinite matrix."""
    values, vectors = np.linalg.eigh(K)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def _orthonormal(M: Array, K: Array) -> tuple[Array, Array]:
    """Eigenvalues and mass-orthonormal eigenvectors of K and M of columns that may be nearly parallel."""
    scale = 1.0 / np.sqrt(np.diag(M))
    # the normalisation would amplify the rounding of nearly parallel directions
    values, vectors = np.linalg.eigh(M * np.outer(scale, scale))
    T = scale[:, None] * (vectors[:, values > 1e-10] / np.sqrt(values[values > 1e-10]))
    K = T.T @ K @ T
    omega_squared, U = eigh(0.5 * (K + K.T))
    return omega_squared, T @ U
