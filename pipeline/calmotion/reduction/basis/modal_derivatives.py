"""How modes change as a body deflects: the part of a basis without which a nonlinear body is far too stiff.

A bending mode alone stretches a link, since its points move on straight lines. The (static) modal derivative of two
modes is the second-order displacement that keeps the body in balance while both grow: with it, the link bends at
its length, and an axial force stiffens it.

Source: Idelsohn and Cardona, A reduction method for nonlinear structural dynamic analysis, 1985; Wu and Tiso,
Nonlinear model order reduction for flexible multibody dynamics: a modal derivatives approach, 2016; Barbic and
James 2005 (the choice by amplitude).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.reduction.basis.craig_bampton import Basis, mode_signs
from calmotion.reduction.basis.fixed_interface import FixedInterface
from calmotion.reduction.basis.natural_modes import vector_mass
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.elastic_forms import GradientRule, lame_constants, second_order_force
from calmotion.reduction.interfaces.patch_rotation import (
    STIFF,
    shape_changes,
    spring_rows,
    springs,
    square_fields,
    squares,
)
from calmotion.shot.character import Array, ElasticMaterial, IntArray

NEGLIGIBLE = 1e-3  # of the largest strain energy among the derivatives, in the square root


@dataclass(frozen=True, eq=False)
class Support:
    """What holds a body: the clamped nodes, and patches that move as rigid ones about their centers."""

    root: IntArray
    patches: Sequence[IntArray]
    centers: Sequence[Array]
    _fixed: dict[FEModel, FixedInterface] = field(default_factory=dict, init=False, repr=False)

    def fixed(self, model: FEModel) -> FixedInterface:
        """The body with every patch held, factorised once.

        Raises:
            NotPositiveDefinite: The root patch does not hold the body.
        """
        if model not in self._fixed:
            with one_blas_thread():
                self._fixed[model] = FixedInterface.of(model, self.root, self.patches, self.centers)
        return self._fixed[model]


@dataclass(frozen=True, eq=False)
class Derivatives:
    """The second order of a body's deflection.

    Attributes:
        fields: theta_ij with x = sum phi_i u_i + sum_ij theta_ij u_i u_j / 2 to second order, i <= j, shape
            [n, 3, c (c + 1) / 2].
        motion: Of each patch in them (translation, rotation vector), shape [p, 6, c (c + 1) / 2].
        changes: Shapes that patches may take as they turn, see `patch_rotation`, orthonormal, shape [p, 6, s].
        held: What the fields hold of them, shape [s, c (c + 1) / 2].
        shapes: Response of the body to each change alone, shape [n, 3, s].
        shape_motion: Of each patch in it, shape [p, 6, s].
    """

    fields: Array
    motion: Array
    changes: Array
    held: Array
    shapes: Array
    shape_motion: Array


def modal_derivatives(
    model: FEModel, support: Support, basis: Basis, count: int, material: ElasticMaterial, law: str
) -> Derivatives:
    """Modal derivatives of the first modes of a basis.

    Args:
        model: Full model, n nodes.
        support: Its root patch is held; each of the other p turns by a finite rotation about its center, whose second
            order is imposed, and is otherwise free to move as a rigid one.
        basis: Mass-orthonormal modes.
        count: How many of its modes are paired, c.
        material: Elastic constants.
        law: `stvk` or `neohookean`.
    """
    nodes = model.mesh.nodes
    n, p = len(nodes), len(support.patches)
    lame, mu = lame_constants(material.youngs_modulus, material.poissons_ratio)
    rule = GradientRule(model.mesh, 3)  # three gradients multiplied: cubic
    gradients = rule.gradients(np.ascontiguousarray(basis.modes[:, :, :count]))
    first, second = np.triu_indices(count)
    pairs = len(first)
    arms = [nodes[patch] - center for patch, center in zip(support.patches, support.centers, strict=True)]
    own = [shape_changes(arm) for arm in arms]
    changes = np.zeros((p, 6, sum(change.shape[1] for change in own)))
    at = 0
    for k, change in enumerate(own):
        changes[k, :, at : at + change.shape[1]] = change
        at += change.shape[1]
    force = np.zeros((n, 3, pairs + at))
    bent = np.zeros((n, 3, pairs + at))
    for k, (i, j) in enumerate(zip(first, second, strict=True)):
        force[:, :, k] = second_order_force(rule, gradients[i], gradients[j], lame, mu, law)
    held = np.einsum("pms,pmq->sq", changes, squares(basis.patch_motion[:, 3:, :count]))
    for k, (patch, arm) in enumerate(zip(support.patches, arms, strict=True)):
        bent[patch] = square_fields(arm) @ changes[k] @ np.hstack([held, np.eye(at)])
    flat, motion = support.fixed(model).balance(-force.reshape(3 * n, -1), bent.reshape(3 * n, -1))
    fields = flat.reshape(n, 3, -1)
    return Derivatives(
        fields[:, :, :pairs], motion[:, :, :pairs], changes, held, fields[:, :, pairs:], motion[:, :, pairs:]
    )


def extended_basis(
    model: FEModel, support: Support, basis: Basis, count: int, material: ElasticMaterial, law: str,
    negligible: float = NEGLIGIBLE,
) -> Basis:  # fmt: skip
    """A basis and the modal derivatives of its first modes, mass-orthonormal again.

    Derivatives are weighed by how far their modes deflect under one and the same load (as 1/omega^2); directions of
    negligible strain energy at that weight are dropped. The shapes of turning patches are coordinates by themselves,
    held to the turns by springs (see `patch_rotation`).

    Args:
        count: How many of the first modes are paired.
        negligible: Share of the largest strain energy among the derivatives, in the square root.

    Returns:
        The basis: its stiffness, with that of the springs, is diagonal and its lowest modes are (nearly) those given.
    """
    count = min(count, len(basis.omega_squared))
    if count == 0:
        return basis
    found = modal_derivatives(model, support, basis, count, material, law)
    n, p = len(model.mesh.nodes), len(support.patches)
    amplitude = basis.omega_squared[0] / basis.omega_squared[:count]
    first, second = np.triu_indices(count)
    weight = amplitude[first] * amplitude[second]
    held = found.held * weight
    shapes, shape_motion = found.shapes.reshape(3 * n, -1), found.shape_motion
    # the derivatives with patches of fixed shape, and the shapes
    extra = found.fields.reshape(3 * n, -1) * weight - shapes @ held
    moved = found.motion * weight - shape_motion @ held
    M, K = vector_mass(model.mass), model.stiffness
    modes = basis.modes.reshape(3 * n, -1)
    for _ in range(2):  # twice is enough
        extra, moved = _less(modes, basis.patch_motion, M, extra, moved)
        shapes, shape_motion = _less(modes, basis.patch_motion, M, shapes, shape_motion)
    energy, directions = np.linalg.eigh(extra.T @ (K @ extra))
    dropped = negligible**2 * max(float(energy[-1]), np.finfo(float).tiny)
    keep = directions[:, energy > dropped]
    extra, moved = extra @ keep, moved @ keep
    # of the shapes those that turns of the patches bring about; the springs would resist with one that is missing
    root = _root(shapes.T @ (K @ shapes))
    strain, strength, _ = np.linalg.svd(root @ held, full_matrices=False)
    taken = np.linalg.pinv(root) @ strain[:, STIFF * strength**2 > dropped]
    ritz = np.hstack([modes, extra, shapes @ taken])
    motion = np.concatenate([basis.patch_motion, moved, shape_motion @ taken], axis=2)
    none = np.zeros((p, 6, modes.shape[1] + extra.shape[1]))
    shape = np.concatenate([none, found.changes @ taken], axis=2)
    roots = springs(model.mesh.nodes, support.patches, support.centers, material.youngs_modulus)
    extension = spring_rows(roots, shape, np.zeros((p, 3, ritz.shape[1])))[:, : ritz.shape[1]]
    added = extension.T @ extension if law == "stvk" else 0.0
    omega_squared, U = _orthonormal(ritz.T @ (M @ ritz), ritz.T @ (K @ ritz) + added)
    result = ritz @ U
    sign = mode_signs(result)
    U, result = U * sign, result * sign
    return Basis(
        np.ascontiguousarray(result.reshape(n, 3, -1)),
        omega_squared,
        np.ascontiguousarray(motion @ U),
        patch_squares=np.ascontiguousarray(shape @ U),
        first_order=result.T @ (M @ modes),
        second_order=result.T @ (M @ found.fields.reshape(3 * n, -1)),
    )


def _less(modes: Array, patch_motion: Array, M: Any, fields: Array, motion: Array) -> tuple[Array, Array]:
    """Fields and their patches' motion without what they have of the modes."""
    share = modes.T @ (M @ fields)
    return fields - modes @ share, motion - patch_motion @ share


def _root(K: Array) -> Array:
    """Symmetric square root of a semidefinite matrix."""
    values, vectors = np.linalg.eigh(K)
    return (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T


def _orthonormal(M: Array, K: Array) -> tuple[Array, Array]:
    """Eigenvalues and mass-orthonormal eigenvectors of K and M, of which columns may be nearly parallel."""
    from scipy.linalg import eigh

    scale = 1.0 / np.sqrt(np.diag(M))
    # nearly parallel directions would be blown up by the normalisation
    values, vectors = np.linalg.eigh(M * np.outer(scale, scale))
    T = scale[:, None] * (vectors[:, values > 1e-10] / np.sqrt(values[values > 1e-10]))
    K = T.T @ K @ T
    omega_squared, U = eigh(0.5 * (K + K.T))
    return omega_squared, T @ U
