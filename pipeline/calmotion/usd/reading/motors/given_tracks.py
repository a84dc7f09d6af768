"""Tracks that are given in addition to the shot, by the names or paths of joints."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd

from calmotion.arrays import Array
from calmotion.errors import ShotError, raise_all
from calmotion.model import MotorTracks
from calmotion.support.naming import nearest
from calmotion.usd.reading.joints import freedoms
from calmotion.usd.reading.joints.joint_prims import joint_prims

_ANGLES = {"rad": 1.0, "deg": float(np.radians(1.0))}
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_POSITIONS = ("pos", "position", "positions", "angle", "q")
_OTHERS = ("vel", "velocity", "velocities", "qd", "dq", "eff", "effort", "torque", "current", "acc", "acceleration")
_BEHIND = re.compile(rf"(.+)[_./ :-]({'|'.join((*_ANGLES, *_LENGTHS, *_POSITIONS, *_OTHERS))})", re.IGNORECASE)
_SHOWN = 20  # names of joints in a message


@dataclass(frozen=True)
class JointNames:
    """What a column may name a joint by, besides its path.

    Attributes:
        names: The first is told.
        linear: Whether it is a length.
    """

    names: tuple[str, ...]
    linear: bool = False


def tracks_of_joints(given: MotorTracks, joints: Mapping[str, JointNames]) -> tuple[MotorTracks, tuple[str, ...]]:
    """Tracks by the paths of their joints, all in rad or m, and what a user should know of it.

    A column has the name or the path of a joint, in any case. There may be a topic in front of it, and a quantity or a
    unit behind it: `/joint_states/elbow/position`, `elbow_deg`. Velocities and efforts are left out.

    Args:
        given: By the names of columns.
        joints: By path.

    Raises:
        ShotErrors: Names that no joint, or more than one, has; two names of one joint; a unit that is not its.
    """
    found: dict[str, Array] = {}
    columns: dict[str, str] = {}
    meant: list[str] = []
    unused: list[str] = []
    problems: list[ShotError] = []
    for name, values in given.values.items():
        paths, behind = _meant(name, joints)
        if len(paths) != 1:
            problems.append(_unclear(given.origin, name, paths, joints))
        elif behind in _OTHERS:
            unused.append(name)
        else:
            path, own = paths[0], joints[paths[0]]
            unit = given.units.get(name) or (behind if behind in _ANGLES | _LENGTHS else "")
            scale = (_LENGTHS if own.linear else _ANGLES).get(unit or ("m" if own.linear else given.angle_unit))
            problems += _doubts(given.origin, name, unit, scale, columns.setdefault(path, name), own)
            found[path] = values * (scale or 1.0)
            meant += [f"{name} for {own.names[0]}"] if behind else []
    if not found and not problems:
        remedy = "Add a column for each joint that moves, in rad or m"
        said = ", ".join(unused[:_SHOWN])
        problems.append(ShotError("no column has positions of a joint", path=given.origin, found=said, remedy=remedy))
    raise_all(problems)
    notes = [f"{given.origin}: takes the columns {', '.join(meant)}"] if meant else []
    notes += [f"{given.origin}: leaves out columns that are no positions: {', '.join(unused)}"] if unused else []
    return MotorTracks(given.origin, given.times, found), tuple(notes)


def _doubts(
    origin: str, name: str, unit: str, scale: float | None, first: str, joint: JointNames
) -> Iterator[ShotError]:
    if scale is None:
        units = " or ".join(_LENGTHS if joint.linear else _ANGLES)
        yield ShotError(
            "this column has a unit that its joint cannot have",
            path=origin,
            found=f"{name} in {unit}",
            remedy=f"Give the values of {joint.names[0]} in {units}",
        )
    if first != name:
        found = f"{first} and {name}"
        yield ShotError("two columns move the same joint", path=origin, found=found, remedy="Remove one of them")


def _meant(name: str, joints: Mapping[str, JointNames]) -> tuple[list[str], str]:
    """Paths of the joints that a column may mean, and the quantity or unit behind the name of the joint."""
    if name in joints:
        return [name], ""
    exact = [path for path, joint in joints.items() if name in joint.names]
    if exact:
        return exact, ""
    match = _BEHIND.fullmatch(name)
    stems = [(name, "")] if match is None else [(name, ""), (match[1], match[2].lower())]
    for stem, behind in stems:
        for text in dict.fromkeys((stem.lower(), stem.rsplit("/", 1)[-1].lower())):
            alike = [path for path, joint in joints.items() if text in (own.lower() for own in (path, *joint.names))]
            if alike:
                return alike, behind
    return [], ""


def _unclear(origin: str, name: str, paths: Sequence[str], joints: Mapping[str, JointNames]) -> ShotError:
    if paths:
        return ShotError(
            "several joints have this name",
            path=origin,
            found=name,
            remedy=f"Name each by its path: {', '.join(paths)}",
        )
    names = sorted({joint.names[0] for joint in joints.values()})
    shown = ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
    return ShotError(
        "no joint of the robot has this name",
        path=origin,
        found=name,
        remedy=f"{nearest(name, [*joints, *names])}Its joints are {shown}",
    )


def given_tracks(stage: Usd.Stage, given: MotorTracks) -> tuple[MotorTracks, tuple[str, ...]]:
    """The same for the joints of a stage."""
    joints = {
        path: JointNames(_names(path, prim), linear) for prim in joint_prims(stage) for path, linear in _axes(prim)
    }
    return tracks_of_joints(given, joints)


def length_note(given: MotorTracks, frames: Array) -> str:
    """What a user should know of a motion that is longer or shorter than the shot; empty where it is neither.

    Args:
        frames: Times of the frames [s].
    """
    length, end = float(given.times[-1]), float(frames[-1])
    if len(frames) < 2 or abs(length - end) < float(frames[1] - frames[0]):
        return ""
    said = "what comes later is not played" if length > end else "its last pose is held to the end"
    return f"{given.origin} lasts {length:.4g} s, and the range of the shot {end:.4g} s: {said}"


def _axes(prim: Usd.Prim) -> list[tuple[str, bool]]:
    """The path of a joint, or those of its axes where it has several, and whether each is a length."""
    path = str(prim.GetPath())
    if prim.GetTypeName() != freedoms.GENERIC_JOINT:
        return [(path, prim.GetTypeName() == "PhysicsPrismaticJoint")]
    found = freedoms.freedoms(prim)
    if found.kind == freedoms.SEVERAL_FREEDOMS:
        return [(f"{path}.{name}", name in freedoms.TRANSLATIONS) for name in found.free]
    return [(path, found.kind == "prismatic")]


def _names(path: str, prim: Usd.Prim) -> tuple[str, str]:
    """What a joint may be named by: its name as its author wrote it, where USD allows no such name, and that of its
    prim; each with the axis behind it where it has several."""
    name = path.rsplit("/", 1)[-1]
    return name.replace(prim.GetName(), prim.GetDisplayName() or prim.GetName(), 1), name
