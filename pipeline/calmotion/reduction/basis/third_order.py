"""Modes that bending calls up at third order.

Bending curves a wide thin strip across its width. At deflections of many thicknesses a real strip becomes flat across
(Searle 1908; Ashwell, The anticlastic curvature of rectangular beams and plates, 1950). A basis without this change of
shape stretches instead: at 1/60 of its width a strip deflected by 0.3 of its length was 10% too stiff.

The forces of third order, f3 of a bending mode and its derivative, push the body into other shapes, K^-1 f3. These
grow in different ways as the bending goes on: K^-1 f3 as one vector left 9.0 of these 9.6%, the vectors of five
iterations K^-1 (residual) 8.1%. The normal modes in K^-1 f3, taken one by one, leave 0.2 to 0.9%.
"""

from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array
from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.basis.fixed_interface import ritz_modes
from calmotion.reduction.basis.modal_derivatives import Derivatives, Support
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.elastic_forms import GradientRule

_SMALL = 0.01  # deflection at which the third order is evaluated, of the body's size
_CANDIDATES = 40  # normal modes to choose from
_MOST = 10  # of them that are taken
_STIFFENING = 3.0  # error of the deflection over the share of energy of what is missing (measured: 1.3 to 3.2)


@dataclass(frozen=True, eq=False)
class ThirdOrder:
    """What a mode causes at third order.

    Attributes:
        basis: With the normal modes that it needs.
        amplitude: Of each of its modes by the third order, shape [r].
        missing: Estimated error of the deflection by the normal modes that are left out, of itself.
    """

    basis: Basis
    amplitude: Array
    missing: float


def third_order(
    model: FEModel, support: Support, basis: Basis, derivatives: Derivatives, deflection: float, rule: GradientRule,
    lame: tuple[float, float], allowed: float,
) -> ThirdOrder:  # fmt: skip
    """The normal modes that the first mode of a basis calls up as it grows.

    Args:
        model, support: Full model and its supports.
        basis: The mode that deflects most first.
        derivatives: Of St. Venant-Kirchhoff, of its first mode at least.
        deflection: Amplitude of the first mode.
        rule: Of the elastic law.
        lame: Lame's constants [Pa].
        allowed: Error of the deflection that may be left, of itself.
    """
    n, r = len(model.mesh.nodes), len(basis.omega_squared)
    fixed, K = support.fixed(model), model.stiffness
    bent, second = deflection * basis.modes[:, :, 0], deflection**2 * derivatives.fields[:, :, 0]
    small = _SMALL * float(np.ptp(model.mesh.nodes, axis=0).max()) / float(np.abs(bent).max())
    even, odd = 0.5 * small**2 * second, small * bent
    # odd orders alone, without the first
    force = 0.5 * (rule.internal_force(even + odd, *lame) - rule.internal_force(even - odd, *lame)).ravel()
    force -= K @ odd.ravel()
    called = fixed.balance(-force[:, None], np.zeros((3 * n, 1)))[0][:, 0] / small**3
    modes = basis.modes.reshape(3 * n, r)
    called -= modes @ (modes.T @ (K @ called) / basis.omega_squared)
    pull, work = K @ called, deflection**2 * basis.omega_squared[0]
    total = float(called @ pull) / work
    if _STIFFENING * total <= allowed:
        return ThirdOrder(basis, np.zeros(r), 0.0)
    normal = fixed.lowest(_CANDIDATES)[:, 6 * len(support.patches) :]
    share = modes.T @ model.momentum(normal)
    squares, U = ritz_modes(model, normal - modes @ share)
    normal, motion = (normal - modes @ share) @ U, -basis.patch_motion @ (share @ U)
    energy = (normal.T @ pull) ** 2 / squares / work
    order = np.argsort(-energy)
    left = _STIFFENING * np.append(np.cumsum(energy[order][::-1])[::-1], 0.0)  # without this mode and those after it
    taken = order[: min(int(np.flatnonzero(left <= allowed)[0]), _MOST)]
    if not len(taken):
        return ThirdOrder(basis, np.zeros(r), float(left[0]))
    columns = np.hstack([modes, normal[:, taken]])
    squares, U = ritz_modes(model, columns)
    columns = columns @ U
    larger = replace(
        basis,
        modes=np.ascontiguousarray(columns.reshape(n, 3, -1)),
        omega_squared=squares,
        patch_motion=np.concatenate([basis.patch_motion, motion[:, :, taken]], axis=2) @ U,
    )
    # at most the energy of the bending: the third order alone grows beyond what it flattens
    amplitude = np.minimum(np.abs(columns.T @ pull), np.sqrt(work * squares)) / squares
    return ThirdOrder(larger, amplitude, float(left[len(taken)]))
