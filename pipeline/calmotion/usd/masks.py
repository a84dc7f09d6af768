"""Large stages: a set of many prims around a character is composed once, and then left out by a population mask.

Reading looks at all prims several times. In a large stage it looks at those with physics, at those below them, and at
what they refer to: one pass finds them.
"""

import re
from collections.abc import Iterable
from functools import cache, lru_cache

from pxr import Sdf, Usd

LARGE = 20_000  # prims
_SCHEMAS = (
    "PhysicsRigidBodyAPI", "PhysicsArticulationRootAPI", "PhysicsMassAPI", "PhysicsDriveAPI", "PhysicsLimitAPI",
    "PhysicsVolumeDeformableMaterialAPI", "PhysicsMaterialAPI", "Calm", "Mjc", "Newton", "Physx", "SkelBindingAPI",
)  # fmt: skip
_TYPES = ("SkelRoot", "Skeleton", "SkelAnimation", "PhysicsScene", "Mjc", "Newton")
# what a set consists of: without a schema it is no body, and what is said of bodies lies on these or above it
_GEOMETRY = frozenset((
    "Mesh", "Cube", "Sphere", "Cylinder", "Capsule", "Cone", "Cylinder_1", "Capsule_1", "Plane", "BasisCurves",
    "NurbsCurves", "NurbsPatch", "Points", "GeomSubset", "Shader",
))  # fmt: skip
_ATTRIBUTE = re.compile(  # one search in all names of a prim: most of the time goes into this
    "^(?:calm:|drive:|mjc:|newton:|physx|physics:mass|physics:density|physics:rigidBody)", re.MULTILINE
)


def masked(stage: Usd.Stage, muted: Iterable[str] = ()) -> Usd.Stage:
    """The part of a stage that a reader of characters looks at; the stage itself where it is not large.

    Args:
        muted: Identifiers of layers that it mutes.
    """
    anchors = _anchors(stage)
    if anchors is None:
        return stage
    mask = Usd.StagePopulationMask(anchors)
    found = Usd.Stage.OpenMasked(stage.GetRootLayer(), mask, Usd.Stage.LoadAll)
    found.MuteAndUnmuteLayers(list(muted), [])
    # materials, bodies of joints, skeletons: what the prims in the mask refer to
    found.ExpandPopulationMask(Usd.PrimDefaultPredicate, lambda relationship: True, lambda attribute: False)
    return found


def _anchors(stage: Usd.Stage) -> list[Sdf.Path] | None:
    """Paths of the prims that have to do with physics, none below another; None where the stage is not large."""
    count, found = 0, []
    walk = iter(stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimIsActive)))
    for prim in walk:
        count += 1
        if _is_anchor(prim):
            found.append(_outermost(prim).GetPath())
            for _ in Usd.PrimRange(prim, Usd.TraverseInstanceProxies(Usd.PrimIsActive)):
                count += 1
            walk.PruneChildren()
    return found if found and count > LARGE else None


def _outermost(prim: Usd.Prim) -> Usd.Prim:
    """The prim itself, or the outermost instance that it belongs to: masks name no prims inside instances."""
    while prim.IsInstanceProxy():
        prim = prim.GetParent()
    return prim


def _is_anchor(prim: Usd.Prim) -> bool:
    info = prim.GetPrimTypeInfo()
    schemas, kind = info.GetAppliedAPISchemas(), info.GetTypeName()
    if _is_type(kind) or (schemas and any(schema.startswith(_SCHEMAS) for schema in schemas)):
        return True
    if not schemas and kind in _GEOMETRY:
        return False
    return _has_physics("\n".join(prim.GetAuthoredPropertyNames()))


@lru_cache(4096)  # most prims of a set have the same names
def _has_physics(names: str) -> bool:
    return _ATTRIBUTE.search(names) is not None


@cache
def _is_type(kind: str) -> bool:
    return kind.startswith(_TYPES) or (kind.startswith("Physics") and kind.endswith("Joint"))
