"""Attributes that the simulation takes for constant, though the shot animates them: masses, limits, materials.

Programs often author a single time sample in place of a default; then that is the value. Where the samples differ, one
value is used, and a note says which.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from calmotion.usd.reading.animated.animation_codes import animation_codes
from calmotion.usd.reading.context import prims_of

if TYPE_CHECKING:
    from pxr import Usd

_PREFIXES = ("physics:", "calm:", "drive:", "limit:")
_ANIMATED = (
    "physics:targetPosition", "physics:targetVelocity", "calm:contact:active", "calm:motor:optimize",
    "calm:target:positionWeight", "calm:target:rotationWeight",
)  # fmt: skip


def hold_constants(stage: Usd.Stage) -> list[str]:
    """Give attributes that have time samples or a spline, and no default, their first value as default, in the session
    layer.

    Returns:
        A note for each attribute whose samples differ.
    """
    from pxr import Usd

    notes = []
    for prim in prims_of(stage):
        if not (prim.GetAppliedSchemas() or str(prim.GetTypeName()).startswith(("Physics", "Material"))):
            continue
        for name in prim.GetAuthoredPropertyNames(lambda name: name.startswith(_PREFIXES)):
            attribute = prim.GetAttribute(name)
            codes = animation_codes(attribute) if attribute and not name.endswith(_ANIMATED) else []
            if not codes:
                continue
            values = [attribute.Get(code) for code in codes]
            default = attribute.GetResolveInfo(Usd.TimeCode.Default()).GetSource() == Usd.ResolveInfoSourceDefault
            if not default and values[0] is not None and not prim.IsInstanceProxy():
                with Usd.EditContext(stage, stage.GetSessionLayer()):
                    attribute.Set(values[0])
            used = attribute.Get()
            if any(not _same(value, used) for value in values):
                notes.append(
                    f"{attribute.GetPath()}: it is animated, but does not change in a simulation: {used} is used"
                )
    return notes


def _same(one: Any, other: Any) -> bool:
    return bool(np.array_equal(np.asarray(one), np.asarray(other)))
