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
from dataclasses import dataclass

import numpy as np

from ..shot.character import Array, ElasticMaterial, IntArray
from .assembly import FEModel
from .craig_bampton import Basis, mode_signs, rigid_patch
from .elastic_forms import GradientRule, lame_constants, second_order_force
from .natural_modes import SparseSolver, vector_mass

_REACH = 0.1  # of the body's size: how far the largest mode deflects when derivatives are weighed
_NEGLIGIBLE = 1e-4  # of the largest strain energy among the derivatives, in the square root


@dataclass(frozen=True, eq=False)
class Support:
    """What holds a body: the clamped nodes, and patches that move as rigid ones about their centers."""

    root: IntArray
    patches: Sequence[IntArray]
    centers: Sequence[Array]


def modal_derivatives(
    model: FEModel, support: Support, basis: Basis, count: int, material: ElasticMaterial, law: str
) -> tuple[Array, Array]:
    """Modal derivatives of the lowest modes of a basis.

    Args:
        model: Full model, n nodes.
        support: Its root patch is held; each other patch turns by a finite rotation about its center, whose second
            order is imposed, and is otherwise free to move as a rigid one.
        basis: Mass-orthonormal modes.
        count: How many of its modes are paired, c.
        material: Elastic constants.
        law: `stvk` or `neohookean`.

    Returns:
        Fields theta_ij with x = sum phi_i u_i + sum_ij theta_ij u_i u_j / 2 to second order, i <= j, shape
        [n, 3, c (c + 1) / 2], and the motion of each patch (translation, rotation vector), shape
        [p, 6, c (c + 1) / 2].
    """
    nodes = model.mesh.nodes
    n = len(nodes)
    lame, mu = lame_constants(material.youngs_modulus, material.poissons_ratio)
    rule = GradientRule(model.mesh, 4)  # three gradients multiplied: cubic
    gradients = rule.gradients(np.ascontiguousarray(basis.modes[:, :, :count]))
    first, second = np.triu_indices(count)
    force = np.zeros((n, 3, len(first)))
    bent = np.zeros((n, 3, len(first)))
    for p, (i, j) in enumerate(zip(first, second, strict=True)):
        force[:, :, p] = second_order_force(rule, gradients[i], gradients[j], lame, mu, law)
        for patch, center, motion in zip(support.patches, support.centers, basis.patch_motion, strict=True):
            arm = nodes[patch] - center
            a, b = motion[3:, i], motion[3:, j]
            bent[patch, :, p] = 0.5 * (np.cross(a, np.cross(b, arm)) + np.cross(b, np.cross(a, arm)))
    fields, motion = _balance(model, support, force.reshape(3 * n, -1), bent.reshape(3 * n, -1))
    return fields.reshape(n, 3, -1), motion


def _balance(model: FEModel, support: Support, force: Array, bent: Array) -> tuple[Array, Array]:
    """Displacements under -force with `bent` imposed on the patches on top of a free rigid motion."""
    from scipy.sparse import coo_matrix, hstack

    nodes, n = model.mesh.nodes, len(model.mesh.nodes)
    free = np.ones(n, dtype=bool)
    free[support.root] = False
    for patch in support.patches:
        free[patch] = False
    interior = np.flatnonzero(np.repeat(free, 3))
    unknown = [
        coo_matrix(
            (np.ones(len(interior)), (interior, np.arange(len(interior)))), shape=(3 * n, len(interior))
        )
    ]  # fmt: skip
    # rotations in units of the patch's reach: the matrix stays well scaled
    reach = []
    for patch, center in zip(support.patches, support.centers, strict=True):
        motion = rigid_patch(nodes[patch], center)
        reach.append(float(np.linalg.norm(nodes[patch] - center, axis=1).max()))
        motion[:, :, 3:] /= reach[-1]
        rows = (3 * np.asarray(patch, dtype=np.int64)[:, None] + np.arange(3)).ravel()
        values = motion.reshape(-1, 6)
        row, column = np.repeat(rows, 6), np.tile(np.arange(6), len(rows))
        unknown.append(coo_matrix((values.ravel(), (row, column)), shape=(3 * n, 6)))
    B = hstack(unknown, format="csr")
    K = (B.T @ model.stiffness @ B).tocsc()
    x = SparseSolver(K).solve(-(B.T @ (force + model.stiffness @ bent)))
    motion = x[len(interior) :].reshape(len(support.patches), 6, x.shape[1]).copy()
    for k, length in enumerate(reach):
        motion[k, 3:] /= length
    return B @ x + bent, motion


def extended_basis(
    model: FEModel, support: Support, basis: Basis, count: int, material: ElasticMaterial, law: str
) -> Basis:
    """A basis and the modal derivatives of its lowest modes, mass-orthonormal again.

    Derivatives are weighed by how far their modes deflect under one and the same load (as 1/omega^2); directions of
    negligible strain energy at that weight are dropped.

    Args:
        count: How many of the lowest modes are paired.

    Returns:
        The basis: its stiffness is diagonal and its lowest modes are (nearly) those given.
    """
    from scipy.linalg import eigh

    count = min(count, len(basis.omega_squared))
    if count == 0:
        return basis
    fields, motion = modal_derivatives(model, support, basis, count, material, law)
    n = len(model.mesh.nodes)
    size = float(np.linalg.norm(np.ptp(model.mesh.nodes, axis=0)))
    amplitude = basis.omega_squared[0] / basis.omega_squared[:count]
    amplitude *= _REACH * size / np.abs(basis.modes[:, :, :count]).max(axis=(0, 1))[0]
    first, second = np.triu_indices(count)
    weight = amplitude[first] * amplitude[second]
    M, K = vector_mass(model.mass), model.stiffness
    modes, extra = basis.modes.reshape(3 * n, -1), fields.reshape(3 * n, -1) * weight
    moved = motion * weight
    for _ in range(2):  # twice is enough
        share = modes.T @ (M @ extra)
        extra = extra - modes @ share
        moved = moved - basis.patch_motion @ share
    energy, directions = np.linalg.eigh(extra.T @ (K @ extra))
    keep = energy > _NEGLIGIBLE**2 * max(float(energy[-1]), np.finfo(float).tiny)
    extra, moved = extra @ directions[:, keep], moved @ directions[:, keep]
    ritz = np.hstack([modes, extra])
    ritz_motion = np.concatenate([basis.patch_motion, moved], axis=2)
    M_r = ritz.T @ (M @ ritz)
    scale = 1.0 / np.sqrt(np.diag(M_r))
    M_r *= np.outer(scale, scale)
    # nearly parallel directions would be blown up by the normalisation
    values, vectors = np.linalg.eigh(M_r)
    good = vectors[:, values > 1e-10] / np.sqrt(values[values > 1e-10])
    T = scale[:, None] * good
    K_r = T.T @ (ritz.T @ (K @ ritz)) @ T
    omega_squared, U = eigh(0.5 * (K_r + K_r.T))
    U = T @ U
    result = ritz @ U
    sign = mode_signs(result)
    return Basis(
        np.ascontiguousarray((result * sign).reshape(n, 3, -1)),
        omega_squared,
        np.ascontiguousarray(ritz_motion @ (U * sign)),
    )
