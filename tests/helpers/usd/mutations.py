"""Random edits of a shot's layer; the same random numbers make the same edit."""

import math
import random

from pxr import Gf, Sdf, Vt

NUMBERS = (0.0, -0.0, 1.0, -1.0, 1e-30, 1e30, 3.4e38, -1e9, 0.5, 2.0, 90.0, 1e-6, math.nan, math.inf, -math.inf)
TOKENS = (
    "", "X", "Y", "Z", "W", "none", "rigid", "static", "auto", "linear", "x/y", "é", "kinematic", "!resetXformStack!",
    "xformOp:translate", "xformOp:transform", "leftHanded", "guide", "invisible", "rest", "start",
)  # fmt: skip
SCHEMAS = (
    "PhysicsRigidBodyAPI", "PhysicsMassAPI", "PhysicsCollisionAPI", "PhysicsDriveAPI:angular", "PhysicsDriveAPI:linear",
    "CalmFlexibleBodyAPI", "CalmDampingAPI", "CalmMotorAPI", "CalmTargetAPI", "CalmRetargetAPI", "SkelBindingAPI",
    "PhysicsVolumeDeformableMaterialAPI", "PhysicsArticulationRootAPI", "NoSuchAPI", "NewtonMimicAPI",
)  # fmt: skip
TYPES = (
    "", "Xform", "Mesh", "Cube", "Sphere", "Scope", "TetMesh", "Material", "Skeleton", "SkelRoot", "SkelAnimation",
    "PhysicsRevoluteJoint", "PhysicsPrismaticJoint", "PhysicsFixedJoint", "PhysicsSphericalJoint", "PhysicsJoint",
    "PhysicsScene", "MjcActuator", "GeomSubset", "PointInstancer", "Camera", "NoSuchType",
)  # fmt: skip
NAMES = (
    "physics:mass", "physics:density", "physics:axis", "physics:body0", "physics:body1", "physics:localPos0",
    "physics:localRot0", "physics:lowerLimit", "physics:jointEnabled", "physics:kinematicEnabled",
    "physics:rigidBodyEnabled", "physics:excludeFromArticulation", "drive:angular:physics:targetPosition",
    "drive:linear:physics:targetPosition", "drive:angular:physics:maxForce", "drive:angular:physics:stiffness",
    "calm:motor:optimize", "calm:motor:skelJoint", "calm:motor:skelPose", "calm:motor:maxVelocity",
    "calm:target:positionWeight", "calm:flexible:enabled", "calm:flexible:meshFile", "calm:flexible:elasticity",
    "calm:flexible:elementSize", "calm:flexible:interfaceRadius", "calm:flexible:modeCount", "calm:damping:ratio",
    "calm:damping:rayleighMass", "calm:retarget:tolerance", "calm:retarget:cyclic", "calm:retarget:reference", "points",
    "faceVertexCounts", "faceVertexIndices", "orientation", "xformOp:translate", "xformOpOrder", "visibility",
    "purpose", "newton:mimicJoint", "newton:mimicCoef1", "mjc:target", "mjc:coef0", "joints", "restTransforms",
    "bindTransforms", "rotations", "translations", "scales", "size", "radius", "tetVertexIndices", "holeIndices",
    "skel:animationSource", "primvars:displayColor",
)  # fmt: skip
KINDS = (
    "Float", "Double", "Int", "Bool", "Token", "String", "Asset", "Float3", "Point3f", "Quatf", "Matrix4d", "Double3",
    "TokenArray", "IntArray", "Point3fArray", "QuatfArray", "Matrix4dArray", "FloatArray", "Int4Array", "Half3Array",
)  # fmt: skip


def value_of(kind: str, rng: random.Random) -> object:
    """A value of a type, often one that nobody means."""
    number = lambda: rng.choice(NUMBERS)  # noqa: E731
    whole = lambda: rng.choice((0, 1, -1, 3, 7, 99, 2**31 - 1, -(2**31)))  # noqa: E731
    count = rng.choice((0, 1, 2, 3, 8, 24))
    makers = {
        "Float": number, "Double": number, "Int": whole, "Bool": lambda: rng.random() < 0.5,
        "Token": lambda: rng.choice(TOKENS), "String": lambda: rng.choice(TOKENS),
        "Asset": lambda: Sdf.AssetPath(rng.choice(("", "./gone.msh", "../../../etc/passwd", "/dev/null", "."))),
        "Float3": lambda: Gf.Vec3f(number(), number(), number()), "Point3f": lambda: Gf.Vec3f(number(), 0, number()),
        "Double3": lambda: Gf.Vec3d(number(), number(), number()), "Quatf": lambda: Gf.Quatf(number(), 0, number(), 0),
        "Matrix4d": lambda: Gf.Matrix4d(*(number() for _ in range(16))),
        "TokenArray": lambda: Vt.TokenArray([rng.choice(TOKENS) for _ in range(count)]),
        "IntArray": lambda: Vt.IntArray([whole() for _ in range(count)]),
        "FloatArray": lambda: Vt.FloatArray([number() for _ in range(count)]),
        "Point3fArray": lambda: Vt.Vec3fArray([Gf.Vec3f(number(), number(), number()) for _ in range(count)]),
        "Half3Array": lambda: Vt.Vec3hArray([Gf.Vec3h(1, 0, 1) for _ in range(count)]),
        "QuatfArray": lambda: Vt.QuatfArray([Gf.Quatf(number(), 0, 0, number()) for _ in range(count)]),
        "Matrix4dArray": lambda: Vt.Matrix4dArray([Gf.Matrix4d(number()) for _ in range(count)]),
        "Int4Array": lambda: Vt.Vec4iArray([Gf.Vec4i(whole(), whole(), whole(), whole()) for _ in range(count)]),
    }  # fmt: skip
    return makers[kind]()


def prims_of(layer: Sdf.Layer) -> list[Sdf.PrimSpec]:
    found: list[Sdf.PrimSpec] = []
    layer.Traverse("/", lambda path: found.append(layer.GetPrimAtPath(path)) if path.IsPrimPath() else None)
    return [prim for prim in found if prim]


def change_value(layer: Sdf.Layer, rng: random.Random) -> None:
    """Another value, or another time sample, for an attribute that is there, of its own type."""
    attributes = [a for prim in prims_of(layer) for a in prim.attributes]
    if not attributes:
        return
    attribute = rng.choice(attributes)
    kind = next((k for k in KINDS if getattr(Sdf.ValueTypeNames, k) == attribute.typeName), None)
    if kind is None:
        return
    if rng.random() < 0.5:
        attribute.default = value_of(kind, rng)
    else:
        code = rng.choice((0.0, 1.0, 3.0, 3.0 + 1e-9, 12.5, 24.0, -1e6, 1e9, 1e-300))
        layer.SetTimeSample(attribute.path, code, rng.choice((value_of(kind, rng), Sdf.ValueBlock())))


def author_attribute(layer: Sdf.Layer, rng: random.Random) -> None:
    """An attribute of a known name and any type on any prim."""
    prim, name, kind = rng.choice(prims_of(layer)), rng.choice(NAMES), rng.choice(KINDS)
    if name in prim.properties:
        del prim.properties[name]
    spec = Sdf.AttributeSpec(prim, name, getattr(Sdf.ValueTypeNames, kind))
    if rng.random() < 0.8:
        spec.default = value_of(kind, rng)


def author_relationship(layer: Sdf.Layer, rng: random.Random) -> None:
    """A relationship of a known name to anything."""
    prims = prims_of(layer)
    prim, name = rng.choice(prims), rng.choice(NAMES)
    if name in prim.properties:
        del prim.properties[name]
    spec = Sdf.RelationshipSpec(prim, name)
    for _ in range(rng.choice((0, 1, 1, 2))):
        path = rng.choice([str(p.path) for p in prims] + ["/gone", f"{rng.choice(prims).path}.physics:mass"])
        if path not in [str(p) for p in spec.targetPathList.explicitItems]:
            spec.targetPathList.explicitItems.append(path)


def remove(layer: Sdf.Layer, rng: random.Random) -> None:
    """A prim or a property that goes."""
    prim = rng.choice(prims_of(layer))
    properties = list(prim.properties)
    if properties and rng.random() < 0.8:
        prim.RemoveProperty(rng.choice(properties))
    elif not prim.path.IsRootPrimPath():
        del prim.nameParent.nameChildren[prim.name]


def change_prim(layer: Sdf.Layer, rng: random.Random) -> None:
    """Another type, schemas, activity, instancing or reference for a prim."""
    prims = prims_of(layer)
    prim, what = rng.choice(prims), rng.randrange(6)
    if what == 0:
        prim.typeName = rng.choice(TYPES)
    elif what == 1:
        schemas = Sdf.TokenListOp()
        schemas.prependedItems = sorted(rng.sample(SCHEMAS, rng.randrange(4)))
        prim.SetInfo("apiSchemas", schemas)
    elif what == 2:
        prim.active = False
    elif what == 3:
        prim.instanceable = True
    elif what == 4:
        prim.referenceList.Prepend(Sdf.Reference("", rng.choice(prims).path))
    else:
        prim.specifier = rng.choice((Sdf.SpecifierOver, Sdf.SpecifierClass, Sdf.SpecifierDef))


def change_stage(layer: Sdf.Layer, rng: random.Random) -> None:
    """Other units, axes or rates."""
    name = rng.choice(("metersPerUnit", "kilogramsPerUnit", "timeCodesPerSecond", "framesPerSecond", "startTimeCode",
                       "endTimeCode", "upAxis", "defaultPrim"))  # fmt: skip
    if name == "upAxis":
        layer.pseudoRoot.SetInfo(name, rng.choice(("X", "Y", "Z", "W", "")))
    elif name == "defaultPrim":
        layer.pseudoRoot.SetInfo(name, rng.choice(("Arm", "gone", "")))
    else:
        layer.pseudoRoot.SetInfo(name, rng.choice((*NUMBERS, 24.0, 1000.0)))


MUTATIONS = (
    change_value,
    change_value,
    author_attribute,
    author_attribute,
    author_relationship,
    remove,
    change_prim,
    change_stage,
)
