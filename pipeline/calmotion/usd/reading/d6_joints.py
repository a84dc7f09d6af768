"""Generic (D6) joints of UsdPhysics that are in fact fixed, revolute, prismatic or spherical.

A `PhysicsJoint` moves along and about all axes of its frames, except where a PhysicsLimitAPI locks it: its lower limit
exceeds the upper one, or both are nothing that can be seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pxr import Usd

TYPE = "PhysicsJoint"
NO_ROTATION, NO_TRANSLATION = 1e-2, 1e-5  # play of a locked direction [deg], [stage length]
_TRANSLATIONS, _ROTATIONS = ("transX", "transY", "transZ"), ("rotX", "rotY", "rotZ")


@dataclass(frozen=True)
class SimpleJoint:
    """A joint by what it leaves free.

    Attributes:
        kind: `revolute`, `prismatic`, `spherical` or `fixed`; empty where it leaves anything else free.
        freedom: The free direction of a revolute or prismatic joint (`rotX`, `transZ`, ...), which names its drive.
        free: All free directions.
    """

    kind: str
    freedom: str
    free: tuple[str, ...]

    @property
    def axis(self) -> str:
        """`X`, `Y` or `Z`."""
        return self.freedom[-1:]

    @property
    def limits(self) -> tuple[str, str]:
        """Names of the attributes with the lower and upper limit."""
        return f"limit:{self.freedom}:physics:low", f"limit:{self.freedom}:physics:high"


def simple_joint(prim: Usd.Prim) -> SimpleJoint:
    """The joint that a generic one is equal to."""
    free = tuple(name for name in (*_TRANSLATIONS, *_ROTATIONS) if not _is_locked(prim, name))
    if not free:
        return SimpleJoint("fixed", "", free)
    if len(free) == 1:
        return SimpleJoint("revolute" if free[0] in _ROTATIONS else "prismatic", free[0], free)
    return SimpleJoint("spherical" if free == _ROTATIONS else "", "", free)


def _is_locked(prim: Usd.Prim, name: str) -> bool:
    least = NO_ROTATION if name in _ROTATIONS else NO_TRANSLATION
    low, high = (_number(prim, f"limit:{name}:physics:{end}") for end in ("low", "high"))
    if low is None or high is None:
        return False
    return low > high or max(abs(low), abs(high)) <= least


def _number(prim: Usd.Prim, name: str) -> float | None:
    attribute = prim.GetAttribute(name)
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    return None if value is None or math.isnan(value) else float(value)
