"""The elastic material of a flexible body."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from calmotion.errors import ShotError
from calmotion.model import ElasticMaterial
from calmotion.usd import schemas
from calmotion.usd.dialects import number_of
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_below

if TYPE_CHECKING:
    from pxr import Usd

ELASTIC = "PhysicsVolumeDeformableMaterialAPI"  # of the AOUSD proposal; usd-core does not define it
_REMEDY = (
    f"Bind a Material for the purpose `physics` (material:binding:physics) with {ELASTIC} and its attributes "
    "physics:youngsModulus, physics:poissonsRatio and physics:density, or remove CalmFlexibleBodyAPI"
)


def elastic_material(reading: Reading, body_prim: Usd.Prim) -> ElasticMaterial:
    """The material bound for physics to a body, else to geometry below it.

    Raises:
        ShotError: No elastic material is bound, or one of its values is out of range.
    """
    bound = None
    for prim in prims_below(body_prim, is_rigid_body):
        material = _bound(prim)
        if material is not None:
            bound = bound or material
            if _is_elastic(material):
                return _material(reading, material)
    raise ShotError(
        "a flexible body without an elastic material",
        path=body_prim.GetPath(),
        attribute="material:binding:physics",
        found=f"{bound.GetPath()}, which is not elastic" if bound else None,
        remedy=_REMEDY,
    )


def bound_elastic_material(reading: Reading, prim: Usd.Prim) -> ElasticMaterial | None:
    """The elastic material bound for physics to one prim, itself or above it; None where there is none.

    Raises:
        ShotError: One of its values is out of range.
    """
    material = _bound(prim)
    return None if material is None or not _is_elastic(material) else _material(reading, material)


def _bound(prim: Usd.Prim) -> Usd.Prim | None:
    from pxr import UsdShade

    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
    return material.GetPrim() if material else None


def _is_elastic(material: Usd.Prim) -> bool:
    return schemas.is_applied(material, ELASTIC) or bool(material.GetAttribute("physics:youngsModulus"))


def _material(reading: Reading, prim: Usd.Prim) -> ElasticMaterial:
    units = reading.units
    modulus = _number(prim, "physics:youngsModulus", lambda x: x > 0.0, "must be positive")
    ratio = _number(prim, "physics:poissonsRatio", lambda x: -1.0 < x < 0.5, "must lie between -1 and 0.5, exclusively")
    density = _number(prim, "physics:density", lambda x: x > 0.0, "must be positive")
    damping = float(schemas.value(prim, "CalmDampingAPI", "calm:damping:ratio"))
    schemas.require(
        0.0 <= damping < 1.0, prim, "calm:damping:ratio", damping, "must lie between 0 and 1 (critical damping)",
        "Author a fraction of critical damping, such as 0.01",
    )  # fmt: skip
    rayleigh = [_rayleigh(prim, name) for name in ("calm:damping:rayleighMass", "calm:damping:rayleighStiffness")]
    return ElasticMaterial(
        path=str(prim.GetPath()),
        youngs_modulus=units.pressure(modulus),
        poissons_ratio=ratio,
        density=units.density(density),
        damping_ratio=damping,
        rayleigh=None if rayleigh == [None, None] else (rayleigh[0] or 0.0, rayleigh[1] or 0.0),
    )


def _number(prim: Usd.Prim, name: str, allowed: Callable[[float], bool], problem: str) -> float:
    value = number_of(prim, name)
    if value is None:
        raise ShotError("is not authored", path=prim.GetPath(), attribute=name, remedy=_REMEDY)
    schemas.require(math.isfinite(value) and allowed(value), prim, name, value, problem)
    return value


def _rayleigh(prim: Usd.Prim, name: str) -> float | None:
    value = schemas.value(prim, "CalmDampingAPI", name)
    if value is None:
        return None
    schemas.require(math.isfinite(value) and value >= 0.0, prim, name, value, "must not be negative")
    return float(value)
