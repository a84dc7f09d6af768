"""The elastic laws of a body, cheapest first, and the one that a shot needs."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from calmotion.model.character import FlexibleSettings
from calmotion.model.result import Simplification
from calmotion.model.tolerance import REDUCTION
from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.basis.modal_derivatives import Support
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.material_laws.bending import Bending
from calmotion.reduction.material_laws.cubature import InaccurateCubature
from calmotion.reduction.material_laws.deflection import Deflection, deflection_under
from calmotion.reduction.material_laws.large_deflection import NEGLIGIBLE_ENERGY, large_deflection
from calmotion.reduction.reduced_body import Elasticity

_LARGE_STRAIN = 0.1  # below, the bound of the loads is too pessimistic to require a nonlinear material


class MaterialLaw(ABC):
    """A law, with its own error."""

    name: ClassVar[str]
    simplifies: ClassVar[str] = ""  # what, for the report

    @abstractmethod
    def error_m(self, deflection: Deflection) -> float:
        """Estimated error at the interfaces of a body, or at targets beyond them [m]."""

    def serves(self, deflection: Deflection, tolerance: float) -> bool:
        """Whether its error is within a tolerance [m]."""
        return self.error_m(deflection) <= tolerance

    def why(self, deflection: Deflection) -> str:
        """Why it was chosen, for the report."""
        linear = f"a linear law would have an error of about {_mm(deflection.linear_error_m)}"
        return f"its deflection is about {_mm(deflection.size_m)}; {linear}; its strain is {deflection.strain:.1%}"


class Linear(MaterialLaw):
    """Hooke's law with linear strain."""

    name, simplifies = "linear", "linear elasticity"

    def error_m(self, deflection: Deflection) -> float:
        return deflection.linear_error_m

    def why(self, deflection: Deflection) -> str:
        return super().why(deflection).rpartition(";")[0]


class StVenantKirchhoff(MaterialLaw):
    """Hooke's law with quadratic strain.

    It omits the nonlinearity of the material, a relative error of the order of the strain. In bending, the errors of
    the two sides cancel, and the rest is of the order of the square of the strain.
    """

    name, simplifies = "stvk", "linear material, with nonlinear strain"

    def error_m(self, deflection: Deflection) -> float:
        return deflection.moved_m * deflection.strain**2

    def serves(self, deflection: Deflection, tolerance: float) -> bool:
        return super().serves(deflection, tolerance) or deflection.strain <= _LARGE_STRAIN


class NeoHookean(MaterialLaw):
    """W = mu/2 (tr C - 3) - mu ln J + lambda/2 ln^2 J."""

    name = "neohookean"

    def error_m(self, deflection: Deflection) -> float:
        return 0.0


LAWS: tuple[MaterialLaw, ...] = (Linear(), StVenantKirchhoff(), NeoHookean())


@dataclass(frozen=True, eq=False)
class BodyByLaw:
    """A body with its elastic law.

    Attributes:
        basis: With modal derivatives where the law is not linear.
        elasticity: None of a linear body.
        told: What is simplified.
        limit_m: Estimated error that no smaller tolerance takes away [m].
    """

    basis: Basis
    elasticity: Elasticity | None
    told: tuple[Simplification, ...]
    limit_m: float = 0.0


def law_for(deflection: Deflection, tolerance: float) -> MaterialLaw:
    """The cheapest law that serves within a tolerance [m]."""
    return next(law for law in LAWS if law.serves(deflection, tolerance))


def reduced_by_law(
    model: FEModel, support: Support, basis: Basis, settings: FlexibleSettings, load_envelope: LoadEnvelope | None,
    tolerance: float, path: str,
) -> BodyByLaw:  # fmt: skip
    """A body with the law of its settings, or with the cheapest one whose estimated error is within the tolerance.

    Args:
        model, support, basis: The body with its linear modes.
        settings: Its law, and the material of its elements.
        load_envelope: Its loads in this shot; None when they are not known.
        tolerance: [m].

    Raises:
        ShotError: The body is too soft for any of the laws, or they cannot be evaluated accurately.
    """
    law: MaterialLaw | None = next((law for law in LAWS if law.name == settings.elasticity), None)
    linear, material = LAWS[0], settings.material
    if not len(basis.omega_squared):
        return BodyByLaw(basis, None, _told(linear, path, "it has no elastic coordinates", 0.0))
    if law is linear:
        return BodyByLaw(basis, None, _told(linear, path, "calm:flexible:elasticity is linear", None))
    if load_envelope is None:
        if law is None:
            return BodyByLaw(basis, None, _told(linear, path, "its deflection is not known without a motion", None))
        return BodyByLaw(*large_deflection(model, support, basis, material, law.name, None, tolerance), ())
    loads = basis.load_envelope or load_envelope
    bending = Bending.by_loads(model, support, basis, material, loads)
    told: tuple[Simplification, ...] = ()
    deflection: Deflection | None = None
    if law is None:
        assert bending.derivatives is not None
        deflection = deflection_under(model, bending.basis, bending.derivatives, material, load_envelope, path)
        law = law_for(deflection, tolerance)
        told = _told(law, path, law.why(deflection), law.error_m(deflection))
        if law is linear:
            return BodyByLaw(basis, None, told)
    bending = bending.with_third_order(model, support, material, loads, tolerance)

    def by_law(law: MaterialLaw) -> tuple[Basis, Elasticity]:
        return large_deflection(
            model, support, basis, material, law.name, load_envelope, tolerance, settings.pairs_share, bending
        )

    try:
        longer, elasticity = by_law(law)
    except InaccurateCubature:
        if deflection is None:
            raise
        law = LAWS[1]  # nobody asked for another
        longer, elasticity = by_law(law)
        told = _told(law, path, law.why(deflection), law.error_m(deflection))
    limits = (*_locking(bending, path, tolerance), *_no_room(model, longer, path, tolerance))
    limit = sum(row.estimated_error_m or 0.0 for row in limits)
    return BodyByLaw(longer, elasticity, (*told, *limits, *_omitted_strain(elasticity, path)), limit)


def _told(law: MaterialLaw, path: str, why: str, error_m: float | None) -> tuple[Simplification, ...]:
    if not law.simplifies:
        return ()
    return (Simplification(f"{path}: {law.simplifies}", why, error_m, REDUCTION),)


def _locking(bending: Bending, path: str, tolerance: float) -> tuple[Simplification, ...]:
    """That a body resists its bending, where this is not negligible."""
    if bending.missing_m <= tolerance:
        return ()
    why = "bending flattens wide thin strips in more ways than its modes have"
    return (Simplification(f"{path}: too stiff under large deflections", why, bending.missing_m, REDUCTION),)


def _no_room(model: FEModel, basis: Basis, path: str, tolerance: float) -> tuple[Simplification, ...]:
    """That a body deflects in more ways than its basis has room for, where this is not negligible."""
    error = basis.dropped * float(np.ptp(model.mesh.nodes, axis=0).max()) / NEGLIGIBLE_ENERGY
    if error <= tolerance:
        return ()
    what = f"{path}: {len(basis.omega_squared)} elastic coordinates, the most there are"
    why = "this shot deflects it in more ways; a step that no motor can follow does so, which smooth keys mend"
    return (Simplification(what, why, error, REDUCTION),)


def _omitted_strain(law: Elasticity, path: str) -> tuple[Simplification, ...]:
    """The coordinates without quadratic strain, with the estimated error."""
    if law.strain_projection is None:
        return ()
    p, r = law.strain_projection.shape
    what = f"{path}: quadratic strain in {p} of {r} elastic coordinates"
    why = "the loads of this shot cause almost no rotation in the others"
    return (Simplification(what, why, law.strain_error_m, REDUCTION),)


def _mm(length: float) -> str:
    return f"{1e3 * length:.3g} mm"
