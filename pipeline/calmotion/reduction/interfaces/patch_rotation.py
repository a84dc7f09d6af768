"""Patches that stay rigid when they turn by a finite angle, in coordinates that move points on straight lines.

To second order a rotation by rho moves a point at X from the center by rho x X + (S - tr(S) E) X, S = rho rho^T / 2.
Modes hold the first part; the second is a coordinate by itself, six entries for each patch. Left alone they would let
the patch shrink and stretch without turning, and with it the link be softer at its ends than one clamped to a rigid
neighbour: by a thousandth of its deflection, and by far more of its motion after some swings. Stiff springs on the
Green strain of the patch, (H + H^T + H^T H) / 2 with H the gradient of that displacement, keep it rigid in turns of any
size. The strain is linear in z(u) = (u_k; u_k u_l), as that of the body is, so the springs are a few more rows of
their Gram matrix and cost nothing in a simulation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calmotion.reduction.interfaces.rigid_patch import rigid_patch
from calmotion.shot.character import Array, IntArray

# Times Young's modulus times the reach cubed [J]. It leaves 2e-5 of a link's compliance in bending too much; ten times
# more takes digits from Newton's method, and three times as many of its steps where a link bends far.
STIFF = 30.0
_FLAT = 1e-3  # share of the largest that a patch's points must move by (squared) for a change of its shape
_ROWS, _COLUMNS = (0, 1, 2, 1, 0, 0), (0, 1, 2, 2, 2, 1)  # of the six entries of a symmetric matrix


def squares(rotation: Array) -> Array:
    """sym(rho_i rho_j^T) of all pairs i <= j of modes, shape [p, 6, c (c + 1) / 2].

    Args:
        rotation: Rotation vector of each patch in each mode, shape [p, 3, c].
    """
    first, second = np.triu_indices(rotation.shape[2])
    a, b = rotation[:, :, first], rotation[:, :, second]
    return np.stack(
        [0.5 * (a[:, i] * b[:, j] + a[:, j] * b[:, i]) for i, j in zip(_ROWS, _COLUMNS, strict=True)], axis=1
    )


def square_fields(arms: Array) -> Array:
    """Displacement (S - tr(S) E) X of points X for each entry of S alone, shape [k, 3, 6].

    Args:
        arms: X, shape [k, 3].
    """
    fields = np.zeros((len(arms), 3, 6))
    for m, (i, j) in enumerate(zip(_ROWS, _COLUMNS, strict=True)):
        if i == j:
            fields[:, :, m] = -arms
            fields[:, i, m] = 0.0
        else:
            fields[:, i, m], fields[:, j, m] = arms[:, j], arms[:, i]
    return fields


def shape_changes(arms: Array) -> Array:
    """Combinations of the entries of S that change the shape of a patch, orthonormal, shape [6, g].

    All six do where its points fill space. Those of a plane turn as a whole with the two that shear its normal: such
    count as turns, and a plane that is bent and twisted at once has its turn to first order alone.

    Args:
        arms: Points of the patch from its center, shape [k, 3].
    """
    rigid = rigid_patch(arms, np.zeros(3)).reshape(-1, 6)
    fields = square_fields(arms).reshape(-1, 6)
    own = fields - rigid @ np.linalg.lstsq(rigid, fields, rcond=None)[0]
    values, vectors = np.linalg.eigh(own.T @ own)
    return vectors[:, values > _FLAT * max(float(np.linalg.eigvalsh(fields.T @ fields)[-1]), np.finfo(float).tiny)]


def springs(nodes: Array, patches: Sequence[IntArray], centers: Sequence[Array], youngs_modulus: float) -> Array:
    """Square roots of the springs' stiffness by strain, shape [p, 6, 6]: their energy is |root E|^2 / 2 [J].

    They see the distances of a patch's points: with W the second moment of these, of unit trace, the energy is that of
    W^1/2 E W^1/2, in which the normal of a plane has no part.

    Args:
        nodes: Shape [n, 3] [m].
        patches, centers: As of `modal_derivatives.Support`.
        youngs_modulus: [Pa].

    Returns:
        For the entries 00, 11, 22, 12, 02, 01 of a uniform strain E of each patch.
    """
    roots = np.zeros((len(patches), 6, 6))
    for root, patch, center in zip(roots, patches, centers, strict=True):
        arms = nodes[patch] - center
        squared = np.einsum("ki,ki->k", arms, arms)
        if not squared.any():
            continue  # a point has no shape
        W = arms.T @ arms / squared.sum()
        strains = np.zeros((6, 3, 3))
        for m, (i, j) in enumerate(zip(_ROWS, _COLUMNS, strict=True)):
            strains[m, i, j] = strains[m, j, i] = 1.0
        form = np.einsum("aij,jk,bkl,li->ab", strains, W, strains, W)
        values, vectors = np.linalg.eigh(STIFF * youngs_modulus * squared.max() ** 1.5 * form)
        root[:] = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return roots


def spring_rows(roots: Array, held: Array, rotation: Array, directions: Array | None = None) -> Array:
    """Rows w with w z(u) the springs' extension, shape [6 p, r + d (d + 1) / 2]: w^T w is their Gram matrix.

    Args:
        roots: As of `springs`.
        held: S of each mode, shape [p, 6, r].
        rotation: Rotation vector of each patch in each mode, shape [p, 3, r].
        directions: As of `elastic_forms.strain_gram`, shape [r, d]; None: all coordinates.
    """
    p, r = len(rotation), rotation.shape[2]
    H = np.zeros((p, r, 3, 3))  # gradient of the patch's displacement in each mode
    for m, (i, j) in enumerate(zip(_ROWS, _COLUMNS, strict=True)):
        H[:, :, i, j] = H[:, :, j, i] = held[:, m]
    H -= np.trace(H, axis1=2, axis2=3)[:, :, None, None] * np.eye(3)
    strain = H.copy()
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        H[:, :, k, j] += rotation[:, i]
        H[:, :, j, k] -= rotation[:, i]
    turns = H if directions is None else np.einsum("pkij,kd->pdij", H, directions)
    first, second = np.triu_indices(turns.shape[1])
    product = np.einsum("pkij,pkil->pkjl", turns[:, first], turns[:, second])
    pairs = 0.5 * (product + np.swapaxes(product, 2, 3))
    pairs[:, first == second] *= 0.5  # u_k^2 stands once, u_k u_l for both orders
    entries = np.concatenate([strain, pairs], axis=1)[:, :, _ROWS, _COLUMNS]
    return (roots @ np.swapaxes(entries, 1, 2)).reshape(6 * p, entries.shape[1])
