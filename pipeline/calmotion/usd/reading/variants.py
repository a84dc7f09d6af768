"""Why a shot has no bodies, and which variant has physics: robots come with and without it, or for several engines."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

from pxr import Sdf, Usd

from calmotion.errors import ShotError, each, raise_all
from calmotion.usd.diagnostics import quiet
from calmotion.usd.reading.animated import moving_prims
from calmotion.usd.reading.context import RIGID_BODY, prims_of
from calmotion.usd.schemas import is_applied

_PROBLEM = "no bodies: the shot has no prim with PhysicsRigidBodyAPI"


def no_bodies(stage: Usd.Stage) -> ShotError:
    """The error of a stage in whose prims no body was found."""
    file = str(stage.GetRootLayer().identifier)
    skeletons = [prim for prim in prims_of(stage) if prim.GetTypeName() == "Skeleton"]
    if skeletons:
        return ShotError(
            _PROBLEM,
            path=str(skeletons[0].GetPath()),
            found="a skinned character without physics",
            remedy="Run `calmotion rig` on it, and open the layer that it writes",
        )
    every = list(stage.TraverseAll())
    skipped = [prim for prim in every if is_applied(prim, RIGID_BODY)]
    inactive = [prim for prim in every if not prim.IsActive()]
    overrides = [prim for prim in stage.GetPseudoRoot().GetAllChildren() if prim.IsActive() and not prim.IsDefined()]
    for prim in (*skipped, *inactive, *overrides):
        found = _reason(prim)
        if found:
            return ShotError(_PROBLEM, path=str(prim.GetPath()), attribute=found[0], found=found[1], remedy=found[2])
    moving = moving_prims(stage)
    if moving:
        return ShotError(
            _PROBLEM,
            path=str(moving[0].GetPath()),
            found=f"animated transforms without physics ({len(moving)} of them)",
            remedy=f"Run `calmotion rig {os.path.basename(file)} -o LAYER`, and open the layer that it writes",
        )
    remedy = "Apply PhysicsRigidBodyAPI to the moving parts of the character"
    return ShotError(_PROBLEM, path=file, remedy=remedy)


def _reason(prim: Usd.Prim) -> tuple[str, str, str] | None:
    """Attribute, what was found and the remedy for a prim that is left out with all below it; None for any other."""
    if not prim.IsActive():
        return "", "it is deactivated, with all below it", "Activate it (active = true)"
    if prim.IsAbstract():
        return "", "it is a class, which has no place in the scene", "Inherit from it or reference it in a prim (def)"
    if not prim.IsDefined():
        return (
            "",
            "an override (over) of a prim that no layer defines",
            "Open the file that has this layer above that of the robot in its subLayers, or write such a file",
        )
    if is_applied(prim, RIGID_BODY):
        return "physics:rigidBodyEnabled", "False", "Set it to true, or remove it"
    return None


_MOST_TRIED = 16  # variants that are composed, one after the other
_DRIVE = "PhysicsDriveAPI"


def physics_elsewhere(stage: Usd.Stage) -> str:
    """Which variant to select for more bodies, joints or drives than the stage has, as an imperative; empty where no
    other variant has more."""
    others = _others(stage)
    if not others:
        return ""
    choices, here, found = Sdf.Layer.CreateAnonymous(), _physics(stage), {}
    with quiet():
        probe = Usd.Stage.Open(stage.GetRootLayer(), choices, Usd.Stage.LoadAll)
        probe.SetEditTarget(choices)
        for path, name, variant in others[:_MOST_TRIED]:
            choices.Clear()
            probe.GetPrimAtPath(path).GetVariantSet(name).SetVariantSelection(variant)
            found[path, name, variant] = _physics(probe) - here
    path, name, variant = max(found, key=found.__getitem__)
    more = found[path, name, variant]
    if more <= 0:
        return ""
    return (
        f'Author variants = {{ string {name} = "{variant}" }} on {path}: it has {more} more bodies, joints and drives'
    )


@contextmanager
def naming_variants(stage: Usd.Stage) -> Iterator[None]:
    """Add to the remedies of errors which variant to select, where another one has more physics.

    Raises:
        ShotError: Those of the block.
    """
    try:
        yield
    except ShotError as error:
        chosen = physics_elsewhere(stage)
        if not chosen:
            raise
        raise_all(
            [
                ShotError(
                    one.problem,
                    path=one.path,
                    attribute=one.attribute,
                    found=one.found,
                    remedy=f"{chosen}; or {one.remedy[:1].lower()}{one.remedy[1:]}",
                )
                for one in each(error)
            ]
        )


def _others(stage: Usd.Stage) -> list[tuple[Sdf.Path, str, str]]:
    """Prim, set and name of the variants that are not selected, and may bring physics."""
    found = []
    for prim in prims_of(stage):
        if not prim.HasVariantSets() or prim.IsInstanceProxy():
            continue
        sets = prim.GetVariantSets()
        for name in sets.GetNames():
            chosen = sets.GetVariantSelection(name)
            brings = _bringing(prim, name)
            found += [(prim.GetPath(), name, other) for other in brings if other != chosen]
    return found


def _bringing(prim: Usd.Prim, name: str) -> list[str]:
    """The variants of a set that have physics, or refer to other files or prims."""
    found: dict[str, None] = {}
    for spec in prim.GetPrimStack():
        variants = spec.variantSets.get(name)
        for variant in variants.variants.values() if variants else ():
            if _may_have_physics(variant.primSpec):
                found[variant.name] = None
    return list(found)


def _may_have_physics(spec: Sdf.PrimSpec) -> bool:
    schemas = spec.GetInfo("apiSchemas").GetAddedOrExplicitItems() if spec.HasInfo("apiSchemas") else ()
    return (
        spec.hasReferences
        or spec.hasPayloads
        or spec.typeName.startswith("Physics")
        or any(str(name).startswith("Physics") for name in schemas)
        or any(_may_have_physics(child) for child in spec.nameChildren)
    )


def _physics(stage: Usd.Stage) -> int:
    """How many bodies, joints and drives a stage has."""
    count = 0
    for prim in prims_of(stage):
        applied = prim.GetAppliedSchemas()
        count += RIGID_BODY in applied
        count += prim.GetTypeName().startswith("Physics") and prim.GetTypeName().endswith("Joint")
        count += any(name.startswith(_DRIVE) for name in applied)
    return count
