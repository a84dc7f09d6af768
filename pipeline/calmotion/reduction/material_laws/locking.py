"""Whether a reduced body with quadratic strain is too stiff: the static deflection by its largest load.

Bending curves a wide thin strip across its width. At deflections of many thicknesses a real strip becomes flat across
(Searle 1908; Ashwell, The anticlastic curvature of rectangular beams and plates, 1950). Few modes and their derivatives
lack this change of shape, and the reduced strip stretches instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.model.budget import REDUCTION
from calmotion.model.result import Simplification
from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.material_laws.choice import amplitudes, deflection_of
from calmotion.reduction.reduced_body import Elasticity

LOCKED = 0.85  # of the linear deflection, below which a body is locked: 0.998 on the bartender, 0.18 on a strip
_ITERATIONS = 60
_CONVERGED = 1e-6  # change of the deflection, of itself


@dataclass(frozen=True)
class Locking:
    """A body that is too stiff with quadratic strain.

    Attributes:
        share: Its deflection under its largest load, over that of the linear body.
        error_m: Of its deflection [m].
        linear_error_m: Of the linear law [m]; infinite where the shot chose the law.
    """

    share: float
    error_m: float
    linear_error_m: float

    @property
    def by_linear(self) -> bool:
        """Whether the linear law is nearer."""
        return self.linear_error_m < self.error_m

    def told(self, path: str) -> Simplification:
        """For the report of the body at a prim path."""
        why = (
            f"with quadratic strain it would deflect {100.0 * self.share:.0f}% as far under its largest load: wide "
            "thin strips lock, whose modes keep their curvature across"
        )
        what = "linear elasticity" if self.by_linear else "too stiff under large deflections"
        return Simplification(f"{path}: {what}", why, min(self.error_m, self.linear_error_m), REDUCTION)


def locked(
    model: FEModel, linear: Basis, basis: Basis, law: Elasticity, load_envelope: LoadEnvelope | None,
    linear_error_m: float,
) -> Locking | None:  # fmt: skip
    """Whether a body resists its largest load more than it should; None of one that does not.

    Args:
        model: Full model.
        linear, basis: Without and with modal derivatives.
        law: With quadratic strain.
        load_envelope: Loads of the shot.
        linear_error_m: As of `Locking`.
    """
    if law.law != "stvk" or load_envelope is None or basis.first_order is None:
        return None
    bent = basis.first_order[:, 0] * amplitudes(model, linear, load_envelope, 1)[0]
    share = share_of_deflection(law, basis.omega_squared, bent)
    if share > LOCKED:
        return None
    return Locking(share, (1.0 - share) * deflection_of(model, linear, load_envelope), linear_error_m)


def share_of_deflection(law: Elasticity, stiffness: Array, linear: Array) -> float:
    """The deflection of a St. Venant-Kirchhoff body over that of the linear one, along it and under its load.

    Args:
        law: Of r coordinates.
        stiffness: Diagonal of the linear body, shape [r].
        linear: Deflection of the linear body, shape [r].
    """
    r = len(stiffness)
    W = np.eye(r) if law.strain_projection is None else law.strain_projection
    first, second = np.triu_indices(len(W))
    gram = np.asarray(law.data).reshape(r + len(first), -1)
    load = stiffness * linear
    norm = float(linear @ load)

    def merit(u: Array) -> tuple[float, Array]:
        v = W @ u
        z = np.concatenate([u, v[first] * v[second]])
        return 0.5 * float(z @ gram @ z) - float(load @ u), z

    u = np.zeros(r)
    value, z = merit(u)
    for _ in range(_ITERATIONS):
        v = W @ u
        J = np.vstack([np.eye(r), v[first][:, None] * W[second] + v[second][:, None] * W[first]])
        pull = gram @ z
        step = np.linalg.solve(J.T @ gram @ J, load - J.T @ pull)
        size = 1.0
        while size > 1e-6:
            there, z_there = merit(u + size * step)
            if there <= value:
                break
            size *= 0.5
        u, value, z = u + size * step, there, z_there
        if np.sqrt(step @ (stiffness * step)) * size <= _CONVERGED * np.sqrt(norm):
            break
    return float(load @ u) / norm
