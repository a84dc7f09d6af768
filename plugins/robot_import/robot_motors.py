"""Which joints of an imported robot get motors, and their drives."""

import fnmatch
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from calmotion.errors import ShotError
from calmotion.model import MotorTracks, Track
from calmotion.support import nearest
from calmotion.usd import (
    COUPLED,
    GEARS,
    GENERIC_JOINT,
    SEVERAL_FREEDOMS,
    TRANSLATIONS,
    JointNames,
    StageUnits,
    actuated_joints,
    body_on,
    coupled,
    coupling_prims,
    freedoms,
    is_applied,
    joint_prims,
    limits_of,
    tracks_of_joints,
)
from pxr import Sdf, Usd, UsdPhysics

ALL = "all"
LIMITS = ("physics:lowerLimit", "physics:upperLimit")
_DRIVES = {"PhysicsRevoluteJoint": "angular", "PhysicsPrismaticJoint": "linear"}


def named(prim: Usd.Prim) -> str:
    """The name of a prim as its author wrote it, where USD allows no such name."""
    return str(prim.GetDisplayName() or prim.GetName())


@dataclass(frozen=True)
class Axis:
    """A direction in which a joint moves.

    Attributes:
        prim: The joint.
        drive: The instance of PhysicsDriveAPI that drives it: `angular`, `linear`, `rotX`, ...
        several: Whether the joint has others.
    """

    prim: Usd.Prim
    drive: str
    several: bool = False

    @property
    def path(self) -> str:
        """The path of the joint, with the direction behind it where there are several."""
        return f"{self.prim.GetPath()}{self._behind}"

    @property
    def name(self) -> str:
        """The name of the joint, in the same way."""
        return f"{named(self.prim)}{self._behind}"

    @property
    def names(self) -> tuple[str, ...]:
        """What a motion or a pattern may name it by."""
        return self.name, f"{self.prim.GetName()}{self._behind}", self.path

    @property
    def linear(self) -> bool:
        """Whether it is a length."""
        return self.drive == "linear" or self.drive in TRANSLATIONS

    @property
    def _behind(self) -> str:
        return f".{self.drive}" if self.several else ""


def axes_of(prim: Usd.Prim) -> list[Axis]:
    """The directions in which a joint moves that motors can drive."""
    if prim.GetTypeName() == GENERIC_JOINT:
        free = freedoms(prim)
        names = free.free if free.kind in (SEVERAL_FREEDOMS, "spherical", "revolute", "prismatic") else ()
        return [Axis(prim, name, len(names) > 1) for name in names]
    drive = _DRIVES.get(str(prim.GetTypeName()))
    return [] if drive is None else [Axis(prim, drive)]


def narrow_limits(stage: Usd.Stage, units: StageUnits, soft: Mapping[str, tuple[float, float]]) -> list[str]:
    """Make limits of joints narrower where safety controllers keep narrower ones.

    Args:
        stage: Where they are authored.
        units: Of the stage.
        soft: Lower and upper limit by name of the joint [rad or m].

    Returns:
        Notes for the user.
    """
    told = []
    for prim in joint_prims(stage):
        if named(prim) not in soft or prim.GetTypeName() not in _DRIVES:
            continue
        scale = 1.0 / units.length(1.0) if prim.GetTypeName() == "PhysicsPrismaticJoint" else np.degrees(1.0)
        low, high = (prim.GetAttribute(name) for name in LIMITS)
        hard = [
            end.Get() if end.HasAuthoredValue() else unlimited for end, unlimited in ((low, -np.inf), (high, np.inf))
        ]
        both = max(hard[0], scale * soft[named(prim)][0]), min(hard[1], scale * soft[named(prim)][1])
        if both[0] < both[1] and not np.allclose(both, hard, rtol=1e-6):
            low.Set(float(both[0]))
            high.Set(float(both[1]))
            told.append(named(prim))
    return [f"limits are those of the safety controller: {', '.join(told)}"] if told else []


def author_motors(
    stage: Usd.Stage, units: StageUnits, motion: MotorTracks | None, frames_per_second: float,
    efforts: Mapping[str, float], patterns: Sequence[str],
) -> tuple[str, ...]:  # fmt: skip
    """Author drives of the joints that patterns name; without patterns of those that actuators or drives move, else of
    all of them; and of those in the motion. A joint that no motion moves keeps its target position, or gets that
    nearest to 0 within its limits.

    Args:
        stage: Where they are authored.
        units: Of the stage.
        motion: Of the joints, or None.
        frames_per_second: Time codes in a second.
        efforts: Largest effort by name of a joint [N m or N].
        patterns: Of names of joints, with `*` and `?`; `all` names all of them.

    Returns:
        What a user should know of the columns of the motion.

    Raises:
        ShotError: A name that no joint has; a closed chain, all of whose joints would be motors; no joint at all that a
            motor can drive.
    """
    axes = [axis for prim in joint_prims(stage) for axis in axes_of(prim)]
    moved, notes = MotorTracks("", np.zeros(0), {}), tuple[str, ...]()
    if motion is not None:
        moved, notes = tracks_of_joints(motion, {axis.path: JointNames(axis.names, axis.linear) for axis in axes})
    chosen = _named(axes, patterns) if patterns else _by_default(stage, axes, bool(moved.values))
    driven = [axis for axis in axes if axis in chosen or axis.path in moved.values]
    if not driven:
        kinds = sorted({str(prim.GetTypeName()) for prim in joint_prims(stage)})
        swings = bool(set(kinds) - {"PhysicsFixedJoint"})
        raise ShotError(
            "the robot has no joint that a motor can drive",
            path=str(stage.GetDefaultPrim().GetPath()),
            found=", ".join(kinds) or "no joints",
            remedy="Connect its parts by revolute or prismatic joints"
            + ("; or leave it passive: animate the transform of its root, and simulate that shot" if swings else ""),
        )
    for axis in driven:
        values = moved.values.get(axis.path)
        track = None if values is None else Track(moved.times, values)
        _author(axis, track, units, frames_per_second)
    for axis in axes:  # those that follow others, too
        effort = efforts.get(named(axis.prim))
        if effort is not None:
            limit = axis.prim.CreateAttribute(f"drive:{axis.drive}:physics:maxForce", Sdf.ValueTypeNames.Float)
            limit.Set(effort / (units.force(1.0) if axis.linear else units.torque(1.0)))
    return notes


def _author(axis: Axis, track: Track | None, units: StageUnits, frames_per_second: float) -> None:
    attribute = UsdPhysics.DriveAPI.Apply(axis.prim, axis.drive).CreateTargetPositionAttr()
    if track is not None:
        scale = 1.0 / units.length(1.0) if axis.linear else np.degrees(1.0)
        for code, value in zip(track.times * frames_per_second, track.values * scale, strict=True):
            attribute.Set(float(value), float(round(code, 6)))
    elif not (attribute.HasAuthoredValue() or attribute.GetNumTimeSamples()):
        attribute.Set(_rest(axis))


def _rest(axis: Axis) -> float:
    """The value nearest to 0 within the limits of a joint."""
    names = limits_of(axis.drive)
    if axis.prim.GetTypeName() != GENERIC_JOINT:
        names = LIMITS
    low, high = (attribute.Get() if (attribute := axis.prim.GetAttribute(name)) else None for name in names)
    low, high = (-np.inf if low is None else low), (np.inf if high is None else high)
    return float(min(max(0.0, low), high)) if low <= high else 0.0


def _by_default(stage: Usd.Stage, axes: Sequence[Axis], moved: bool) -> list[Axis]:
    """Those that actuators or drives move, and those that lead others; where there are none, all that follow no other
    joint and close no chain."""
    free = free_axes(axes)
    actuated = actuated_joints(stage)
    driven = [axis for axis in free if is_driven(axis) or str(axis.prim.GetPath()) in actuated]
    if driven:
        leading = {leader for leader, _ in (*_mimic_pairs(axes), *_coupled_pairs(stage))}
        return driven + [axis for axis in free if axis not in driven and str(axis.prim.GetPath()) in leading]
    loop = _loop(stage)
    if loop is None:
        return free
    if moved:
        return []
    names = [axis.name for axis in free]
    raise ShotError(
        "the robot has a closed chain, so not all of its joints can be motors",
        path=loop,
        attribute="--motors",
        found=f"{len(names)} joints: {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}",
        remedy="Name those that are, as --motors 'hip*' --motors 'knee*', or give a motion of them",
    )


def free_axes(axes: Sequence[Axis]) -> list[Axis]:
    """Those that close no chain, and that nothing moves which is coupled to them: of joints that are coupled, the
    driven ones, or where none is, those that lead."""
    if not axes:
        return []
    stage = axes[0].prim.GetStage()
    moved = {str(axis.prim.GetPath()) for axis in axes if is_driven(axis)} | actuated_joints(stage).keys()
    pairs = [*_mimic_pairs(axes), *_coupled_pairs(stage)]
    dependent = {follower for leader, follower in pairs if leader in moved or follower not in moved}
    reached = set(moved)
    while more := {path for pair in pairs if reached.intersection(pair) for path in pair} - reached:
        reached |= more
        dependent |= more
    return [
        axis
        for axis in axes
        if str(axis.prim.GetPath()) not in dependent
        and not axis.prim.GetAttribute("physics:excludeFromArticulation").Get()
    ]


def _mimic_pairs(axes: Sequence[Axis]) -> Iterator[tuple[str, str]]:
    """Leaders and followers."""
    for prim in dict.fromkeys(axis.prim for axis in axes):
        for spelling in GEARS:
            relationship = prim.GetRelationship(spelling.leader)
            targets = relationship.GetForwardedTargets() if relationship else []
            if targets and not (spelling.enabled and prim.GetAttribute(spelling.enabled).Get() is False):
                yield str(targets[0]), str(prim.GetPath())


def _coupled_pairs(stage: Usd.Stage) -> Iterator[tuple[str, str]]:
    for prim in coupling_prims(stage):
        first, second = (coupled(prim, name) for name in COUPLED[str(prim.GetTypeName())])
        yield first, second


def is_driven(axis: Axis) -> bool:
    """Whether a drive is applied, or CalmMotorAPI to a joint that has no drive."""
    applied = [name for name in axis.prim.GetAppliedSchemas() if name.startswith("PhysicsDriveAPI:")]
    if applied:
        return f"PhysicsDriveAPI:{axis.drive}" in applied
    return is_applied(axis.prim, "CalmMotorAPI")


def _loop(stage: Usd.Stage) -> str | None:
    """Path of a joint that closes a chain of bodies, though nothing excludes it from the articulation."""
    leader: dict[str, str] = {}

    def group(path: str) -> str:
        while leader.get(path, path) != path:
            path = leader[path]
        return path

    for prim in joint_prims(stage):
        if prim.GetAttribute("physics:excludeFromArticulation").Get():
            continue
        one, other = (group(body_on(stage, prim, side)) for side in (0, 1))
        if one == other:
            return str(prim.GetPath())
        leader[one] = other
    return None


def _named(axes: Sequence[Axis], patterns: Sequence[str]) -> list[Axis]:
    """The axes that patterns name."""
    found: list[Axis] = []
    for pattern in patterns:
        fitting = [
            axis
            for axis in axes
            if pattern == ALL or any(fnmatch.fnmatchcase(name.lower(), pattern.lower()) for name in axis.names)
        ]
        if not fitting:
            names = sorted({axis.name for axis in axes})
            raise ShotError(
                "no joint that a motor can drive has such a name",
                attribute="--motors",
                found=pattern,
                remedy=f"{nearest(pattern.strip('*'), names)}Its joints are {', '.join(names) or 'all fixed'}",
            )
        found += fitting
    return found
