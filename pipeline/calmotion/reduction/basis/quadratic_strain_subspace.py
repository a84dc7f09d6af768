"""Subspace of the quadratic strain of a body.

The Gram matrix of all pairs of r coordinates has r^4 / 4 entries. The quadratic strain G^T G depends on the
displacement gradient G, and the rotations of a body that deflects lie nearly in a subspace of few dimensions. With G
restricted to this subspace the quadratic strain is accurate but for G^T dG, dG the part of G outside the subspace. The
linear strain is exact, and the energy is still given by a Gram matrix.
"""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.basis.modal_derivatives import Support
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.elastic_forms import GradientRule, gradient_gram
from calmotion.reduction.load_envelope import LoadEnvelope

_BOUND = 20.0  # the bound over the error at the targets (measured: 20 to 1000)
_SHARE = 0.25  # of the tolerance that this error may take
_THIRD = 0.1  # of the tolerance: displacement by the third order of a patch's rotation that is negligible
_FLAT = 1e-12  # negligible eigenvalue, of the largest


@dataclass(frozen=True, eq=False)
class QuadraticStrainSubspace:
    """The subspace of the quadratic strain.

    Attributes:
        basis: T, the directions that span it, shape [r, p].
        projection: W, with W u the coordinates of u in it, shape [p, r].
        error_m: Estimated error at the targets [m].
    """

    basis: Array
    projection: Array
    error_m: float


def quadratic_strain_subspace(
    model: FEModel, support: Support, basis: Basis, linear: Basis, deflection: Array, load_envelope: LoadEnvelope,
    youngs_modulus: float, tolerance: float,
) -> QuadraticStrainSubspace | None:  # fmt: skip
    """The subspace for the loads of a shot.

    The loads deflect the linear modes by a_i, and with them the derivatives by theta_ij a_i a_j. The subspace is
    spanned by the principal directions of these deflections, in the norm of their displacement gradients. The error at
    a target is bounded by the displacement that the missing strain causes in the softest mode; in the motions of shots
    it is at most a twentieth of this bound.

    Args:
        model, support: Full model and its supports.
        basis: With modal derivatives, r modes.
        linear: The basis without them.
        deflection: Bound of the amplitude of each of its modes.
        load_envelope: Loads of the shot.
        youngs_modulus: [Pa].
        tolerance: Acceptable error [m].

    Returns:
        The subspace; None where its dimension is not below r.
    """
    assert basis.first_order is not None and basis.second_order is not None
    r, pairs = basis.second_order.shape
    first, second = np.triu_indices(int(np.sqrt(2 * pairs)))
    deflected = basis.first_order * deflection
    derivatives = basis.second_order * deflection[first] * deflection[second]
    L = np.linalg.cholesky(gradient_gram(GradientRule(model.mesh, 2), basis.modes))
    motion = L.T @ np.hstack([deflected, derivatives])
    rotations = np.linalg.qr(np.linalg.solve(L, _patch_rows(model, support, basis, deflected, tolerance).T))[0]
    directions, size, _ = np.linalg.svd(motion - rotations @ (rotations.T @ motion), full_matrices=False)
    missing = np.sqrt(np.cumsum(size[::-1] ** 2)[::-1])  # without this direction and those after it
    gradient = float(np.linalg.norm(L.T @ deflected)) / np.sqrt(model.mesh.volume)
    softness = float(np.linalg.norm(_farthest(linear, load_envelope) / np.sqrt(linear.omega_squared)))
    error = softness * np.sqrt(youngs_modulus) * gradient * missing
    estimated = np.append(error / _BOUND, 0.0)
    count = int(np.count_nonzero(estimated > _SHARE * tolerance))
    if count + rotations.shape[1] >= r:
        return None
    kept = np.hstack([rotations, directions[:, :count]])
    return QuadraticStrainSubspace(np.linalg.solve(L.T, kept), kept.T @ L.T, float(estimated[count]))


def _patch_rows(model: FEModel, support: Support, basis: Basis, deflected: Array, tolerance: float) -> Array:
    """Coordinates that penalty springs couple (`patch_rotation`), one a row; the subspace contains them exactly.

    These are rotations of patches, and where the third order of a rotation matters its changes of shape.
    """
    assert basis.patch_squares is not None
    rows = [basis.patch_motion[:, 3:].reshape(-1, len(basis.omega_squared))]
    for patch, center, motion, squares in zip(
        support.patches, support.centers, basis.patch_motion, basis.patch_squares, strict=True
    ):
        size = float(np.linalg.norm(model.mesh.nodes[patch] - center, axis=1).max())
        rotation = float(np.linalg.norm(np.abs(motion[3:] @ deflected).sum(axis=1)))
        if rotation**3 * size > _THIRD * tolerance:
            values, vectors = np.linalg.eigh(squares @ squares.T)
            rows.append(vectors[:, values > _FLAT * values[-1]].T @ squares)
    return np.vstack(rows)


def _farthest(basis: Basis, load_envelope: LoadEnvelope) -> Array:
    """Largest displacement by each mode of an interface, or of a target beyond it, shape [c]."""
    if not len(basis.patch_motion):
        return np.asarray(np.linalg.norm(basis.modes, axis=1).max(axis=0))
    translation, rotation = (np.linalg.norm(part, axis=1) for part in np.split(basis.patch_motion, 2, axis=1))
    return np.asarray((translation + load_envelope.lever_arm[:, None] * rotation).max(axis=0))
