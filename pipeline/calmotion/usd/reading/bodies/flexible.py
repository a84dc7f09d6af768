"""Flexible bodies: which they are, and how to mesh and reduce them."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calmotion.model import FlexibleSettings
from calmotion.usd import schemas
from calmotion.usd.dependencies import refuse_place
from calmotion.usd.reading.bodies.materials import elastic_material
from calmotion.usd.reading.bodies.prints import print_of
from calmotion.usd.reading.context import Reading
from calmotion.usd.transforms import Pose

if TYPE_CHECKING:
    from pxr import Usd

_SCHEMA = "CalmFlexibleBodyAPI"
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
        alike, prim, "calm:flexible:meshFile", pose.scale.tolist(),
        "an external mesh needs a body without a mirrored scale or one that differs by axis",
        "Freeze the scale of the body, or put the mesh into the shot",
    )  # fmt: skip
    return float(reading.units.length(pose.scale[0]))
