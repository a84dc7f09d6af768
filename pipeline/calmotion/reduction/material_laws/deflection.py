"""How far the loads of a shot deflect a body, and what that does to a linear one.

Two errors of a linear body are estimated from the loads, with u_i = (load on mode i) / omega_i^2 the quasi-static
deflection and theta_ij the modal derivatives:

- shortening: the displacement of the tip, or of a target beyond it, is wrong by theta_ij u_i u_j / 2;
- stiffening or softening: a load f also does work on theta_ij, so the stiffness changes by -f . theta_ij, and the
  deflection by this share of itself.
"""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model.character import ElasticMaterial
from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.basis.modal_derivatives import Derivatives
from calmotion.reduction.basis.static_loads import OVERSHOOT
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.load_envelope import LoadEnvelope

MODES = 4  # the lowest modes, which make nearly all of a deflection
UNPHYSICAL = 10.0  # linear deflection over the size of a body that hangs like a rope: beyond any reduced basis


@dataclass(frozen=True)
class Deflection:
    """Bounds of what the loads of a shot do to a linear body.

    Attributes:
        size_m: Displacement of its interfaces [m].
        moved_m: Of them, or of targets beyond them [m].
        strain: Root mean square over the body.
        linear_error_m: Error of the linear law there [m].
    """

    size_m: float
    moved_m: float
    strain: float
    linear_error_m: float


def deflection_under(
    model: FEModel, basis: Basis, second_order: Derivatives, material: ElasticMaterial, load_envelope: LoadEnvelope,
    path: str = "",
) -> Deflection:  # fmt: skip
    """The deflection of a body.

    Args:
        second_order: Derivatives of its first modes, by St. Venant and Kirchhoff's law; these are counted.
        material: Elastic constants.
        load_envelope: Its loads in this shot.
        path: Prim path of the body, for errors.

    Raises:
        ShotError: The body is too soft for any law.
    """
    count, fields, motion = second_order.count, second_order.fields, second_order.motion
    modes = basis.modes[:, :, :count]
    omega_squared = basis.omega_squared[:count]
    deflections = amplitudes(model, basis, load_envelope, count)
    first, second = np.triu_indices(count)
    twice = np.where(first == second, 1.0, 2.0)
    pairs = twice * deflections[first] * deflections[second]
    deflection = _largest_displacement(modes, basis.patch_motion[:, :, :count], deflections)
    moved = _largest_displacement(modes, basis.patch_motion[:, :, :count], deflections, load_envelope.lever_arm)
    shortening = 0.5 * _largest_displacement(fields, motion, pairs, load_envelope.lever_arm)
    change = np.zeros((count, count))
    change[first, second] = change[second, first] = work_of_loads(model, fields, motion, load_envelope)
    root = np.sqrt(omega_squared)
    softening = float(np.linalg.norm(change / np.outer(root, root), 2))
    size = float(np.ptp(model.mesh.nodes, axis=0).max())
    if deflection > UNPHYSICAL * size:
        raise ShotError(
            f"this body is too soft for this shot: the deflection of a linear body would be {deflection / size:.3g} "
            "times its size",
            path=path,
            attribute="physics:youngsModulus",
            found=f"{material.youngs_modulus:.3g} Pa",
            remedy="Check it in units of the stage, check the masses that the body carries, and look for steps in the "
            f"animation (`calmotion inspect`). Bodies that deflect by more than {UNPHYSICAL:g} times their size "
            f"cannot be simulated: author {material.youngs_modulus * deflection / (UNPHYSICAL * size):.2g} Pa or more.",
        )
    strain = float(np.sqrt(deflections @ (omega_squared * deflections) / (material.youngs_modulus * model.mesh.volume)))
    return Deflection(deflection, moved, strain, shortening + moved * softening)


def amplitudes(model: FEModel, basis: Basis, load_envelope: LoadEnvelope, count: int) -> Array:
    """Bound of the deflection of each of the first modes by the loads, shape [count]."""
    work = work_of_loads(model, basis.modes[:, :, :count], basis.patch_motion[:, :, :count], load_envelope)
    return OVERSHOOT * work / basis.omega_squared[:count]


def deflection_of(model: FEModel, basis: Basis, load_envelope: LoadEnvelope) -> float:
    """Bound of the displacement of the interfaces of a linear body, or of targets beyond them, by the loads [m]."""
    count = min(MODES, len(basis.omega_squared))
    deflections = amplitudes(model, basis, load_envelope, count)
    return _largest_displacement(
        basis.modes[:, :, :count], basis.patch_motion[:, :, :count], deflections, load_envelope.lever_arm
    )


def work_of_loads(model: FEModel, fields: Array, motion: Array, load_envelope: LoadEnvelope) -> Array:
    """Bound of the work of the loads on displacement fields, for any combination of their signs, shape [k].

    Args:
        fields: Nodal displacements, shape [n, 3, k].
        motion: Motion of the moving interfaces in them (translation, rotation vector), shape [p, 6, k].
    """
    X = model.mesh.nodes
    weighted = (model.mass @ fields.reshape(len(X), -1)).reshape(fields.shape)  # int rho phi, by nodes
    linear = np.abs(weighted.sum(axis=0))  # [3, k]
    moments = np.einsum("na,nbk->abk", X, weighted)  # int rho X_a phi_b
    angular = np.abs([moments[1, 2] - moments[2, 1], moments[2, 0] - moments[0, 2], moments[0, 1] - moments[1, 0]])
    w = load_envelope.angular_velocity
    # |omega x (omega x X)| . phi, term by term
    centrifugal = np.zeros(fields.shape[2])
    for a in range(3):
        for b in range(3):
            size = w[a] * w[b] if a != b else float(w @ w - w[a] * w[a])
            centrifugal += size * np.abs(moments[a, b])
    work = load_envelope.acceleration @ linear + load_envelope.angular_acceleration @ angular + centrifugal
    for force, moment, patch in zip(load_envelope.force, load_envelope.moment, np.abs(motion), strict=True):
        work += force @ patch[:3] + moment @ patch[3:]
    return np.asarray(work)


def _largest_displacement(fields: Array, motion: Array, amplitudes: Array, lever_arm: Array | None = None) -> float:
    """Largest displacement of the interfaces, or of the whole body where it has none [m].

    Args:
        lever_arm: Displacement of a target by a unit rotation of each interface [m]; None: that of the interfaces only.
    """
    if len(motion):
        moved = np.linalg.norm(np.abs(motion[:, :3]) @ amplitudes, axis=1)
        if lever_arm is not None:
            moved = moved + lever_arm * np.linalg.norm(np.abs(motion[:, 3:]) @ amplitudes, axis=1)
        return float(moved.max())
    return float(np.linalg.norm(np.abs(fields) @ amplitudes, axis=1).max())
