"""Contacts: frames on bodies that the world holds while the shot says so (`CalmContactAPI`)."""

from collections.abc import Collection

from pxr import Usd

from calmotion.errors import ShotError
from calmotion.model import Frame
from calmotion.model.animation import Contact
from calmotion.support.rotations import quaternion_from_rotation
from calmotion.usd import schemas
from calmotion.usd.clock import Clock
from calmotion.usd.reading.animated import schedule_of
from calmotion.usd.reading.context import Reading, carrying_body, prims_of, refuse_without_transform
from calmotion.usd.reading.joints.joint_prims import JointPrim
from calmotion.usd.transforms import Pose, pose_from_matrix

_SCHEMA, ACTIVE = "CalmContactAPI", "calm:contact:active"
_KIND, _FRICTION = "calm:contact:kind", "calm:contact:friction"
_KINDS = {"sole": "fixed", "point": "spherical"}


def contact_carriers(reading: Reading) -> dict[str, str]:
    """The body that carries each prim with CalmContactAPI, by paths; a prim that no body carries, or that has no
    transform, is kept as a problem of the reading."""
    found = {}
    for prim in prims_of(reading.stage):
        if schemas.is_applied(prim, _SCHEMA):
            with reading.collecting_problems():
                found[str(prim.GetPath())] = _carrier(prim)
    return found


def _carrier(prim: Usd.Prim) -> str:
    body = carrying_body(prim)
    if not body:
        raise ShotError(
            "a contact must be carried by a body",
            path=prim.GetPath(),
            attribute="apiSchemas",
            found=_SCHEMA,
            remedy="Move the prim below a prim with PhysicsRigidBodyAPI (the foot), or remove CalmContactAPI",
        )
    refuse_without_transform(prim, "a contact")
    return str(body.GetPath())


def contact_joints(
    reading: Reading, carriers: dict[str, str], bodies: Collection[str], poses: dict[str, Pose], clock: Clock
) -> list[JointPrim]:
    """A joint to the world for each contact on one of the bodies.

    Args:
        carriers: As of `contact_carriers`.
        poses: Of the bodies, stage units.
    """
    return reading.each(
        [path for path, body in carriers.items() if body in bodies],
        lambda path: _joint(reading, path, carriers[path], poses[carriers[path]], clock),
    )


def _joint(reading: Reading, path: str, body: str, pose: Pose, clock: Clock) -> JointPrim:
    prim, meters = reading.stage.GetPrimAtPath(path), reading.units.length(1.0)
    kind = schemas.choice(prim, _SCHEMA, _KIND, tuple(_KINDS), "there is no such kind of contact")
    friction = schemas.automatic(prim, _SCHEMA, _FRICTION, zero=True)
    world = pose_from_matrix(reading.world_matrix(prim), path)
    local = Frame(
        reading.units.length(pose.to_local(world.position[None])[0]),
        quaternion_from_rotation(pose.rotation.T @ world.rotation),
    )
    active = schedule_of(prim, _SCHEMA, ACTIVE, clock)
    contact = Contact(active.times, active.active, -1.0 if friction is None else friction)
    return JointPrim(None, path, _KINDS[kind], "", body, world.frame(meters), local, closes_chain=True, contact=contact)
