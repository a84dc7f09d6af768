"""The reduced elastic law of a body of large deflection: its basis and its energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..shot.character import ElasticMaterial
from .assembly import FEModel
from .choose_law import work_of_loads
from .craig_bampton import Basis
from .elastic_forms import GradientRule, lame_constants, strain_gram
from .excitation_data import Excitation
from .modal_derivatives import Support, extended_basis
from .reduced_body import Elasticity

PAIRED_MODES = 12  # modes that may have derivatives


def large_deflection(
    model: FEModel, support: Support, basis: Basis, material: ElasticMaterial, law: str,
    excitation: Excitation | None = None,
) -> tuple[Basis, Elasticity]:  # fmt: skip
    """A body's basis with modal derivatives, and its elastic law in it.

    Args:
        model: Full model.
        support: What holds the body.
        basis: Its linear modes.
        material: Elastic constants.
        law: `stvk` or `neohookean`.
        excitation: Its loads in this shot, by moving patch; None when they are not known.

    Returns:
        The extended basis, and the law without damping.
    """
    if excitation is not None:
        basis = _by_deflection(model, basis, excitation)
    extended = extended_basis(model, support, basis, PAIRED_MODES, material, law)
    lame = lame_constants(material.youngs_modulus, material.poissons_ratio)
    if law == "stvk":
        gram = strain_gram(GradientRule(model.mesh, 4), extended.modes, *lame)
        return extended, Elasticity(law, 0.0, gram.ravel(), 0, lame)
    from .cubature import neohookean_cubature

    data, points = neohookean_cubature(model, extended, material)
    return extended, Elasticity(law, 0.0, data, points, lame)


def _by_deflection(model: FEModel, basis: Basis, excitation: Excitation) -> Basis:
    """The basis in the order of how far the shot's loads deflect its modes.

    By frequency, the vectors that stand for the static response to a load come last, though a link may bend in them
    as far as in the first; without its derivatives a mode stretches the link as it bends, and hardly takes part.
    """
    reach = np.abs(basis.modes).max(axis=(0, 1))
    deflection = reach * work_of_loads(model, basis.modes, basis.patch_motion, excitation) / basis.omega_squared
    order = np.argsort(-deflection, kind="stable")
    return replace(
        basis,
        modes=basis.modes[:, :, order],
        omega_squared=basis.omega_squared[order],
        patch_motion=basis.patch_motion[:, :, order],
    )
