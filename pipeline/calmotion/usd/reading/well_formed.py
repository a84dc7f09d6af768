"""Checks before reading: types of authored properties, and orders of transform operations. Readers rely on them."""

import re
from collections.abc import Iterator

from pxr import Sdf, Tf, Usd, UsdGeom

from calmotion.errors import ShotError
from calmotion.usd.reading.animated import animation_codes
from calmotion.usd.reading.context import is_rigid_body, prims_of
from calmotion.usd.schemas import NAMES

_PHYSICS = ("PhysicsMassAPI", "PhysicsRigidBodyAPI", "PhysicsCollisionAPI", "PhysicsMaterialAPI")
_DRIVE, _DRIVES = "PhysicsDriveAPI", ("angular", "linear")
_SAME_IN_PYTHON = {
    "text": ("TfToken", "std::string"),
    "real": ("GfHalf", "float", "double"),
    "whole": ("int", "unsigned int", "int64_t", "uint64_t"),
}
_RESET, _INVERSE = "!resetXformStack!", "!invert!"


def wrong_types(stage: Usd.Stage) -> Iterator[ShotError]:
    """Authored properties whose type differs from that of their schema.

    USD accepts such opinions silently and returns values of the authored type. Attributes of Calmotion, masses and
    drives are checked even where their schema is not applied.
    """
    known = _known()
    # also classes and undefined prims: materials may be bound there
    for prim in stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimIsActive)):
        definition = prim.GetPrimDefinition()
        for prop in prim.GetAuthoredProperties():
            name = prop.GetName()
            wanted = known.get(name) or _type_of(definition, name)
            if not wanted:
                continue
            for spec in prop.GetPropertyStack():
                found = str(spec.typeName) if isinstance(spec, Sdf.AttributeSpec) else "rel"
                if found != wanted and not _alike(found, wanted):
                    yield ShotError(
                        "is authored with a type that differs from its schema",
                        path=prim.GetPath(),
                        attribute=name,
                        found=f"{found or 'no type'} in {spec.layer.identifier}",
                        remedy=f"Author it as {wanted}",
                    )
                    break


def broken_transforms(stage: Usd.Stage) -> Iterator[ShotError]:
    """Prims whose xformOpOrder names an operation that does not exist or has a wrong type, and bodies with animated
    operations without an order, which USD does not apply."""
    for prim in prims_of(stage):
        order = prim.GetAttribute("xformOpOrder")
        if is_rigid_body(prim) and (unordered := _animated_without_order(prim)):
            yield ShotError(
                "does not name the animated transform operations of this body, so that USD does not apply them",
                path=prim.GetPath(),
                attribute="xformOpOrder",
                found=", ".join(unordered),
                remedy="Author the order, such as by UsdGeom.XformCommonAPI, or remove the operations",
            )
        if not order or not order.HasAuthoredValue() or not prim.IsA(UsdGeom.Xformable):
            continue
        names = [str(name) for name in order.Get() or ()]
        operations = [(name, name.removeprefix(_INVERSE)) for name in names if name != _RESET]
        wrong = [name for name, op in operations if not op.startswith("xformOp:") or not prim.HasAttribute(op)]
        try:
            if not wrong:
                UsdGeom.Xformable(prim).GetLocalTransformation()
        except Tf.ErrorException as error:
            wrong = [str(error).strip().splitlines()[0].rpartition(" : ")[2]]
        if wrong:
            yield ShotError(
                "names transform operations that do not exist, or are of a wrong type",
                path=prim.GetPath(),
                attribute="xformOpOrder",
                found=", ".join(dict.fromkeys(wrong)) or "an empty name",
                remedy="Correct the order, or author the operations",
            )


def _animated_without_order(prim: Usd.Prim) -> list[str]:
    """Names of the animated transform operations of a prim that has no order of operations."""
    order = prim.GetAttribute("xformOpOrder")
    if order and order.HasAuthoredValue():
        return []
    properties = prim.GetAuthoredPropertiesInNamespace("xformOp")
    return [prop.GetName() for prop in properties if animation_codes(prim.GetAttribute(prop.GetName()))]


def _type_of(definition: Usd.PrimDefinition, name: str) -> str:
    """Type of a property of a schema, `rel` for a relationship; empty for one that the schema does not have."""
    kind = definition.GetSpecType(name)
    if kind == Sdf.SpecTypeRelationship:
        return "rel"
    if kind != Sdf.SpecTypeAttribute:
        return ""
    return str(definition.GetAttributeDefinition(name).GetTypeName())


def _known() -> dict[str, str]:
    """Type of every property of our schemas, and of those of UsdPhysics that are read wherever they are authored."""
    registry = Usd.SchemaRegistry()
    found: dict[str, str] = {}
    for schema in (*NAMES, *_PHYSICS, _DRIVE):
        definition = registry.FindAppliedAPIPrimDefinition(schema)
        for name in map(str, definition.GetPropertyNames() if definition else ()):
            if schema == _DRIVE:
                found |= {name.replace("__INSTANCE_NAME__", drive): _type_of(definition, name) for drive in _DRIVES}
            else:
                found[name] = _type_of(definition, name)
    return found


def _alike(found: str, wanted: str) -> bool:
    """Whether values of two types are the same in Python, such as of `point3f[]` and `float3[]`, or of float and
    double."""
    one, other = (Sdf.ValueTypeNames.Find(name) for name in (found, wanted))
    return bool(one and other) and one.isArray == other.isArray and _kind(one) == _kind(other)


def _kind(of: Sdf.ValueTypeName) -> str:
    """What a value, or an element of an array, is, whatever its precision and role."""
    name = re.sub(r"^(Gf(?:Vec|Quat|Matrix)\d?)[dfh]$", r"\1", str(of.scalarType.cppTypeName))
    return next((kind for kind, names in _SAME_IN_PYTHON.items() if name in names), name)
