"""What is authored and has no effect: misspelt attributes, misplaced schemas, physics that is not simulated."""

import math
from collections.abc import Iterable, Iterator, Sequence

from pxr import Usd, UsdGeom, UsdPhysics, UsdShade

from calmotion.errors import ShotError
from calmotion.support.naming import nearest
from calmotion.usd import schemas
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_of, switched_off_body
from calmotion.usd.reading.joints.joint_prims import JointPrim

_NAMESPACE = "calm"
_READ_ANYWAY = ("CalmMotorAPI", "CalmDampingAPI")  # on what UsdPhysics makes a motor or a material
_FREE_NAMES = ("calm:interface:",)  # relationships of subsets, which need no schema


def unread_attributes(stage: Usd.Stage, declared: bool = False) -> Iterator[ShotError]:
    """Attributes in the namespace calm: that are not read, as warnings.

    Args:
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
                    "no schema of Calmotion has this attribute",
                    path=prim.GetPath(),
                    attribute=name,
                    remedy=nearest(name, owners) or f"The names are {', '.join(sorted(owners))}",
                )
            elif (declared or owner not in _READ_ANYWAY) and not schemas.is_applied(prim, owner):
                problem = "is declared by" if owner in _READ_ANYWAY else "is not read: it needs"
                yield ShotError(
                    f"{problem} {owner}, which is not applied",
                    path=prim.GetPath(),
                    attribute=name,
                    remedy=f"Apply {owner}, or remove the attribute",
                )


def misplaced_schemas(stage: Usd.Stage) -> Iterator[ShotError]:
    """Calmotion's schemas on prims of the wrong kind, where they have no effect, as warnings."""
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
                    f"{schema} belongs on {what}, and has no effect here",
                    path=prim.GetPath(),
                    attribute="apiSchemas",
                    found=str(prim.GetTypeName()) or "a prim without a type",
                    remedy="Move the schema there, or remove it",
                )


def _owners() -> dict[str, str]:
    """The schema of each attribute."""
    registry, found = Usd.SchemaRegistry(), {}
    for schema in schemas.NAMES:
        definition = registry.FindAppliedAPIPrimDefinition(schema)
        for name in definition.GetPropertyNames() if definition else ():
            found[str(name)] = schema
    return found


_NEVER = 1e30  # and more stands for no limit: some programs author the largest float
_AT_REST = "a shot starts at rest, or eases into its motion"
_ALL_WEIGH = "gravity acts on the body"
_NOTHING_BRAKES = "nothing but joints brakes the body"
_NO_BREAK = "joints do not break; the table of --csv has their reactions"
_EXACT = "limits are exact"
_CURVE = "a motor follows its targetPosition; animate that where a speed is meant, as of wheels"
# attribute, `{drive}` being that of the joint; values that change nothing, from and to; why it is not used
OF_BODIES = (
    ("physics:velocity", 0.0, 0.0, _AT_REST),
    ("physics:angularVelocity", 0.0, 0.0, _AT_REST),
    ("physxRigidBody:disableGravity", 0.0, 0.0, _ALL_WEIGH),
    ("mjc:gravcomp", 0.0, 0.0, _ALL_WEIGH),
    ("mjc:body:gravcomp", 0.0, 0.0, _ALL_WEIGH),
    ("physxRigidBody:linearDamping", 0.0, 0.0, _NOTHING_BRAKES),
    ("physxRigidBody:angularDamping", 0.0, 0.05, _NOTHING_BRAKES),  # the fallback of PhysX
    ("physxRigidBody:lockedPosAxis", 0.0, 0.0, "a joint to the world holds a body"),
    ("physxRigidBody:lockedRotAxis", 0.0, 0.0, "a joint to the world holds a body"),
)
OF_JOINTS = (
    ("physics:breakForce", _NEVER, math.inf, _NO_BREAK),
    ("physics:breakTorque", _NEVER, math.inf, _NO_BREAK),
    ("drive:{drive}:physics:targetVelocity", 0.0, 0.0, _CURVE),
    ("physxLimit:{drive}:stiffness", 0.0, 0.0, _EXACT),
    ("physxLimit:{drive}:damping", 0.0, 0.0, _EXACT),
    ("physxDrivePerformanceEnvelope:{drive}:velocityDependentResistance", 0.0, 0.0, "viscousFriction of a servo is"),
    ("physxDrivePerformanceEnvelope:{drive}:speedEffortGradient", 0.0, 0.0, "torqueSpeedKnee of a servo is"),
    ("isaac:physics:AccelerationLimit", _NEVER, math.inf, "calm:motor:maxAcceleration is"),
    ("isaac:physics:JerkLimit", _NEVER, math.inf, "calm:motor:maxJerk is"),
)

# begin of the names of schemas; why they are not used
OF_SCHEMAS = (
    ("PhysxTendon", "tendons are not simulated, so that they couple no joints"),
    ("PhysxForce", "a force on a body is not simulated"),
)


def tell_what_is_not_used(reading: Reading, bodies: Iterable[Usd.Prim], joints: Sequence[JointPrim]) -> None:
    """Note attributes of the character's bodies and joints that have a value and no effect.

    Args:
        bodies: Prims of its bodies.
    """
    for prim in bodies:
        _tell(reading, prim, "", OF_BODIES)
        _tell_of_schemas(reading, prim)
    told: set[tuple[str, str]] = set()
    for joint in joints:
        if joint.prim is not None and (joint.prim_path, joint.drive) not in told:
            told.add((joint.prim_path, joint.drive))
            _tell_of_schemas(reading, joint.prim)
            _tell(reading, joint.prim, joint.drive, OF_JOINTS)
            _tell_of_switched_off_bodies(reading, joint.prim)


def _tell(reading: Reading, prim: Usd.Prim, drive: str, rows: Sequence[tuple[str, float, float, str]]) -> None:
    for attribute, low, high, why in rows:
        name = attribute.format(drive=drive)
        if any(not low <= value <= high for value in _authored(prim, name, reading.start)):
            reading.note(f"{prim.GetPath()}: {name} is not used: {why}")


def _tell_of_switched_off_bodies(reading: Reading, joint: Usd.Prim) -> None:
    for side in (0, 1):
        for named in joint.GetRelationship(f"physics:body{side}").GetForwardedTargets():
            if body := switched_off_body(reading.stage.GetPrimAtPath(named)):
                reading.note(
                    f"{joint.GetPath()}: holds to the world in place of {body.GetPath()}, which has no mass and does "
                    "not move: its physics:rigidBodyEnabled is false"
                )


def _tell_of_schemas(reading: Reading, prim: Usd.Prim) -> None:
    for begin, why in OF_SCHEMAS:
        applied = map(str, prim.GetPrimTypeInfo().GetAppliedAPISchemas())  # those that this USD does not know too
        found = next((name for name in applied if name.startswith(begin)), None)
        if found is not None:
            reading.note(f"{prim.GetPath()}: {found} is not used: {why}")


def _authored(prim: Usd.Prim, name: str, time: float) -> tuple[float, ...]:
    """The numbers that an attribute has, none where it is not authored."""
    attribute = prim.GetAttribute(name)
    value = attribute.Get(time) if attribute and attribute.HasAuthoredValue() else None
    if value is None:
        return ()
    return tuple(float(part) for part in (value if hasattr(value, "__len__") else (value,)))
