"""The linear modes of a body of large deflection: those that the loads deflect, and those that their bending needs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calmotion.arrays import Array
from calmotion.model.character import ElasticMaterial
from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.basis.modal_derivatives import Derivatives, Support, modal_derivatives
from calmotion.reduction.basis.static_loads import OVERSHOOT
from calmotion.reduction.basis.third_order import third_order
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.elastic_forms import LAW_ORDER, GradientRule, lame_constants
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.material_laws.deflection import MODES, deflection_of, work_of_loads

_FLATTENS = 1.0  # Searle number from which bending flattens a section
_ALLOWED = 0.5  # of the tolerance, for what is missing at third order


@dataclass(frozen=True, eq=False)
class Bending:
    """Linear modes, in the order of their deflection by the loads of a shot.

    In the order of frequencies, residual vectors come last, although a link may deflect in them as far as in the first
    mode. A mode without derivatives stretches the link as it bends, so its deflection would be too small.

    Attributes:
        basis: In this order.
        amplitude: Static deflection of each mode by the loads, or by the bending of the first.
        derivatives: Of the first modes by St. Venant and Kirchhoff's law; None: not known.
        missing_m: Estimated error of the deflection by modes that its third order needs and that are not there [m].
    """

    basis: Basis
    amplitude: Array
    derivatives: Derivatives | None
    missing_m: float = 0.0

    @classmethod
    def by_loads(
        cls, model: FEModel, support: Support, basis: Basis, material: ElasticMaterial, load_envelope: LoadEnvelope
    ) -> Bending:
        """That of a basis; arguments as of `large_deflection`."""
        ordered, amplitude = _ordered(basis, _by_loads(model, basis, load_envelope))
        count = min(MODES, len(amplitude))
        return cls(ordered, amplitude, modal_derivatives(model, support, ordered, count, material, "stvk"))

    def with_third_order(
        self, model: FEModel, support: Support, material: ElasticMaterial, load_envelope: LoadEnvelope, tolerance: float
    ) -> Bending:
        """With the modes that the bending of the first calls up, within a part of the tolerance [m]."""
        assert self.derivatives is not None
        deflection = deflection_of(model, self.basis, load_envelope)
        bends = OVERSHOOT * float(self.amplitude[0] * np.abs(self.basis.modes[:, :, 0]).max())
        if deflection <= 0.0 or searle_number(model.mesh.nodes, bends) < _FLATTENS:
            return self
        found = third_order(
            model, support, self.basis, self.derivatives, OVERSHOOT * float(self.amplitude[0]),
            GradientRule(model.mesh, LAW_ORDER), lame_constants(material.youngs_modulus, material.poissons_ratio),
            _ALLOWED * tolerance / deflection,
        )  # fmt: skip
        if found.basis is self.basis:
            return replace(self, missing_m=min(found.missing, 1.0) * deflection)
        by_loads = _by_loads(model, found.basis, load_envelope)
        basis, amplitude = _ordered(found.basis, np.maximum(by_loads, found.amplitude / OVERSHOOT))
        return Bending(basis, amplitude, None, min(found.missing, 1.0) * deflection)


def searle_number(nodes: Array, deflection: float) -> float:
    """w^2 / (R t) of a body as a strip of length l, width w and thickness t, bent to radius R = l^2 / (2 deflection).

    Far below 1 a section keeps its anticlastic curvature, far above it becomes flat (Searle 1908; Ashwell 1950).

    Args:
        nodes: [m], shape [n, 3].
        deflection: Of its end [m].
    """
    axes = np.linalg.svd(nodes - nodes.mean(axis=0), full_matrices=False)[2]
    thickness, width, length = np.sort(np.ptp(nodes @ axes.T, axis=0))
    return float(2.0 * deflection * width**2 / (length**2 * max(thickness, np.finfo(float).tiny)))


def _by_loads(model: FEModel, basis: Basis, load_envelope: LoadEnvelope) -> Array:
    return work_of_loads(model, basis.modes, basis.patch_motion, load_envelope) / basis.omega_squared


def _ordered(basis: Basis, amplitude: Array) -> tuple[Basis, Array]:
    """The basis and amplitudes, by the deflection of the modes."""
    order = np.argsort(-np.abs(basis.modes).max(axis=(0, 1)) * amplitude, kind="stable")
    ordered = replace(
        basis,
        modes=basis.modes[:, :, order],
        omega_squared=basis.omega_squared[order],
        patch_motion=basis.patch_motion[:, :, order],
    )
    return ordered, amplitude[order]
