"""The reduced elastic law of a body of large deflection: its basis and its energy."""

from __future__ import annotations

from ..shot.character import ElasticMaterial
from .assembly import FEModel
from .craig_bampton import Basis
from .damping import PAIRED_MODES
from .elastic_forms import GradientRule, lame_constants, strain_gram
from .modal_derivatives import Support, extended_basis
from .reduced_body import Elasticity


def large_deflection(
    model: FEModel, support: Support, basis: Basis, material: ElasticMaterial, law: str
) -> tuple[Basis, Elasticity]:
    """A body's basis with modal derivatives, and its elastic law in it.

    Args:
        model: Full model.
        support: What holds the body.
        basis: Its linear modes.
        material: Elastic constants.
        law: `stvk` or `neohookean`.

    Returns:
        The extended basis, and the law without damping.
    """
    extended = extended_basis(model, support, basis, PAIRED_MODES, material, law)
    lame = lame_constants(material.youngs_modulus, material.poissons_ratio)
    if law == "stvk":
        gram = strain_gram(GradientRule(model.mesh, 4), extended.modes, *lame)
        return extended, Elasticity(law, 0.0, gram.ravel(), 0, lame)
    from .cubature import neohookean_cubature

    data, points = neohookean_cubature(model, extended, material)
    return extended, Elasticity(law, 0.0, data, points, lame)
