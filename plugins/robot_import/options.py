"""What becomes of a converted robot, and the prims of its links that are meant."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from calmotion.catalogs import Material
from calmotion.model import MotorTracks
from calmotion.usd import is_applied, is_rigid_body

from .robot_motors import named

if TYPE_CHECKING:
    from pxr import Usd


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
        flexible: Which links bend.
        targets: Patterns of names of links or frames that are targets.
        efforts: Largest effort by name of a joint [N m or N].
        without_mass: Names of links with geometry and without inertia.
        massless: Names of links whose mass is 0.
        solid: Material from which links without inertia get their mass, or None.
        motion: Of its joints, or None.
        frames_per_second: Of the shot; None where no motion is given: that of the robot.
        motors: Patterns of names of joints that motors drive; none: see `robot_motors`.
        mjcf: Whether the robot is MJCF, for which the converter authors the mass of every link that has one.
        locks: Joints that an equality holds at one value [rad or m].
        soft_limits: Narrower limits of joints [rad or m].
        compiled: Masses, joints and actuators of an MJCF as MuJoCo compiles them; None where the robot is none.
    """

    flexible: tuple[FlexibleLinks, ...] = ()
    targets: tuple[str, ...] = ()
    efforts: Mapping[str, float] = field(default_factory=dict)
    without_mass: tuple[str, ...] = ()
    massless: tuple[str, ...] = ()
    solid: Material | None = None
    motion: MotorTracks | None = None
    frames_per_second: float | None = 60.0
    motors: tuple[str, ...] = ()
    mjcf: bool = False
    locks: Mapping[str, float] = field(default_factory=dict)
    soft_limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    compiled: Mapping[str, Any] | None = None

    def is_flexible(self, body: Usd.Prim) -> bool:
        """Whether a pattern of flexible links names a link, whose material then gives its mass."""
        return any(is_named(body, given.pattern) for given in self.flexible)


def is_named(prim: Usd.Prim, pattern: str) -> bool:
    return fnmatch.fnmatchcase(named(prim).lower(), pattern.lower())


def geoms_of(body: Usd.Prim) -> Iterable[Usd.Prim]:
    """The colliders of a link of an MJCF."""
    return (prim for prim in carried_by(body) if is_applied(prim, "MjcCollisionAPI"))


def carried_by(body: Usd.Prim) -> Iterable[Usd.Prim]:
    """A body and what it carries, without the bodies below it."""
    yield body
    for child in body.GetChildren():
        if not is_rigid_body(child):
            yield from carried_by(child)
