"""What is authored of Calmotion and not read: misspelt attributes, those without their schema, misplaced schemas."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from calmotion.errors import ShotError
from calmotion.support.naming import nearest
from calmotion.usd import schemas
from calmotion.usd.reading.context import is_rigid_body, prims_of

if TYPE_CHECKING:
    from pxr import Usd

_NAMESPACE = "calm"
_READ_ANYWAY = ("CalmMotorAPI", "CalmDampingAPI")  # on what UsdPhysics makes a motor or a material
_FREE_NAMES = ("calm:interface:",)  # relationships of subsets, which need no schema


def unread_attributes(stage: Usd.Stage, declared: bool = False) -> Iterator[ShotError]:
    """Attributes in the namespace calm: that are not read, as warnings.

    Args:
        stage: The shot.
        declared: Also those that are read though the schema that declares them is not applied.
    """
    owners = _owners()
    for prim in prims_of(stage):
        for prop in prim.GetAuthoredPropertiesInNamespace(_NAMESPACE):
            name = str(prop.GetName())
            if name.startswith(_FREE_NAMES):
                continue
            owner = owners.get(name, "")
            if not owner:
                yield ShotError(
                    "no schema of Calmotion has this attribute", path=prim.GetPath(), attribute=name,
                    remedy=nearest(name, owners) or f"The names are {', '.join(sorted(owners))}",
                )  # fmt: skip
            elif (declared or owner not in _READ_ANYWAY) and not schemas.is_applied(prim, owner):
                problem = "is declared by" if owner in _READ_ANYWAY else "is not read: it needs"
                yield ShotError(
                    f"{problem} {owner}, which is not applied", path=prim.GetPath(), attribute=name,
                    remedy=f"Apply {owner}, or remove the attribute",
                )  # fmt: skip


def misplaced_schemas(stage: Usd.Stage) -> Iterator[ShotError]:
    """Calmotion's schemas on prims of the wrong kind, where they have no effect, as warnings."""
    from pxr import UsdGeom, UsdPhysics, UsdShade

    fits = {
        "CalmFlexibleBodyAPI": (is_rigid_body, "a body (PhysicsRigidBodyAPI)"),
        "CalmDampingAPI": (lambda prim: prim.IsA(UsdShade.Material), "a Material"),
        "CalmMotorAPI": (lambda prim: prim.IsA(UsdPhysics.Joint), "a joint"),
        "CalmTargetAPI": (lambda prim: prim.IsA(UsdGeom.Xformable), "an Xform"),
    }
    for prim in prims_of(stage):
        for schema in filter(fits.__contains__, map(str, prim.GetAppliedSchemas())):
            allowed, what = fits[schema]
            if not allowed(prim):
                yield ShotError(
                    f"{schema} belongs on {what}, and has no effect here", path=prim.GetPath(), attribute="apiSchemas",
                    found=str(prim.GetTypeName()) or "a prim without a type",
                    remedy="Move the schema there, or remove it",
                )  # fmt: skip


def _owners() -> dict[str, str]:
    """The schema of each attribute."""
    from pxr import Usd

    registry, found = Usd.SchemaRegistry(), {}
    for schema in schemas.NAMES:
        definition = registry.FindAppliedAPIPrimDefinition(schema)
        for name in definition.GetPropertyNames() if definition else ():
            found[str(name)] = schema
    return found
