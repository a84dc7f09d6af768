"""Animated transforms of bodies and of the prims above them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calmotion.errors import ShotError
from calmotion.usd.gf import matrix
from calmotion.usd.reading.animated.animation_codes import animation_codes
from calmotion.usd.reading.context import Reading, is_rigid_body

if TYPE_CHECKING:
    from pxr import Usd

_TOLERANCE = 1e-6  # relative to the size of the transform: rounding errors of single precision


def refuse_moving(reading: Reading, fixed: dict[Usd.Prim, str], others: list[Usd.Prim]) -> None:
    """Refuse animated bodies that a joint fixes to the world; note where other transforms are animated.

    Args:
        reading: The stage.
        fixed: Prims of the bodies with a joint to the world, and the path of that joint.
        others: Prims of the other bodies.

    Raises:
        ShotError: A body is animated although a joint fixes it to the world.
    """
    for prim, joint in fixed.items():
        movement = moves(reading, prim)
        if movement is not None:
            mover, code = movement
            raise ShotError(
                f"the transform that carries the character's root is animated, but {joint} holds it in the world",
                path=mover.GetPath(),
                attribute="xformOpOrder",
                found=f"it moves at time code {code:g}",
                remedy="For a moving root, set physics:kinematicEnabled on its body and remove that joint; otherwise "
                "remove the animation of the root and of the prims above it",
            )
    animated = [p for p in others if codes_of(p)]
    if animated:
        reading.note(
            f"{animated[0].GetPath()}: transforms of bodies are animated ({len(animated)} of them); the motion is "
            "taken from the drives alone"
        )


def codes_of(prim: Usd.Prim) -> list[float]:
    """Time codes at which the local transform of a prim has samples, or splines their knots and points between."""
    from pxr import UsdGeom

    xform = UsdGeom.Xformable(prim)
    if not xform:
        return []
    codes = set(xform.GetTimeSamples())  # none of splines
    if xform.TransformMightBeTimeVarying():
        codes.update(code for one in xform.GetOrderedXformOps() for code in animation_codes(one.GetAttr()))
    return sorted(codes)


def has_splines(prim: Usd.Prim) -> bool:
    """Whether a spline animates the local transform of a prim."""
    from pxr import UsdGeom

    xform = UsdGeom.Xformable(prim)
    return bool(xform) and any(one.GetAttr().HasSpline() for one in xform.GetOrderedXformOps())


def carriers(prim: Usd.Prim) -> list[Usd.Prim]:
    """A prim and the prims above it, up to one that resets the transform stack."""
    from pxr import UsdGeom

    chain, above = [], prim
    while above and not above.IsPseudoRoot():
        chain.append(above)
        if above.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(above).GetResetXformStack():
            break
        above = above.GetParent()
    return chain


def moves(reading: Reading, prim: Usd.Prim) -> tuple[Usd.Prim, float] | None:
    """The first prim, from a body upwards, that moves the body, with the time code; None if there is none."""
    from pxr import UsdGeom

    start = reading.world_matrix(prim)
    for mover in carriers(prim):
        for code in codes_of(mover):
            if code < reading.start:
                continue
            now = matrix(UsdGeom.XformCache(code).GetLocalToWorldTransform(prim))
            if np.max(np.abs(now - start)) > _TOLERANCE * max(1.0, float(np.max(np.abs(start)))):
                return mover, code
    return None


def moves_on_body(prim: Usd.Prim) -> bool:
    """Whether the transform of a prim, or of one between it and its body, is animated."""
    from pxr import UsdGeom

    while prim and not is_rigid_body(prim):
        if prim.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(prim).TransformMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False
