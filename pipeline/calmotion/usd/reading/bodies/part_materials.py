"""Materials that are bound to single meshes of a flexible body: an assembly of parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calmotion.errors import ShotError
from calmotion.mesh.tetrahedra import surface_volume
from calmotion.model import ElasticMaterial
from calmotion.model.materials.parts import Part
from calmotion.usd.reading.bodies.materials import bound_elastic_material
from calmotion.usd.reading.bodies.shapes import Shape
from calmotion.usd.reading.context import Reading

if TYPE_CHECKING:
    from pxr import Usd

_SAME_RATIO = 1e-6  # difference of Poisson's ratios that is none


def with_parts(
    reading: Reading, body_prim: Usd.Prim, material: ElasticMaterial, shapes: Sequence[Shape]
) -> ElasticMaterial:
    """The material of a body, with its parts where its visible meshes have several elastic materials.

    A mesh without one of its own has that of the body. All parts have one Poisson's ratio, the mean by stiffness and
    volume, and Rayleigh coefficients of the body's material.

    Args:
        reading: Of the shot.
        body_prim: The flexible body.
        material: Bound to it, or to the first mesh below it.
        shapes: Its geometry.

    Raises:
        ShotError: A value of a material is out of range, or the body is printed with infill as well.
    """
    solids = [s for s in shapes if s.surface.drawn] or [s for s in shapes if len(s.surface.triangles)]
    own = [bound_elastic_material(reading, shape.prim) or material for shape in solids]
    paths = sorted({found.path for found in own})
    if len(paths) < 2:
        return material
    if material.core is not None:
        raise ShotError(
            "is that of a part of one material, but its meshes have several", path=body_prim.GetPath(),
            attribute="calm:flexible:infill", found=", ".join(paths),
            remedy="Bind one material for `physics`, or remove calm:flexible:infill and lower the modulus and density "
            "of the printed part",
        )  # fmt: skip
    volumes = [abs(surface_volume(shape.surface.points, shape.surface.triangles)) for shape in solids]
    stiffness = np.array([found.youngs_modulus * volume for found, volume in zip(own, volumes, strict=True)])
    ratios = np.array([m.poissons_ratio for m in own])
    ratio = float(stiffness @ ratios / stiffness.sum()) if stiffness.sum() > 0.0 else material.poissons_ratio
    path = body_prim.GetPath()
    if np.ptp(ratios) > _SAME_RATIO:
        span = f"{ratios.min():g} to {ratios.max():g}"
        reading.note(f"{path}: its parts have Poisson's ratios of {span}; {ratio:.3g} is used for all")
    if any(m.rayleigh != material.rayleigh for m in own):
        reading.note(f"{path}: its parts have different Rayleigh damping; that of {material.path} is used")
    parts = tuple(
        Part(
            path=shape.surface.path, material=m.path, points=shape.surface.points, triangles=shape.surface.triangles,
            modulus=m.youngs_modulus / material.youngs_modulus, density=m.density / material.density,
            damping=m.damping_ratio,
        )
        for m, shape in zip(own, solids, strict=True)
    )  # fmt: skip
    return replace(material, poissons_ratio=ratio, parts=parts)
