"""Finite rotations of interface patches in reduced coordinates, which are linear in the displacements.

To second order a rotation rho moves a point at X from the center by rho x X + (S - tr(S) E) X, S = rho rho^T / 2. Modes
represent the first term. The second term gets coordinates of its own, the six entries of S of each patch. Without a
constraint these coordinates would deform the patch without rotating it, and the link would be softer at its ends than
one that is clamped to a rigid neighbour: by a thousandth of its deflection, and by much more of its motion after some
swings. Stiff penalty springs on the Green strain of the patch, (H + H^T + H^T H) / 2 with H the gradient of this
displacement, keep the patch rigid at any rotation. This strain is linear in z(u) = (u_k; u_k u_l), as the strain of the
body is, so the springs are additional rows of the Gram matrix and cost nothing in a simulation.
"""

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array, IntArray

# Stiffness of the springs over Young's modulus times the cube of the patch's radius, of plane patches and of others, in
# reductions to a millimetre. With the first the bending compliance of a link with an end face is 2e-5 too large; deep
# seats, bearing bores and shafts in rings give way to it by 20, 2 and 0.6% of their compliance, to the second by 0.6,
# 0.08 and 0.02%. It goes with one over the stiffness: finer reductions have stiffer springs, and their difference tells
# it. These cost iterations of Newton's method: ten times the stiffness a fifth more time.
STIFF, STIFF_DEEP = 30.0, 1000.0
_ROUGH, _STIFFEST = 1e-3, 30.0  # reduction of these [m]; largest factor, where rounding begins to cost iterations
_DISC = 0.5  # W of a disc in its plane
_PLANE = 3  # changes of shape of a plane patch, at most
# Smallest eigenvalue of a change of shape, of the largest. Without the smaller ones a patch rotates to first order in
# them, and resists: with 0.1 a link with a rounded end was 0.4 to 0.9% too stiff at four degrees.
_FLAT = 1e-3
_ROUNDING = 1e-12  # likewise, of points on a line
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

    All six do where the points fill space. For points nearly in a plane, the two entries that shear its normal are
    rotations of the plane and are not counted; a plane that bends and twists at once is then rotated to first order
    only.

    Args:
        arms: Points of the patch from its center, shape [k, 3].
    """
    rigid = rigid_patch(arms, np.zeros(3)).reshape(-1, 6)
    arms = arms - arms.mean(axis=0)  # a patch moves as a whole by how far it is from its center
    fields = square_fields(arms).reshape(-1, 6)
    changes = fields - rigid @ np.linalg.lstsq(rigid, fields, rcond=None)[0]
    values, vectors = np.linalg.eigh(changes.T @ changes)
    # a thin face shrinks across by little; without a coordinate for that its turn strains the link as a wide face does
    _, middle, widest = np.linalg.eigvalsh(arms.T @ arms)
    thin = max(_FLAT * middle / max(widest, np.finfo(float).tiny), _ROUNDING)
    return vectors[:, values > thin * max(float(np.linalg.eigvalsh(fields.T @ fields)[-1]), np.finfo(float).tiny)]


def stiffer(tolerance: float) -> float:
    """Factor of the stiffness of the springs of patches that are not plane, in a reduction to a tolerance [m]."""
    return float(np.clip(_ROUGH / tolerance, 1.0, _STIFFEST))


def stiffness_of(changes: int, stiff: float = 1.0) -> float:
    """Stiffness of the springs of a patch with so many changes of shape, over E R^3; `stiff` is that of `stiffer`."""
    return STIFF if changes <= _PLANE else stiff * STIFF_DEEP


def springs(nodes: Array, patches: Sequence[IntArray], modulus: float, stiff: float = 1.0) -> Array:
    """Square roots of the stiffness of the penalty springs, shape [p, 6, 6]: their energy is |root E|^2 / 2 [J].

    With W the second moment of the patch's points, of unit trace, the energy is that of W^1/2 E W^1/2. Strains along
    the normal of a plane patch have no energy. In other patches the change of shape nearest to a strain in this norm
    counts, and all changes are equally stiff. Shearing the normal of a flat seat is nearly a rotation: with little
    energy, links of a KUKA tilted 22 to 36% too easily there.

    Args:
        nodes: Shape [n, 3] [m].
        patches: As of `modal_derivatives.Support`.
        modulus: Young's modulus [Pa].
        stiff: As of `stiffness_of`.

    Returns:
        Columns for the entries 00, 11, 22, 12, 02, 01 of a uniform strain E of each patch.
    """
    roots = np.zeros((len(patches), 6, 6))
    entries = np.zeros((6, 3, 3))
    for m, (i, j) in enumerate(zip(_ROWS, _COLUMNS, strict=True)):
        entries[m, i, j] = entries[m, j, i] = 1.0
    for root, patch in zip(roots, patches, strict=True):
        arms = nodes[patch] - nodes[patch].mean(axis=0)  # its strain does not depend on where its center is
        squared = np.einsum("ki,ki->k", arms, arms)
        changes = shape_changes(arms)
        if not changes.shape[1]:
            continue  # a single point cannot deform
        W = arms.T @ arms / squared.sum()
        values, vectors = np.linalg.eigh(np.einsum("aij,jk,bkl,li->ab", entries, W, entries, W))
        norm = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        if changes.shape[1] > _PLANE:
            S = np.tensordot(changes.T, entries, 1)
            strains = S - np.trace(S, axis1=1, axis2=2)[:, None, None] * np.eye(3)
            norm = _DISC * np.linalg.pinv(norm @ strains[:, _ROWS, _COLUMNS].T) @ norm
        stiffness = stiffness_of(changes.shape[1], stiff) * modulus * squared.max() ** 1.5
        root[: len(norm)] = np.sqrt(stiffness) * norm
    return roots


def spring_rows(roots: Array, second_order: Array, rotation: Array, directions: Array | None = None) -> Array:
    """Rows w such that w z(u) is the extension of the springs, shape [6 p, r + d (d + 1) / 2]; Gram matrix w^T w.

    Args:
        roots: As of `springs`.
        second_order: S of each mode, shape [p, 6, r].
        rotation: Rotation vector of each patch in each mode, shape [p, 3, r].
        directions: As of `elastic_forms.strain_gram`, shape [r, d]; None: all coordinates.
    """
    p, r = len(rotation), rotation.shape[2]
    H = np.zeros((p, r, 3, 3))  # gradient of the patch's displacement in each mode
    for m, (i, j) in enumerate(zip(_ROWS, _COLUMNS, strict=True)):
        H[:, :, i, j] = H[:, :, j, i] = second_order[:, m]
    H -= np.trace(H, axis1=2, axis2=3)[:, :, None, None] * np.eye(3)
    strain = H.copy()
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        H[:, :, k, j] += rotation[:, i]
        H[:, :, j, k] -= rotation[:, i]
    subspace = H if directions is None else np.einsum("pkij,kd->pdij", H, directions)
    first, second = np.triu_indices(subspace.shape[1])
    product = np.einsum("pkij,pkil->pkjl", subspace[:, first], subspace[:, second])
    pairs = 0.5 * (product + np.swapaxes(product, 2, 3))
    pairs[:, first == second] *= 0.5  # u_k u_l stands for both orders, u_k^2 for one
    entries = np.concatenate([strain, pairs], axis=1)[:, :, _ROWS, _COLUMNS]
    return np.asarray((roots @ np.swapaxes(entries, 1, 2)).reshape(6 * p, entries.shape[1]))


def rigid_patch(nodes: Array, center: Array) -> Array:
    """Displacement of nodes for a unit translation and a unit small rotation about `center`, shape [k, 3, 6]."""
    motion = np.zeros((len(nodes), 3, 6))
    motion[:, :, :3] = np.eye(3)
    for axis in range(3):
        motion[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes - center)
    return motion
