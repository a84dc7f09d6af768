"""What a generic (D6) joint of UsdPhysics leaves free.

A `PhysicsJoint` moves along and about all axes of its frames, except where a PhysicsLimitAPI locks it: its lower limit
exceeds the upper one, or both are nothing that can be seen.
"""

import math
from dataclasses import dataclass

from pxr import Usd

from calmotion.usd import schemas

GENERIC_JOINT = "PhysicsJoint"
NO_ROTATION, NO_TRANSLATION = 1e-2, 1e-5  # play of a locked direction [deg], [stage length]
TRANSLATIONS, ROTATIONS = ("transX", "transY", "transZ"), ("rotX", "rotY", "rotZ")
LIMITS = "limit:{drive}:physics:low", "limit:{drive}:physics:high"  # attributes of a direction
SEVERAL_FREEDOMS = "several"  # kind of a joint that is made of hinges and sliders


@dataclass(frozen=True)
class Freedoms:
    """A joint by what it leaves free.

    Attributes:
        kind: `revolute`, `prismatic`, `spherical`, `fixed` or `SEVERAL_FREEDOMS`; empty where it leaves everything free
            and nothing drives it, so that it joins nothing.
        free: The free directions, translations before rotations.
    """

    kind: str
    free: tuple[str, ...]

    @property
    def freedom(self) -> str:
        """The free direction of a revolute or prismatic joint (`rotX`, `transZ`, ...), which names its drive."""
        return self.free[0] if self.kind in ("revolute", "prismatic") else ""

    @property
    def axis(self) -> str:
        """`X`, `Y` or `Z`."""
        return self.freedom[-1:]


def limits_of(direction: str) -> tuple[str, str]:
    """Names of the attributes with the lower and upper limit of a direction."""
    low, high = (limit.format(drive=direction) for limit in LIMITS)
    return low, high


def freedoms(prim: Usd.Prim) -> Freedoms:
    """What a generic joint leaves free, and the joint that it is equal to."""
    free = tuple(name for name in (*TRANSLATIONS, *ROTATIONS) if not _is_locked(prim, name))
    if len(free) < 2:
        kind = "fixed" if not free else "revolute" if free[0] in ROTATIONS else "prismatic"
        return Freedoms(kind, free)
    if not any(_is_driven(prim, name) for name in free):
        if len(free) == 6:
            return Freedoms("", free)
        if free == ROTATIONS:
            return Freedoms("spherical", free)
    return Freedoms(SEVERAL_FREEDOMS, free)


def _is_driven(prim: Usd.Prim, name: str) -> bool:
    """Whether a motor may move a direction; a drive that is applied without any attribute is none."""
    if schemas.is_applied(prim, "CalmMotorAPI"):
        return True
    given = (prim.GetAttribute(f"drive:{name}:physics:{what}") for what in ("targetPosition", "stiffness"))
    return schemas.is_applied(prim, f"PhysicsDriveAPI:{name}") and any(
        attribute and (attribute.HasAuthoredValue() or attribute.GetNumTimeSamples()) for attribute in given
    )


def _is_locked(prim: Usd.Prim, name: str) -> bool:
    least = NO_ROTATION if name in ROTATIONS else NO_TRANSLATION
    low, high = (_known(prim.GetAttribute(limit)) for limit in limits_of(name))
    if low is None or high is None:
        return False
    return low > high or max(abs(low), abs(high)) <= least


def _known(attribute: Usd.Attribute) -> float | None:
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    return None if value is None or math.isnan(value) else float(value)
