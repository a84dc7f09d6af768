"""The few directions of a body's motion that its quadratic strain has to see.

The Gram matrix of all pairs of r coordinates has r^4 / 4 entries. But strain is quadratic in displacement gradients,
and nearly all that a body turns as it bends lies in few directions: G^T G of these alone leaves G^T dG out, with dG
what the gradients have outside of them. To first order nothing is left out, and the energy is a Gram matrix still.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.basis.modal_derivatives import Support
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.elastic_forms import GradientRule, gradient_gram
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.material_laws.choice import amplitudes
from calmotion.shot.character import Array

_BOUND = 20.0  # targets move by less than the bound over this (measured: by a twentieth to a thousandth of it)
_SHARE = 0.25  # of the tolerance, that it may take by that
_THIRD = 0.1  # of the tolerance: third order of a patch's turn that matters
_FLAT = 1e-12  # of the largest


@dataclass(frozen=True, eq=False)
class QuadraticStrainSubspace:
    """Directions whose pairs do for a body's quadratic strain.

    Attributes:
        directions: T, shape [r, p].
        part: W, with W u the part of u in them, shape [p, r].
        error_m: What is left out, estimated at the targets [m].
    """

    directions: Array
    part: Array
    error_m: float


def quadratic_strain_subspace(
    model: FEModel, support: Support, basis: Basis, linear: Basis, load_envelope: LoadEnvelope, youngs_modulus: float,
    tolerance: float,
) -> QuadraticStrainSubspace | None:  # fmt: skip
    """Directions for the loads of a shot.

    They bend the linear modes by a_i, and these bring along their derivatives, theta_ij a_i a_j: principal directions
    of all that, by the gradients they make. What is left out moves a target by no more than its strain does in the
    softest way: in the motions of shots by a twentieth of that at most.

    Args:
        model, support: Full model and what holds it.
        basis: Extended by modal derivatives, r modes.
        linear: The basis before.
        load_envelope: Loads of the shot.
        youngs_modulus: [Pa].
        tolerance: Error that does not matter [m].

    Returns:
        The directions; None where they are no fewer than the coordinates.
    """
    assert basis.first_order is not None and basis.second_order is not None
    r, pairs = basis.second_order.shape
    bend = amplitudes(model, linear, load_envelope, len(linear.omega_squared))
    first, second = np.triu_indices(int(np.sqrt(2 * pairs)))
    straight, brought = basis.first_order * bend, basis.second_order * bend[first] * bend[second]
    L = np.linalg.cholesky(gradient_gram(GradientRule(model.mesh, 2), basis.modes))
    motion = L.T @ np.hstack([straight, brought])
    turns = np.linalg.qr(np.linalg.solve(L, _patch_rows(model, support, basis, straight, tolerance).T))[0]
    directions, size, _ = np.linalg.svd(motion - turns @ (turns.T @ motion), full_matrices=False)
    missing = np.sqrt(np.cumsum(size[::-1] ** 2)[::-1])  # without the direction and those after it
    turn = float(np.linalg.norm(L.T @ straight)) / np.sqrt(model.mesh.volume)
    softness = float(np.linalg.norm(_farthest(linear, load_envelope) / np.sqrt(linear.omega_squared)))
    error = softness * np.sqrt(youngs_modulus) * turn * missing
    estimated = np.append(error / _BOUND, 0.0)
    count = int(np.count_nonzero(estimated > _SHARE * tolerance))
    if count + turns.shape[1] >= r:
        return None
    kept = np.hstack([turns, directions[:, :count]])
    return QuadraticStrainSubspace(np.linalg.solve(L.T, kept), kept.T @ L.T, float(estimated[count]))


def _patch_rows(model: FEModel, support: Support, basis: Basis, straight: Array, tolerance: float) -> Array:
    """Coordinates that stiff springs hold to one another (`patch_rotation`), each a row: they are seen as they are.

    Turns of patches, and where the third order of a turn matters the shapes that these bring about.
    """
    assert basis.patch_squares is not None
    rows = [basis.patch_motion[:, 3:].reshape(-1, len(basis.omega_squared))]
    for patch, center, motion, squares in zip(
        support.patches, support.centers, basis.patch_motion, basis.patch_squares, strict=True
    ):
        size = float(np.linalg.norm(model.mesh.nodes[patch] - center, axis=1).max())
        turn = float(np.linalg.norm(np.abs(motion[3:] @ straight).sum(axis=1)))
        if turn**3 * size > _THIRD * tolerance:
            values, vectors = np.linalg.eigh(squares @ squares.T)
            rows.append(vectors[:, values > _FLAT * values[-1]].T @ squares)
    return np.vstack(rows)


def _farthest(basis: Basis, load_envelope: LoadEnvelope) -> Array:
    """How far each mode moves an interface, or a target beyond it by its turn, shape [c]."""
    if not len(basis.patch_motion):
        return np.asarray(np.linalg.norm(basis.modes, axis=1).max(axis=0))
    moved, turned = (np.linalg.norm(part, axis=1) for part in np.split(basis.patch_motion, 2, axis=1))
    return np.asarray((moved + load_envelope.lever[:, None] * turned).max(axis=0))
