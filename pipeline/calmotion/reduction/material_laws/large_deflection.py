"""The reduced elastic law of a body of large deflection: its basis and its energy."""

from dataclasses import replace
from functools import partial

import numpy as np

from calmotion.model.character import DEFAULT_TOLERANCE, ElasticMaterial
from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.basis.modal_derivatives import NEGLIGIBLE, Support, extended_basis
from calmotion.reduction.basis.quadratic_strain_subspace import QuadraticStrainSubspace, quadratic_strain_subspace
from calmotion.reduction.basis.static_loads import OVERSHOOT
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.elastic_forms import LAW_ORDER, GradientRule, lame_constants, strain_gram
from calmotion.reduction.elements.patch_rotation import spring_rows, springs, stiffer
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.material_laws.bending import Bending
from calmotion.reduction.material_laws.cubature import neohookean_cubature
from calmotion.reduction.reduced_body import Elasticity

PAIRED_MODES = 16  # largest number of modes with derivatives
NEGLIGIBLE_ENERGY = 1e-3  # share of the derivatives' strain energy, times the tolerance over the body's size
_FINEST = 1e-6  # rounding


def large_deflection(
    model: FEModel, support: Support, basis: Basis, material: ElasticMaterial, law: str,
    load_envelope: LoadEnvelope | None = None, tolerance: float = DEFAULT_TOLERANCE, pairs_share: float = 1.0,
    bending: Bending | None = None,
) -> tuple[Basis, Elasticity]:  # fmt: skip
    """The basis of a body with modal derivatives, and the elastic law in this basis.

    Args:
        model: Full model.
        support: Its root patch and moving patches.
        material: Elastic constants.
        law: `stvk` or `neohookean`.
        load_envelope: Its loads in this shot, one row for each moving patch; None when they are not known.
        tolerance: Acceptable error [m].
        pairs_share: Share of the tolerance for the subspace of the quadratic strain; 0 keeps all coordinates.
        bending: The modes to take in place of the basis, with what is known of them.

    Returns:
        The extended basis, and the law without damping.
    """
    deflections = known = None
    if bending is not None:
        basis, deflections = bending.basis, bending.amplitude
        known = bending.derivatives if law == "stvk" else None
    size = float(np.ptp(model.mesh.nodes, axis=0).max())
    negligible = float(np.clip(np.sqrt(NEGLIGIBLE_ENERGY * tolerance / size), _FINEST, NEGLIGIBLE))
    stiff = stiffer(tolerance)
    extended = extended_basis(model, support, basis, PAIRED_MODES, material, law, negligible, deflections, stiff, known)
    lame = lame_constants(material.youngs_modulus, material.poissons_ratio)
    if law == "stvk":
        law_of = partial(_stvk, model, support, extended, material, stiff)
        if load_envelope is None or deflections is None or pairs_share <= 0.0:
            return extended, law_of(None)
        loads, allowed = basis.load_envelope or load_envelope, pairs_share * tolerance
        subspace = quadratic_strain_subspace(
            model, support, extended, basis, OVERSHOOT * deflections, loads, material.youngs_modulus, allowed
        )
        return extended, law_of(subspace)
    data, points = neohookean_cubature(model, extended, material)
    return extended, Elasticity(law, 0.0, data, points, lame)


def _stvk(
    model: FEModel,
    support: Support,
    basis: Basis,
    material: ElasticMaterial,
    stiff: float,
    subspace: QuadraticStrainSubspace | None,
) -> Elasticity:
    """The law in a basis, with the penalty springs of its patches; quadratic strain in a subspace, or in all of it."""
    lame = lame_constants(material.youngs_modulus, material.poissons_ratio)
    directions = None if subspace is None else subspace.basis
    gram = strain_gram(GradientRule(model.mesh, LAW_ORDER), basis.modes, *lame, directions)
    if basis.patch_squares is not None:
        roots = springs(model.mesh.nodes, support.patches, material.youngs_modulus, stiff)
        rows = spring_rows(roots, basis.patch_squares, basis.patch_motion[:, 3:], directions)
        gram += rows.T @ rows
    law = Elasticity("stvk", 0.0, gram.ravel(), 0, lame)
    if subspace is None:
        return law
    return replace(law, strain_projection=subspace.projection, strain_error_m=subspace.error_m)
