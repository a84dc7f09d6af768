"""Ends of joints that name something, and would yet be taken for the world."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calmotion.errors import ShotError

if TYPE_CHECKING:
    from pxr import Sdf, Usd


def refuse_lost_target(relationship: Usd.Relationship) -> None:
    """Refuse a relationship whose target USD leaves out, since an arc does not reach it.

    Args:
        relationship: One without targets as composed.

    Raises:
        ShotError: A layer names a target.
    """
    for spec in relationship.GetPropertyStack() if relationship else []:
        edits = spec.targetPathList
        if edits.deletedItems:
            return  # meant
        authored = edits.explicitItems if edits.isExplicit else [*edits.prependedItems, *edits.appendedItems]
        if authored:
            raise ShotError(
                "names a prim that is outside of what is referenced, or of the instance; USD leaves it out",
                path=relationship.GetPrimPath(),
                attribute=relationship.GetName(),
                found=_named(authored, spec.layer),
                remedy="Reference a prim that holds both, or author the target in the layer of the shot",
            )
        if edits.isExplicit:
            return


def _named(targets: list[Sdf.Path], layer: Sdf.Layer) -> str:
    return f"{', '.join(map(str, targets))} in {layer.GetDisplayName()}"


def refuse_no_place(joint: Usd.Prim, name: str, target: Usd.Prim) -> None:
    """Refuse a prim that can be neither a body nor a place in the world: a joint, a material.

    Raises:
        ShotError: It is of a type that has no transform.
    """
    from pxr import UsdGeom

    kind = str(target.GetTypeName())
    if kind and kind != "Scope" and not target.IsA(UsdGeom.Xformable):
        raise ShotError(
            "names a prim that is no body and has no transform",
            path=joint.GetPath(),
            attribute=name,
            found=f"{target.GetPath()} ({kind})",
            remedy="Name a body (PhysicsRigidBodyAPI), or nothing for the world",
        )
