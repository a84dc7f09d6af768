"""Flexible bodies: which they are, their materials, and how to mesh and reduce them."""

import os
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pxr import Usd, UsdShade

from calmotion.errors import ShotError
from calmotion.mesh.tetrahedra import surface_volume
from calmotion.model import ElasticMaterial, FlexibleSettings
from calmotion.model.meshes import LINE_WIDTH, PERIMETERS, Core, Part, core_of
from calmotion.usd import schemas
from calmotion.usd.dependencies import refuse_place
from calmotion.usd.dialects import number_of, number_or
from calmotion.usd.reading.bodies.shapes import Shape
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_below
from calmotion.usd.transforms import Pose

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
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
    return material.GetPrim() if material else None


def _is_elastic(material: Usd.Prim) -> bool:
    return schemas.is_applied(material, ELASTIC) or bool(material.GetAttribute("physics:youngsModulus"))


def _material(reading: Reading, prim: Usd.Prim) -> ElasticMaterial:
    units = reading.units
    values = []
    for name in ("physics:youngsModulus", "physics:poissonsRatio", "physics:density"):
        value = number_of(prim, name)
        if value is None or (value == 0.0 and name == "physics:density"):
            raise ShotError("is not authored", path=prim.GetPath(), attribute=name, remedy=_REMEDY)
        values.append(value)
    usual = schemas.value(prim, "CalmDampingAPI", "calm:damping:ratio")
    rayleigh = [number_of(prim, f"calm:damping:rayleigh{of}") for of in ("Mass", "Stiffness")]
    return ElasticMaterial(
        path=str(prim.GetPath()),
        youngs_modulus=units.pressure(values[0]),
        poissons_ratio=values[1],
        density=units.density(values[2]),
        damping_ratio=number_or(prim, "calm:damping:ratio", usual),
        rayleigh=None if rayleigh == [None, None] else (rayleigh[0] or 0.0, rayleigh[1] or 0.0),
    )


_SCHEMA, _INFILL, _PERIMETERS = "CalmFlexibleBodyAPI", "calm:flexible:infill", "calm:flexible:perimeters"


def print_of(reading: Reading, prim: Usd.Prim, wall: float, section: str) -> tuple[float, Core | None]:
    """The wall of a hollow body [m], -1 for a solid one, and the core of a printed one.

    Args:
        wall: `calm:flexible:wallThickness` [m]; -1: not authored. With infill it is the skin.
        section: `calm:flexible:section`.

    Raises:
        ShotError: A value is out of range, or two of them contradict each other.
    """
    infill = float(schemas.value(prim, _SCHEMA, _INFILL))
    perimeters = int(schemas.value(prim, _SCHEMA, _PERIMETERS))
    problem = "must be a number of lines of at least 1, or -1 for automatic"
    schemas.require(perimeters == -1 or perimeters >= 1, prim, _PERIMETERS, perimeters, problem)
    if infill == -1.0:
        schemas.require(
            perimeters == -1,
            prim,
            _PERIMETERS,
            perimeters,
            "says how thick the skin of a printed part is, but the part has no infill",
            f"Author {_INFILL} as well (1 for a part that is printed solid), or remove it",
        )
        return wall, None
    problem = "must be a share between 0 and 1, or -1 for a part without infill"
    schemas.require(0.0 <= infill <= 1.0, prim, _INFILL, infill, problem, "Author 0.2 for 20%, or remove the attribute")
    problem = "and calm:flexible:wallThickness both say how thick the skin of a printed part is"
    both = f"{perimeters} lines and {wall:.3g} m"
    schemas.require(wall <= 0.0 or perimeters == -1, prim, _PERIMETERS, both, problem, "Remove one of them")
    problem, remedy = "is that of a hollow part, but the part has infill", f"Remove it, or set {_INFILL} to 0"
    schemas.require(section != "tube" or infill <= 0.0, prim, "calm:flexible:section", section, problem, remedy)
    skin = wall if wall > 0.0 else LINE_WIDTH * (PERIMETERS if perimeters == -1 else perimeters)
    if infill == 1.0:
        return -1.0, None
    if infill == 0.0:
        return skin, None
    reading.note(f"{prim.GetPath()}: printed with a skin of {1e3 * skin:.3g} mm and {100.0 * infill:.3g}% infill")
    return -1.0, core_of(infill, skin)


_SAME_RATIO = 1e-6  # difference of Poisson's ratios that is none


def with_parts(
    reading: Reading, body_prim: Usd.Prim, material: ElasticMaterial, shapes: Sequence[Shape]
) -> ElasticMaterial:
    """The material of a body, with its parts where its visible meshes have several elastic materials.

    A mesh without one of its own has that of the body. All parts have one Poisson's ratio, the mean by stiffness and
    volume, and Rayleigh coefficients of the body's material.

    Args:
        material: Bound to it, or to the first mesh below it.

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
            "is that of a part of one material, but its meshes have several",
            path=body_prim.GetPath(),
            attribute="calm:flexible:infill",
            found=", ".join(paths),
            remedy="Bind one material for `physics`, or remove calm:flexible:infill and lower the modulus and density "
            "of the printed part",
        )
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


_ELASTICITY = ("auto", "linear", "stvk", "neohookean")
_GEOMETRY = ("auto", "visual", "collision", "beam")
_SECTION = ("auto", "closed", "tube")


def flexible_settings(reading: Reading, prim: Usd.Prim, pose: Pose) -> FlexibleSettings | None:
    """The settings of a flexible body, or None for a rigid one.

    Raises:
        ShotError: A value out of range, a mesh file that is missing, no elastic material.
    """
    if not schemas.is_applied(prim, _SCHEMA):
        if any(a.GetName().startswith("calm:flexible:") for a in prim.GetAuthoredAttributes()):
            reading.note(f"{prim.GetPath()}: it has calm:flexible attributes but not {_SCHEMA}, so it stays rigid")
        return None
    if not schemas.value(prim, _SCHEMA, "calm:flexible:enabled"):
        return None
    mesh_file = _mesh_file(prim)
    section = _named(prim, "section", _SECTION, "a section")
    wall, core = print_of(reading, prim, _length(reading, prim, "calm:flexible:wallThickness"), section)
    return FlexibleSettings(
        material=replace(elastic_material(reading, prim), core=core),
        mode_count=int(schemas.automatic(prim, _SCHEMA, "calm:flexible:modeCount") or -1),
        max_frequency=schemas.automatic(prim, _SCHEMA, "calm:flexible:maxFrequency") or -1.0,
        element_size=_length(reading, prim, "calm:flexible:elementSize"),
        interface_radius=_length(reading, prim, "calm:flexible:interfaceRadius"),
        mesh_file=mesh_file,
        mesh_scale=_mesh_scale(reading, prim, pose) if mesh_file else 1.0,
        elasticity=_named(prim, "elasticity", _ELASTICITY, "an elasticity model"),
        wall_thickness=wall,
        section=section,
        geometry=_named(prim, "geometry", _GEOMETRY, "a source of geometry"),
    )


def _named(prim: Usd.Prim, name: str, allowed: tuple[str, ...], what: str) -> str:
    return schemas.choice(prim, _SCHEMA, f"calm:flexible:{name}", allowed, f"names {what} that does not exist")


def _length(reading: Reading, prim: Usd.Prim, name: str) -> float:
    value = schemas.automatic(prim, _SCHEMA, name)
    return -1.0 if value is None else reading.units.length(value)


def _mesh_file(prim: Usd.Prim) -> str:
    """The external mesh, resolved against the layer that names it; empty when there is none."""
    name = "calm:flexible:meshFile"
    asset = schemas.value(prim, _SCHEMA, name)
    if asset is None or not asset.path:
        return ""
    for path in filter(None, (asset.path, asset.resolvedPath)):
        refuse_place(path, str(prim.GetPath()), name)
    remedy = "Put the file there, or correct or remove the attribute"
    found = bool(asset.resolvedPath) and os.path.exists(asset.resolvedPath)
    schemas.require(found, prim, name, f"@{asset.path}@", "names a mesh file that is missing", remedy)
    return str(asset.resolvedPath)


def _mesh_scale(reading: Reading, prim: Usd.Prim, pose: Pose) -> float:
    """Metres per unit of an external mesh, which is in the body's own axes."""
    alike = bool(np.allclose(pose.scale, pose.scale[0], rtol=1e-5) and pose.scale[0] >= 0.0)
    schemas.require(
        alike,
        prim,
        "calm:flexible:meshFile",
        pose.scale.tolist(),
        "an external mesh needs a body without a mirrored scale or one that differs by axis",
        "Freeze the scale of the body, or put the mesh into the shot",
    )
    return float(reading.units.length(pose.scale[0]))
