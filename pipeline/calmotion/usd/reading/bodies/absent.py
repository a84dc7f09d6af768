"""Why a shot has no bodies, and what to do about it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calmotion.errors import ShotError
from calmotion.usd.reading.context import RIGID_BODY, prims_of
from calmotion.usd.schemas import is_applied

if TYPE_CHECKING:
    from pxr import Usd

_PROBLEM = "no bodies: the shot has no prim with PhysicsRigidBodyAPI"


def no_bodies(stage: Usd.Stage) -> ShotError:
    """The error of a stage in whose prims no body was found."""
    file = str(stage.GetRootLayer().identifier)
    skeletons = [prim for prim in prims_of(stage) if prim.GetTypeName() == "Skeleton"]
    if skeletons:
        return ShotError(
            _PROBLEM, path=str(skeletons[0].GetPath()), found="a skinned character without physics",
            remedy="Run `calmotion rig` on it, and open the layer that it writes",
        )  # fmt: skip
    every = list(stage.TraverseAll())
    skipped = [prim for prim in every if is_applied(prim, RIGID_BODY)]
    inactive = [prim for prim in every if not prim.IsActive()]
    overrides = [prim for prim in stage.GetPseudoRoot().GetAllChildren() if prim.IsActive() and not prim.IsDefined()]
    for prim in (*skipped, *inactive, *overrides):
        found = _reason(prim)
        if found:
            return ShotError(_PROBLEM, path=str(prim.GetPath()), attribute=found[0], found=found[1], remedy=found[2])
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
            "", "an override (over) of a prim that no layer defines",
            "Open the file that has this layer above that of the robot in its subLayers, or write such a file",
        )  # fmt: skip
    if is_applied(prim, RIGID_BODY):
        return "physics:rigidBodyEnabled", "False", "Set it to true, or remove it"
    return None
