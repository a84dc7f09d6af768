"""Where the shot moves bodies by their transforms: not yet for what holds the character."""

from __future__ import annotations

import numpy as np

from ...errors import ShotError
from ..gf import matrix
from .context import Reading

_TOLERANCE = 1e-6  # relative to the size of the transform: what single precision leaves


def refuse_moving(reading: Reading, roots: list, others: list) -> None:
    """Refuse bodies that are held by the world and move in it; note where other transforms are animated.

    Args:
        reading: The stage.
        roots: Prims of the bodies with a joint to the world.
        others: Prims of the other bodies.

    Raises:
        ShotError: A root body moves; moving roots come later.
    """
    for prim in roots:
        found = _moves(reading, prim)
        if found is not None:
            mover, code = found
            raise ShotError(
                "the transform that carries the character's root is animated; moving roots are not supported yet",
                path=mover.GetPath(),
                attribute="xformOpOrder",
                found=f"it moves at time code {code:g}",
                remedy="Animate the motors of the character, and leave the root and what is above it still",
            )
    animated = [p for p in others if _codes(p)]
    if animated:
        reading.note(
            f"{animated[0].GetPath()}: transforms of bodies are animated ({len(animated)} of them); the motion is "
            "taken from the drives alone"
        )


def _codes(prim) -> list[float]:
    from pxr import UsdGeom

    return list(UsdGeom.Xformable(prim).GetTimeSamples()) if prim.IsA(UsdGeom.Xformable) else []


def _moves(reading: Reading, prim):
    """The first prim, from a body upwards, that really moves it, with the time code; None where it stays."""
    from pxr import UsdGeom

    chain, above = [], prim
    while above and not above.IsPseudoRoot():
        chain.append(above)
        if above.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(above).GetResetXformStack():
            break
        above = above.GetParent()
    start = reading.world_matrix(prim)
    for mover in chain:
        for code in _codes(mover):
            if code < reading.start:
                continue
            now = matrix(UsdGeom.XformCache(code).GetLocalToWorldTransform(prim))
            if np.max(np.abs(now - start)) > _TOLERANCE * max(1.0, float(np.max(np.abs(start)))):
                return mover, code
    return None
