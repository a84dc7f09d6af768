"""Joints that are geared to others: mimic joints of several dialects."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from calmotion.errors import ShotError
from calmotion.model import TurnsWith
from calmotion.support.naming import nearest
from calmotion.usd.dialects import GEARS, SI, GearSpelling, number_or
from calmotion.usd.reading.joints.joint_prims import JointPrim
from calmotion.usd.units import StageUnits

_LEADING = ("revolute", "prismatic")


@dataclass(frozen=True)
class Gear:
    """value = offset + ratio * value of the leader.

    Attributes:
        leader: Path of the joint that leads.
        ratio: [-], or between metres and radians.
        offset: [rad or m].
    """

    leader: str
    ratio: float
    offset: float


def read_gear(joint: JointPrim, kinds: dict[str, str], units: StageUnits) -> Gear | None:
    """The gear of a joint; None where it has none.

    Args:
        kinds: Kind of every joint, by path.

    Raises:
        ShotError: It is geared to itself, to something that is no joint with one angle or length, or by a ratio that
            is not finite.
    """
    for spelling in GEARS if joint.prim is not None else ():
        if joint.whole is not None and f":{joint.drive}:" not in spelling.leader:
            continue  # it would be about each of its axes
        relationship = joint.prim.GetRelationship(spelling.leader)
        targets = relationship.GetForwardedTargets() if relationship else []
        switch = joint.prim.GetAttribute(spelling.enabled) if spelling.enabled else None
        if not targets or (switch and switch.Get() is False):
            continue
        leader = str(targets[0])
        if len(targets) > 1 or leader == joint.path or kinds.get(leader) not in _LEADING:
            others = [path for path, kind in kinds.items() if kind in _LEADING and path != joint.path]
            likely = "" if leader in kinds else nearest(leader, others)
            raise ShotError(
                "a geared joint follows one other joint, revolute or prismatic",
                path=joint.path,
                attribute=spelling.leader,
                found=", ".join(str(t) for t in targets),
                remedy=f"{likely}Name that joint, or remove the relationship",
            )
        return _gear(joint, spelling, leader, kinds[leader], units)
    return None


def _gear(joint: JointPrim, spelling: GearSpelling, leader: str, leader_kind: str, units: StageUnits) -> Gear:
    ratio = number_or(joint.prim, spelling.ratio, spelling.default_ratio)
    offset = number_or(joint.prim, spelling.offset, 0.0)
    follower, led = (_to_si(kind, spelling.ratio_angles, units) for kind in (joint.kind, leader_kind))
    offset *= _to_si(joint.kind, spelling.angles, units)
    return Gear(leader, spelling.sign * ratio * follower / led, spelling.sign * offset)


def _to_si(kind: str, angles: str, units: StageUnits) -> float:
    if kind == "prismatic":
        return units.length(1.0)
    return 1.0 if angles == SI else float(np.deg2rad(1.0))


_TO, _RATIO = "calm:motor:coupledTo", "calm:motor:coupling"


def read_turns_with(joint: JointPrim, motors: dict[str, int]) -> TurnsWith | None:
    """The other joint that turns the motor of a joint too.

    Args:
        motors: Index of each motor, by the path of its joint.

    Raises:
        ShotError: It names no driven joint, or a ratio that is not finite; a ratio without a joint.
    """
    relationship = joint.prim.GetRelationship(_TO)
    targets = [str(path) for path in relationship.GetForwardedTargets()] if relationship else []
    ratio = number_or(joint.prim, _RATIO, 1.0)
    if not targets and not joint.prim.GetAttribute(_RATIO).HasAuthoredValue():
        return None
    others = [path for path in motors if path != joint.path]
    if len(targets) != 1 or targets[0] not in others:
        likely = nearest(targets[0], others) if targets else ""
        problem, found = "a motor is coupled to one other driven joint", ", ".join(targets) or None
        remedy = f"{likely}Name that joint, or remove {_TO} and {_RATIO}"
        raise ShotError(problem, path=joint.path, attribute=_TO, found=found, remedy=remedy)
    return TurnsWith(motors[targets[0]], ratio)


def led_by_driven(gears: dict[str, Gear], driven: Collection[str]) -> dict[str, Gear]:
    """Gears turned over where the joint that follows is driven, and the one that leads is not: either moves the other.

    Args:
        gears: By path of the joint that follows.
        driven: Paths of joints that have a motor of their own.
    """
    turned = dict(gears)
    while True:
        found = next(
            (
                (path, gear)
                for path, gear in turned.items()
                if gear.leader not in (*driven, *turned) and path in driven and gear.ratio
            ),
            None,
        )
        if found is None:
            return turned
        path, gear = found
        del turned[path]
        turned[gear.leader] = Gear(path, 1.0 / gear.ratio, -gear.offset / gear.ratio)


def resolve(gears: dict[str, Gear]) -> dict[str, Gear]:
    """Gears with chains resolved, so that no leader is geared itself.

    Raises:
        ShotError: Joints that are geared to each other in a circle.
    """
    found = {}
    for path, gear in gears.items():
        seen = [path]
        while gear.leader in gears:
            if gear.leader in seen:
                raise ShotError(
                    "joints are geared to each other in a circle",
                    path=path,
                    found=" -> ".join([*seen, gear.leader]),
                    remedy="Remove one of the gears, so that one joint leads",
                )
            seen.append(gear.leader)
            above = gears[gear.leader]
            gear = Gear(above.leader, gear.ratio * above.ratio, gear.offset + gear.ratio * above.offset)
        found[path] = gear
    return found
