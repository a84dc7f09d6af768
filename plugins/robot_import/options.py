"""What becomes of a converted robot, and the prims of its links that are meant."""

import fnmatch
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from calmotion.catalogs import Material
from calmotion.model import MotorTracks
from calmotion.usd import is_applied, is_rigid_body
from pxr import Usd, UsdGeom

from .description.descriptions import MJCF, Description
from .robot_motors import named


@dataclass(frozen=True)
class FlexibleLinks:
    """Links that bend.

    Attributes:
        pattern: Of their names, with `*` and `?`.
        name: Of the material.
        material: The material.
        thickness: Of their walls [m]; None for solid links.
    """

    pattern: str
    name: str
    material: Material
    thickness: float | None = None


@dataclass(frozen=True, eq=False)
class RobotOptions:
    """What becomes of a converted robot.

    Attributes:
        robot: What its file says.
        flexible: Which links bend.
        targets: Patterns of names of links or frames that are targets.
        solid: Material from which links without inertia get their mass, or None.
        motion: Of its joints, or None.
        frames_per_second: Of the shot; None where no motion is given: that of the robot.
        motors: Patterns of names of joints that motors drive; none: see `robot_motors`.
        compiled: Masses, joints and actuators of an MJCF as MuJoCo compiles them; None where the robot is none.
    """

    robot: Description
    flexible: tuple[FlexibleLinks, ...] = ()
    targets: tuple[str, ...] = ()
    solid: Material | None = None
    motion: MotorTracks | None = None
    frames_per_second: float | None = 60.0
    motors: tuple[str, ...] = ()
    compiled: Mapping[str, Any] | None = None

    @property
    def mjcf(self) -> bool:
        """Whether it was MJCF, for which the converter authors the mass of every link that has one."""
        return self.robot.kind == MJCF

    def is_flexible(self, body: Usd.Prim) -> bool:
        """Whether a pattern of flexible links names a link with geometry, whose material may then give its mass."""
        shaped = any(
            (prim.IsA(UsdGeom.Gprim) and not is_applied(prim, "MjcSiteAPI")) or prim.IsInstance()
            for prim in carried_by(body)
        )
        return shaped and any(is_named(body, given.pattern) for given in self.flexible)


def is_named(prim: Usd.Prim, pattern: str) -> bool:
    """Whether a pattern fits the name of a prim in its file, or in USD."""
    return any(fnmatch.fnmatchcase(name.lower(), pattern.lower()) for name in (named(prim), str(prim.GetName())))


def geoms_of(body: Usd.Prim) -> Iterable[Usd.Prim]:
    """The colliders of a link of an MJCF."""
    return (prim for prim in carried_by(body) if is_applied(prim, "MjcCollisionAPI"))


def carried_by(body: Usd.Prim) -> Iterable[Usd.Prim]:
    """A body and what it carries, without the bodies below it."""
    yield body
    for child in body.GetChildren():
        if not is_rigid_body(child):
            yield from carried_by(child)
