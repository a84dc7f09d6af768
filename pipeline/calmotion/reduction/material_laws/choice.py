"""Which elastic law a body needs: the cheapest whose error stays below the tolerance, and why.

Two things a linear body leaves out are estimated from the loads of the shot, with u_i = (load on mode i) / omega_i^2
the quasi-static deflection and theta_ij the modal derivatives:

- shortening: the tip, or a target beyond it, is off by theta_ij u_i u_j / 2;
- stiffening (or softening): a load f works along theta_ij too, so that the stiffness changes by -f . theta_ij, and the
  deflection by that part of itself.

St. Venant-Kirchhoff leaves out that the material itself is not linear, by a part of the order of the strain; in
bending, one side is strained as the other is not, and what is left is of the order of its square.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.errors import ShotError
from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.basis.modal_derivatives import Support, modal_derivatives
from calmotion.reduction.basis.static_loads import OVERSHOOT
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.shot.character import Array, ElasticMaterial

_MODES = 4  # the lowest carry nearly all of a deflection
_LARGE_STRAIN = 0.1  # below, the loads' bound says more about the bound than about the material
_HOPELESS = 100.0  # times its own size: no real body bends so far, and modes about the straight one do not


@dataclass(frozen=True)
class LawChoice:
    """The law of a body.

    Attributes:
        law: `linear`, `stvk` or `neohookean`.
        reason: In the user's words.
        error_m: What it is estimated to leave out at the body's interfaces [m].
    """

    law: str
    reason: str
    error_m: float


def choose_law(
    model: FEModel, support: Support, basis: Basis, material: ElasticMaterial, load_envelope: LoadEnvelope,
    tolerance: float, path: str = "",
) -> LawChoice:  # fmt: skip
    """The cheapest law whose estimated error is within the tolerance [m].

    Args:
        model, support, basis, material: The body; see `modal_derivatives`.
        load_envelope: Its loads in this shot.
        tolerance: [m].
        path: Prim path of the body, for errors.

    Raises:
        ShotError: The body is so soft that no law helps.
    """
    count = min(_MODES, len(basis.omega_squared))
    if count == 0:
        return LawChoice("linear", "it has no elastic coordinates", 0.0)
    second_order = modal_derivatives(model, support, basis, count, material, "stvk")
    fields, motion = second_order.fields, second_order.motion
    modes = basis.modes[:, :, :count]
    omega_squared = basis.omega_squared[:count]
    bend = amplitudes(model, basis, load_envelope, count)
    first, second = np.triu_indices(count)
    twice = np.where(first == second, 1.0, 2.0)
    pairs = twice * bend[first] * bend[second]
    deflection = _reach(modes, basis.patch_motion[:, :, :count], bend)
    moved = _reach(modes, basis.patch_motion[:, :, :count], bend, load_envelope.lever)
    shortening = 0.5 * _reach(fields, motion, pairs, load_envelope.lever)
    change = np.zeros((count, count))
    change[first, second] = change[second, first] = work_of_loads(model, fields, motion, load_envelope)
    root = np.sqrt(omega_squared)
    softening = float(np.linalg.norm(change / np.outer(root, root), 2))
    size = float(np.ptp(model.mesh.nodes, axis=0).max())
    if deflection > _HOPELESS * size:
        raise ShotError(
            f"this body is too soft for this shot: as a linear body it would bend by {deflection / size:.3g} times "
            "its size",
            path=path,
            attribute="physics:youngsModulus",
            found=f"{material.youngs_modulus:.3g} Pa",
            remedy="Check it, in the stage's units, and the masses that the body carries.",
        )
    linear_error = shortening + moved * softening
    strain = float(np.sqrt(bend @ (omega_squared * bend) / (material.youngs_modulus * model.mesh.volume)))
    stvk_error = moved * strain**2
    found = f"it bends by about {_mm(deflection)}"
    if linear_error <= tolerance:
        return LawChoice("linear", f"{found}, of which {_mm(linear_error)} is not linear", linear_error)
    because = f"{found}, of which {_mm(linear_error)} is not linear"
    if stvk_error <= tolerance or strain <= _LARGE_STRAIN:
        return LawChoice("stvk", f"{because}; it is strained by {strain:.1%}", stvk_error)
    return LawChoice("neohookean", f"{because}; it is strained by {strain:.0%}", 0.0)


def amplitudes(model: FEModel, basis: Basis, load_envelope: LoadEnvelope, count: int) -> Array:
    """How far the loads deflect the first modes at most, each by itself, shape [count]."""
    work = work_of_loads(model, basis.modes[:, :, :count], basis.patch_motion[:, :, :count], load_envelope)
    return OVERSHOOT * work / basis.omega_squared[:count]


def deflection_of(model: FEModel, basis: Basis, load_envelope: LoadEnvelope) -> float:
    """How far the loads of a linear body move its interfaces, or targets beyond them, at most [m]."""
    count = min(_MODES, len(basis.omega_squared))
    bend = amplitudes(model, basis, load_envelope, count)
    return _reach(basis.modes[:, :, :count], basis.patch_motion[:, :, :count], bend, load_envelope.lever)


def work_of_loads(model: FEModel, fields: Array, motion: Array, load_envelope: LoadEnvelope) -> Array:
    """Most work that the loads do on displacement fields, shape [k], however they fall together.

    Args:
        fields: Nodal displacements, shape [n, 3, k].
        motion: What they do to the moving interfaces (translation, rotation vector), shape [p, 6, k].
    """
    X = model.mesh.nodes
    weighted = (model.mass @ fields.reshape(len(X), -1)).reshape(fields.shape)  # int rho phi, by nodes
    straight = np.abs(weighted.sum(axis=0))  # [3, k]
    moments = np.einsum("na,nbk->abk", X, weighted)  # int rho X_a phi_b
    turning = np.abs([moments[1, 2] - moments[2, 1], moments[2, 0] - moments[0, 2], moments[0, 1] - moments[1, 0]])
    w = load_envelope.angular_velocity
    # |omega x (omega x X)| . phi, term by term
    centrifugal = np.zeros(fields.shape[2])
    for a in range(3):
        for b in range(3):
            size = w[a] * w[b] if a != b else float(w @ w - w[a] * w[a])
            centrifugal += size * np.abs(moments[a, b])
    work = load_envelope.acceleration @ straight + load_envelope.angular_acceleration @ turning + centrifugal
    for force, moment, patch in zip(load_envelope.force, load_envelope.moment, np.abs(motion), strict=True):
        work += force @ patch[:3] + moment @ patch[3:]
    return work


def _reach(fields: Array, motion: Array, amplitudes: Array, lever: Array | None = None) -> float:
    """Largest displacement of the interfaces, or of the whole body where it has none [m].

    Args:
        lever: Distance of a target beyond each interface, which its turn moves [m]; None: turns do not matter.
    """
    if len(motion):
        moved = np.linalg.norm(np.abs(motion[:, :3]) @ amplitudes, axis=1)
        if lever is not None:
            moved = moved + lever * np.linalg.norm(np.abs(motion[:, 3:]) @ amplitudes, axis=1)
        return float(moved.max())
    return float(np.linalg.norm(np.abs(fields) @ amplitudes, axis=1).max())


def _mm(length: float) -> str:
    return f"{1e3 * length:.3g} mm"
