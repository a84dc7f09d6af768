"""Tracks that are given in addition to the shot, by the names or paths of joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import MotorTracks, Track
from calmotion.support.naming import nearest
from calmotion.usd.reading.joints import freedoms
from calmotion.usd.reading.joints.joint_prims import JointPrim, joint_prims

if TYPE_CHECKING:
    from pxr import Usd


def given_joints(stage: Usd.Stage, given: MotorTracks | None) -> tuple[str, ...]:
    """Paths of the joints that are named.

    Raises:
        ShotError: A name that no joint, or more than one, has; two names of one joint.
    """
    if given is None:
        return ()
    names = {path: _names(path, prim) for prim in joint_prims(stage) for path in _paths(prim)}
    found: dict[str, str] = {}
    for name in given.values:
        named = [path for path in names if path == name] or [path for path in names if name in names[path]]
        if len(named) != 1:
            likely = "" if named else nearest(name, [*names, *(own[0] for own in names.values())])
            raise ShotError(
                "several joints have this name" if named else "no joint has this name",
                path=given.origin,
                found=name,
                remedy=f"{likely}Use the path of a joint, such as {next(iter(named or names), '/Robot/joint')}",
            )
        if (other := found.setdefault(named[0], name)) != name:
            raise ShotError(
                "two columns move the same joint",
                path=given.origin,
                found=f"{other} and {name}",
                remedy="Remove one of them",
            )
    return tuple(found)


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


def _paths(prim: Usd.Prim) -> list[str]:
    """The path of a joint, or those of its axes where it has several."""
    path = str(prim.GetPath())
    if prim.GetTypeName() != freedoms.GENERIC_JOINT:
        return [path]
    found = freedoms.freedoms(prim)
    return [f"{path}.{name}" for name in found.free] if found.kind == freedoms.SEVERAL_FREEDOMS else [path]


def _names(path: str, prim: Usd.Prim) -> tuple[str, str]:
    """What a joint may be named by: its name as its author wrote it, where USD allows no such name, and that of its
    prim; each with the axis behind it where it has several."""
    name = path.rsplit("/", 1)[-1]
    return name.replace(prim.GetName(), prim.GetDisplayName() or prim.GetName(), 1), name


def given_track(given: MotorTracks, joint: JointPrim) -> Track:
    """The track of a joint that is named."""
    name = next(name for name in (joint.path, *_names(joint.path, joint.prim)) if name in given.values)
    return Track(np.asarray(given.times, dtype=np.float64), np.asarray(given.values[name], dtype=np.float64))
