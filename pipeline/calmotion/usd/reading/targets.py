"""Targets: the frames whose errors are measured, authored or chosen."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from pxr import Sdf, Usd

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Body, Frame, Joint, Target, WeightTrack
from calmotion.model.character import WORLD
from calmotion.support.naming import nearest
from calmotion.support.rotations import quaternion_from_rotation
from calmotion.usd import schemas
from calmotion.usd.clock import Clock
from calmotion.usd.reading.animated import animation_codes, moves_on_body
from calmotion.usd.reading.context import Reading, carrying_body, prims_of, refuse_without_transform, switched_off_body
from calmotion.usd.transforms import Pose, pose_from_matrix

_SCHEMA = "CalmTargetAPI"
WEIGHTS = ("calm:target:positionWeight", "calm:target:rotationWeight")
_PARTS = 32  # between two knots of a weight's spline
_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def target_prims(reading: Reading, measured: Sequence[str] = ()) -> list[tuple[Any, str]]:
    """The prims with CalmTargetAPI, each with the path of the body that carries it; one that none carries, or that has
    no transform, is kept as a problem of the reading.

    Args:
        measured: Paths of prims at which sensors measured: they are targets as well.
    """
    found = []
    for prim in prims_of(reading.stage):
        if schemas.is_applied(prim, _SCHEMA):
            with reading.collecting_problems():
                found.append((prim, _carrier(prim)))
    known = {str(prim.GetPath()) for prim, _ in found}
    for path in measured:
        if path not in known:
            with reading.collecting_problems():
                prim = _measured_prim(reading, path)
                found.append((prim, _carrier(prim, "a sensor")))
    return found


def _measured_prim(reading: Reading, path: str) -> Usd.Prim:
    prim = reading.stage.GetPrimAtPath(path) if _is_prim_path(path) else None
    if not prim:
        near = nearest(path, [str(other.GetPath()) for other in prims_of(reading.stage)])
        raise ShotError(
            "a recording names a prim that the shot does not have",
            path=path,
            remedy=f"{near}Correct the column of the recording, its row in the map, or --sensor",
        )
    return prim


def _is_prim_path(path: str) -> bool:
    """Whether a text is the path of a prim."""
    return bool(Sdf.Path.IsValidPathString(path)[0]) and Sdf.Path(path).IsAbsoluteRootOrPrimPath()


def _carrier(prim: Usd.Prim, what: str = "a target") -> str:
    body = carrying_body(prim)
    if off := switched_off_body(prim):
        raise ShotError(
            f"{what} is on a body that is switched off, and does not move",
            path=off.GetPath(),
            attribute="physics:rigidBodyEnabled",
            found=f"False; it carries {prim.GetPath()}",
            remedy="Set it to true, or move the target to a body that moves",
        )
    if not body and what != "a target":
        raise ShotError(
            f"{what} must be on a body",
            path=prim.GetPath(),
            found="a prim that no body carries",
            remedy="Name a prim with PhysicsRigidBodyAPI or one below it, or correct the recording's column",
        )
    if not body:
        raise ShotError(
            "a target must be carried by a body",
            path=prim.GetPath(),
            attribute="apiSchemas",
            found=_SCHEMA,
            remedy="Move the prim below a prim with PhysicsRigidBodyAPI, or remove CalmTargetAPI",
        )
    refuse_without_transform(prim, what)
    return str(body.GetPath())


def read_target(reading: Reading, prim: Usd.Prim, body: int, pose: Pose) -> Target:
    """An authored target.

    Args:
        body: Index of its body.
        pose: World pose of that body, stage units.

    Raises:
        ShotError: Weights that are negative, not finite, or both zero; a transform that shears.
    """
    target_pose = pose_from_matrix(reading.world_matrix(prim), str(prim.GetPath()))
    if moves_on_body(prim):
        reading.notes.append(f"{prim.GetPath()}: it moves on its body; its place at the first frame is used")
    weights = [_weight(reading, prim, name) for name in WEIGHTS]
    some = weights != [0.0, 0.0] or any(_counts_later(prim, name) for name in WEIGHTS)
    schemas.require(
        some, prim, "calm:target:positionWeight", "0, and calm:target:rotationWeight 0",
        "both weights of the target are zero", "Give it a positive weight, or remove CalmTargetAPI",
    )  # fmt: skip
    return Target(
        path=str(prim.GetPath()),
        body=body,
        frame=Frame(
            reading.units.length(pose.to_local(target_pose.position[None])[0]),
            quaternion_from_rotation(pose.rotation.T @ target_pose.rotation),
        ),
        position_weight=weights[0],
        rotation_weight=weights[1],
    )


def default_targets(bodies: Sequence[Body], joints: Sequence[Joint], ends: Sequence[int]) -> tuple[Target, ...]:
    """The targets where none is authored: the outermost points of the leaf bodies. Flexible bodies in closed chains
    that reach beyond their joints, and carry no leaf, count as leaves; rods between two joints then do not.

    The leaf of a lever with a push rod is the rod, which shows nothing of how the lever bends.

    Args:
        ends: Indices of the leaf bodies.
    """
    lasting = [joint for joint in joints if joint.contact is None]
    reaching = [
        body
        for body in range(len(bodies))
        if bodies[body].simulated_flexible
        and body not in ends
        and not _is_between(bodies[body], body, lasting)
        and _stand_without(body, ends, lasting)
    ]
    if reaching:
        ends = [end for end in ends if not _is_between(bodies[end], end, lasting)]
    return tuple(outermost_target(bodies[body], body, lasting) for body in [*ends, *reaching])


def _is_between(body: Body, index: int, joints: Sequence[Joint]) -> bool:
    """Whether a body of two joints ends near them: no point of it is farther from both than they are from each
    other."""
    origins = _anchors(index, joints)
    if len(origins) != 2:
        return len(origins) > 2
    position = outermost_target(body, index, joints).frame.position
    return bool(min(np.linalg.norm(position - origin) for origin in origins) <= np.linalg.norm(origins[0] - origins[1]))


def _anchors(index: int, joints: Sequence[Joint]) -> list[Array]:
    """Where joints are attached to a body, in its frame."""
    return [
        joint.frame1.position if joint.body1 == index else joint.frame0.position
        for joint in joints
        if index in (joint.body0, joint.body1)
    ]


def _stand_without(body: int, ends: Sequence[int], joints: Sequence[Joint]) -> bool:
    """Whether all leaves are connected with the world when a body is taken away."""
    reached = {WORLD}
    while True:
        near = [{joint.body0, joint.body1} for joint in joints if body not in (joint.body0, joint.body1)]
        more = {other for pair in near if pair & reached for other in pair} - reached
        if not more:
            return reached.issuperset(ends)
        reached |= more


def outermost_target(body: Body, index: int, joints: Sequence[Joint]) -> Target:
    """The target of a leaf body where none is authored: its point farthest from the joints that carry it."""
    origins = _anchors(index, joints)
    center = np.mean(origins, axis=0) if origins else np.zeros(3)
    points = [s.points for s in body.surfaces if s.visible] or [s.points for s in body.surfaces]
    if body.tets is not None:
        points.append(body.tets.points)
    if points:
        cloud = np.concatenate(points)
        position = cloud[int(np.argmax(np.linalg.norm(cloud - center, axis=1)))]
    else:
        position = np.zeros(3) if body.mass is None else body.mass.center
    return Target(body.path, index, Frame(np.array(position), _UPRIGHT.copy()))


def _varies(prim: Usd.Prim, name: str) -> bool:
    attribute = prim.GetAttribute(name)
    return bool(attribute) and len(animation_codes(attribute)) > 1


def _counts_later(prim: Usd.Prim, name: str) -> bool:
    """Whether a weight that varies is not zero at all samples."""
    attribute = prim.GetAttribute(name)
    return _varies(prim, name) and any(attribute.Get(code) != 0.0 for code in animation_codes(attribute))


def weight_tracks(stage: Usd.Stage, targets: Sequence[Target], clock: Clock) -> tuple[WeightTrack, ...]:
    """Weights of the targets that change in time, linear between their samples as USD has it.

    Raises:
        ShotError: A sample that is negative or not finite.
    """
    found = []
    for index, target in enumerate(targets):
        prim = stage.GetPrimAtPath(target.path)
        if not schemas.is_applied(prim, _SCHEMA):
            continue
        for name in filter(lambda name: _varies(prim, name), WEIGHTS):
            attribute = prim.GetAttribute(name)
            codes = np.array(animation_codes(attribute, _PARTS), dtype=np.float64)
            values = np.array([_checked(prim, name, attribute.Get(code)) for code in codes])
            found.append(WeightTrack(index, name == WEIGHTS[1], clock.seconds(codes), values))
    return tuple(found)


def _checked(prim: Usd.Prim, name: str, value: float | None) -> float:
    right = value is not None and math.isfinite(value) and value >= 0.0
    schemas.require(right, prim, name, value, "a weight must not be negative", "Author a weight of 0 or more")
    return float(value or 0.0)


def _weight(reading: Reading, prim: Usd.Prim, name: str) -> float:
    return _checked(prim, name, schemas.value(prim, _SCHEMA, name, reading.start))
