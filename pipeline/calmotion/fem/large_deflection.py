"""The reduced elastic law of a body of large deflection: its basis, its energy and its damping."""

from __future__ import annotations

import numpy as np

from ..shot.character import Array, ElasticMaterial
from .assembly import FEModel
from .craig_bampton import Basis
from .elastic_forms import GradientRule, lame_constants, strain_gram
from .modal_derivatives import Support, extended_basis
from .reduced_body import Elasticity

PAIRED_MODES = 6  # of the lowest: two or three bending pairs, or bending and twist


def large_deflection(
    model: FEModel, support: Support, basis: Basis, material: ElasticMaterial, law: str
) -> tuple[Basis, Elasticity, float]:
    """A body's basis with modal derivatives, and its elastic law in it.

    Args:
        model: Full model.
        support: What holds the body.
        basis: Its linear modes.
        material: Elastic constants and damping.
        law: `stvk` or `neohookean`.

    Returns:
        The extended basis, the law, and the damping by mass [1/s] that goes with it.
    """
    by_mass, by_stiffness = rayleigh_coefficients(basis.omega_squared, material)
    extended = extended_basis(model, support, basis, PAIRED_MODES, material, law)
    lame = lame_constants(material.youngs_modulus, material.poissons_ratio)
    if law == "stvk":
        gram = strain_gram(GradientRule(model.mesh, 4), extended.modes, *lame)
        return extended, Elasticity(law, by_stiffness, gram.ravel(), 0, lame), by_mass
    from .cubature import neohookean_cubature

    data, points = neohookean_cubature(model, extended, material)
    return extended, Elasticity(law, by_stiffness, data, points, lame), by_mass


def rayleigh_coefficients(omega_squared: Array, material: ElasticMaterial) -> tuple[float, float]:
    """Damping by mass [1/s] and by stiffness [s] of a body.

    Where only a ratio of critical damping is known, the first mode and the last of the paired ones have it exactly;
    those between have a little less, those above more. (Modal damping of each coordinate by itself would resist the
    shortening of a link as it bends, which costs a real one nothing.)
    """
    if material.rayleigh is not None:
        return material.rayleigh
    if not len(omega_squared):
        return 0.0, 0.0
    omega = np.sqrt(omega_squared[[0, min(PAIRED_MODES, len(omega_squared)) - 1]])
    ratio = material.damping_ratio
    return float(2.0 * ratio * omega[0] * omega[1] / omega.sum()), float(2.0 * ratio / omega.sum())
