"""Materials of robots, authored with the schemas that the reader takes them from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calmotion.catalogs.materials import Material
from calmotion.usd.units import StageUnits

if TYPE_CHECKING:
    from pxr import Usd, UsdShade


def author_material(stage: Usd.Stage, path: str, material: Material, units: StageUnits) -> UsdShade.Material:
    """Define an elastic material.

    Args:
        stage: Where it is authored.
        material: The material, SI.
    """
    from pxr import Sdf, UsdPhysics, UsdShade

    shader = UsdShade.Material.Define(stage, path)
    prim = shader.GetPrim()
    UsdPhysics.MaterialAPI.Apply(prim).CreateDensityAttr(material.density / units.density(1.0))
    prim.AddAppliedSchema("PhysicsVolumeDeformableMaterialAPI")
    prim.AddAppliedSchema("CalmDampingAPI")
    for name, value in (
        ("physics:youngsModulus", material.youngs_modulus / units.pressure(1.0)),
        ("physics:poissonsRatio", material.poissons_ratio),
        ("calm:damping:ratio", material.damping_ratio),
    ):
        prim.CreateAttribute(name, Sdf.ValueTypeNames.Float, custom=False).Set(value)
    return shader
