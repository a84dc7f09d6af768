"""A Character of bodies, joints, motors and targets."""

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pxr import Usd

from calmotion.errors import ShotError, raise_all
from calmotion.model import Body, Character, Joint, MassProperties, RetargetSettings
from calmotion.model.motor import PRESCRIBED
from calmotion.support.naming import grouped_notes
from calmotion.usd.clock import Clock
from calmotion.usd.reading import scene, targets
from calmotion.usd.reading.actuators.described_motors import motor_model
from calmotion.usd.reading.animated import moves, refuse_moving
from calmotion.usd.reading.bodies import mass
from calmotion.usd.reading.bodies.flexible import flexible_settings, with_parts
from calmotion.usd.reading.bodies.interfaces import interfaces_of
from calmotion.usd.reading.bodies.scenery import scenery_of
from calmotion.usd.reading.bodies.shapes import note_unread_shape, shapes_of, tets_of
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_of
from calmotion.usd.reading.joints import topology
from calmotion.usd.reading.joints.chains import Between, expanded
from calmotion.usd.reading.joints.contacts import contact_carriers, contact_joints
from calmotion.usd.reading.joints.contradictions import refuse_held_twice, refuse_lost_bodies, tell_what_is_elsewhere
from calmotion.usd.reading.joints.joint_prims import (
    JointPrim,
    body_index,
    joint_prims,
    joint_to_world,
    read_joint,
    refuse_unsupported,
)
from calmotion.usd.reading.joints.roots import on_moving_prim
from calmotion.usd.reading.motors import driven_motors as motors
from calmotion.usd.reading.motors.motor_limits import limits_of_commands
from calmotion.usd.reading.motors.posed_motors import posed_joints
from calmotion.usd.reading.motors.undriven_joints import tell_what_swings
from calmotion.usd.reading.plausibility import warn_of_units
from calmotion.usd.reading.unread import tell_what_is_not_used
from calmotion.usd.reading.variants import no_bodies
from calmotion.usd.transforms import Pose

BETWEEN = 1e-6  # mass and inertia of a part between two axes of a joint, over those of the lighter body at the joint


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The bodies, joints and motors, before geometry and mass are read.

    Attributes:
        bodies: Paths of the bodies, from the world outwards.
        poses: World pose of each, stage units.
        joints: In the order of the bodies they carry.
        drives: The driven joints, in the order of the joints.
        targets: Target prims with the path of their body.
        between: Those of the bodies that are no prims but parts between the axes of a joint.
    """

    bodies: list[str]
    poses: dict[str, Pose]
    joints: list[JointPrim]
    drives: list[motors.Drive]
    targets: list[tuple[Any, str]]
    between: dict[str, Between]


def read_skeleton(
    reading: Reading, clock: Clock, still: bool, given: Sequence[str] = (), measured: Sequence[str] = ()
) -> Skeleton:
    """Find the bodies, joints and motors of the character; bodies without connection to a motor or target are skipped.

    Args:
        still: Whether a character without animation is accepted.
        given: Joints whose tracks are given beside the shot.
        measured: Prims at which sensors measured.

    Raises:
        ShotError: No bodies, no joints or no motors. Problems of single prims are added to the reading.
    """
    stage = reading.stage
    prims = {str(p.GetPath()): p for p in prims_of(stage) if is_rigid_body(p)}
    if not prims:
        raise no_bodies(reading.whole or stage)
    joints_of_stage = joint_prims(stage)
    if not joints_of_stage:
        raise ShotError(
            "no joints: the shot has no enabled PhysicsRevoluteJoint or PhysicsFixedJoint",
            path=topology.common_path(list(prims)),
            remedy="Connect the bodies with joints, and the first one with the world; where bodies have keys, "
            "`calmotion rig FILE -o LAYER` finds the joints from their motion",
        )
    poses = dict(reading.each(prims, lambda path: (path, reading.pose(prims[path]))))
    raise_all(reading.problems)  # joints refer to poses
    joints = [joint for joint in reading.each(joints_of_stage, lambda prim: read_joint(reading, prim, poses)) if joint]
    joints, between = expanded(reading, joints, poses)
    root = topology.common_path(list(prims))
    rooted = _root_moves(reading, prims, joints)
    drives = motors.read_drives(reading, joints, root, posed_joints(reading, joints, clock), given, still, rooted)
    target_prims = targets.target_prims(reading, measured)
    bodies = _moving_bodies(reading, [*prims, *between], joints, drives, [body for _, body in target_prims])
    kept = set(bodies)
    joints = [j for j in joints if (j.body0 or j.body1) in kept]
    reading.each(joints, refuse_unsupported)
    with reading.collecting_problems():
        stiff = {drive.joint.path for drive in drives if motor_model(drive.joint.prim) == PRESCRIBED}
        refuse_held_twice({path: prim for path, prim in prims.items() if path in kept}, joints, stiff)
        refuse_lost_bodies(reading, bodies, joints)
    held = contact_carriers(reading)
    joints += _world_joints(reading, bodies, joints, prims, poses, set(held.values()))
    far = topology.distances(bodies, joints)
    bodies = list(far)
    joints.sort(key=lambda j: max(far.get(j.body0, 0), far.get(j.body1, 0)))  # stable: the shot's order otherwise
    order = {id(joint): k for k, joint in enumerate(joints)}
    drives = sorted((d for d in drives if id(d.joint) in order), key=lambda d: order[id(d.joint)])
    tell_what_swings(reading, joints, [drive.joint for drive in drives])
    posing = {drive.joint.path for drive in drives if drive.source == motors.BODIES}
    held_still = [j for j in joints if j.body0 == "" and j.prim is not None and j.path not in posing]
    fixed = {j.body1: j.path for j in held_still if not on_moving_prim(reading, j)}
    roots = {j.body1 for j in joints if j.body0 == ""}
    with reading.collecting_problems():
        others = [] if posing else [prims[b] for b in bodies if b in prims and b not in roots]
        refuse_moving(reading, {prims[b]: fixed[b] for b in fixed if b in prims}, others)
    joints += contact_joints(reading, held, bodies, poses, clock)
    tell_what_is_elsewhere(reading, joints, poses)
    tell_what_is_not_used(reading, [prims[b] for b in bodies if b in prims], joints)
    inside = {b: between[b] for b in bodies if b in between}
    return Skeleton(bodies, {b: poses[b] for b in bodies}, joints, drives, target_prims, inside)


def build_character(reading: Reading, skeleton: Skeleton) -> Character:
    """Read geometry, mass, materials, targets and settings of a skeleton.

    Raises:
        ShotError: All problems of the shot, those of `read_skeleton` included.
    """
    numbers = {path: k for k, path in enumerate(skeleton.bodies)}
    touching = {path: [j.prim_path for j in skeleton.joints if path in (j.body0, j.body1)] for path in skeleton.bodies}
    fixed = {j.body1 for j in skeleton.joints if j.body0 == "" and j.kind == "fixed" and j.contact is None}
    real = reading.each(
        [path for path in skeleton.bodies if path not in skeleton.between],
        lambda path: _body(reading, path, skeleton.poses[path], touching[path], path in fixed),
    )
    bodies = _with_parts_between(skeleton, real, reading.units.length(1.0))
    drives = {drive.joint.path: drive.actuator for drive in skeleton.drives}
    ranges = {j.path: limits_of_commands(reading, j, drives.get(j.path, "")) for j in skeleton.joints}
    joints = tuple(
        Joint(
            j.path,
            j.kind,
            body_index(j.body0, numbers),
            body_index(j.body1, numbers),
            j.frame0,
            j.frame1,
            *ranges[j.path],
            j.closes_chain,
            name=(j.prim.GetDisplayName() if j.prim else "") or j.path.rsplit("/", 1)[-1],
            contact=j.contact,
        )
        for j in skeleton.joints
    )
    order = {id(joint): k for k, joint in enumerate(skeleton.joints)}
    chosen = tuple(
        reading.each(
            [(prim, body) for prim, body in skeleton.targets if body in numbers],
            lambda target: targets.read_target(reading, target[0], numbers[target[1]], skeleton.poses[target[1]]),
        )
    )
    index = {drive.joint.path: k for k, drive in enumerate(skeleton.drives)}
    driven = reading.each(
        skeleton.drives, lambda drive: motors.read_motor(drive, order[id(drive.joint)], index, reading)
    )
    root = topology.common_path([path for path in skeleton.bodies if path not in skeleton.between])
    gravity, settings = np.zeros(3), RetargetSettings()
    with reading.collecting_problems():
        gravity = scene.gravity(reading, skeleton.bodies)
    with reading.collecting_problems():
        settings = scene.retarget_settings(reading, root)
    raise_all(reading.problems)
    if not chosen:
        lasting = [joint for joint in skeleton.joints if joint.contact is None]
        joints_as_authored = list(dict.fromkeys(joint.whole or joint for joint in lasting))
        outer = topology.leaves([path for path in skeleton.bodies if path not in skeleton.between], joints_as_authored)
        chosen = targets.default_targets(bodies, joints, [numbers[body] for body in outer])
        names = [target.path if len(chosen) == 1 else target.path.rsplit("/", 1)[-1] for target in chosen]
        what = "the target is the outermost point" if len(chosen) == 1 else "targets are the outermost points"
        reading.note(f"no CalmTargetAPI: {what} of {', '.join(names)}")
    default = reading.stage.GetDefaultPrim()
    whole = default and all(b.startswith(f"{default.GetPath()}/") for b in skeleton.bodies if b not in skeleton.between)
    character = Character(
        path=str(default.GetPath()) if whole else root,
        bodies=bodies,
        joints=joints,
        motors=tuple(driven),
        targets=chosen,
        gravity=gravity,
        retarget=settings,
        scenery=scenery_of(reading, bodies),
    )
    warn_of_units(reading, root, character, tuple(fixed))
    return replace(character, notes=grouped_notes(reading.notes))


def _body(reading: Reading, path: str, pose: Pose, joints: list[str], fixed: bool) -> Body:
    prim = reading.stage.GetPrimAtPath(path)
    shapes = shapes_of(reading, prim, pose)
    flexible = flexible_settings(reading, prim, pose)
    if flexible is not None:
        note_unread_shape(reading, shapes)
        flexible = replace(flexible, material=with_parts(reading, prim, flexible.material, shapes))
    believed = flexible is None or mass.states_mass(prim, shapes)
    if not believed:
        mass.note_unread_masses(reading, prim, shapes)
    properties = mass.mass_of(reading, prim, pose, shapes) if believed else None
    if properties is None and flexible is None:  # otherwise the mesh and the density of the material decide
        if not fixed:
            raise ShotError(
                "a body without mass: neither a mass, nor a density with geometry, nor a collider is authored",
                path=path,
                attribute="physics:mass",
                remedy="Apply PhysicsMassAPI and author physics:mass, or physics:density where the body has geometry",
            )
        properties = MassProperties(1.0, np.zeros(3), np.eye(3))
        reading.note(f"{path}: it has no mass, and none is needed: a joint fixes it to the world")
    if properties is not None and not (np.isfinite(properties.mass) and np.all(np.isfinite(properties.inertia))):
        raise ShotError(
            "its mass, or the inertia that follows from its geometry, is not finite",
            path=path,
            attribute="physics:mass",
            found=properties.mass,
            remedy="Author a mass, and correct sizes and densities of its geometry",
        )
    return Body(
        path=path,
        rest=pose.frame(reading.units.length(1.0)),
        mass=properties,
        surfaces=tuple(shape.surface for shape in shapes),
        tets=tets_of(reading, prim, pose),
        flexible=flexible,
        interfaces=interfaces_of(reading, prim, pose, joints) if flexible is not None else (),
    )


def _with_parts_between(skeleton: Skeleton, real: Sequence[Body], meters: float) -> tuple[Body, ...]:
    """The bodies of a skeleton, those between the axes of a joint included: they have a share of the mass of the
    lighter body that the joint connects, which no motion shows."""
    by_path = {body.path: body for body in real}
    for path, part in skeleton.between.items():
        ends = [by_path[end].mass for end in part.ends if end in by_path]
        known = [properties for properties in ends if properties is not None]
        mass = min((properties.mass for properties in known), default=1.0)
        inertia = min((float(np.trace(properties.inertia)) / 3.0 for properties in known), default=1e-3)
        light = MassProperties(BETWEEN * mass, np.zeros(3), BETWEEN * inertia * np.eye(3))
        by_path[path] = Body(path, skeleton.poses[path].frame(meters), light, between=part.joint)
    return tuple(by_path[path] for path in skeleton.bodies if path in by_path)


def _root_moves(reading: Reading, prims: dict[str, Usd.Prim], joints: Sequence[JointPrim]) -> bool:
    """Whether the shot moves a kinematic body, one that hangs on no joint, or what a joint to the world is on."""
    carried = {joint.body1 for joint in joints}
    roots = [
        prim
        for path, prim in prims.items()
        if path not in carried or prim.GetAttribute("physics:kinematicEnabled").Get()
    ]
    return any(moves(reading, prim) is not None for prim in roots) or any(
        joint.body0 == "" and on_moving_prim(reading, joint) for joint in joints
    )


def _moving_bodies(
    reading: Reading, bodies: list[str], joints: list[JointPrim], drives: list[motors.Drive], wanted: list[str]
) -> list[str]:
    """The bodies of every group that a motor moves or a target is on; a note for the others."""
    # where nothing is driven, what joints connect swings
    moved = [drive.joint for drive in drives] or joints
    driven = {end for joint in moved for end in (joint.body0, joint.body1) if end} | set(wanted)
    kept = []
    for group in topology.components(bodies, joints):
        if driven.intersection(group):
            kept += group
        else:
            reading.note(f"{group[0]}: no motor moves this body or those connected to it ({len(group)}); not simulated")
    return kept


def _world_joints(
    reading: Reading, bodies: list[str], joints: list[JointPrim], prims: dict[str, Usd.Prim], poses: dict[str, Pose],
    held: AbstractSet[str],
) -> list[JointPrim]:  # fmt: skip
    """A joint to the world for each kinematic body, and for each group of bodies that has none; it leaves free where a
    contact holds one of these."""
    added = []
    attached = {j.body1 for j in joints if j.body0 == ""}
    for group in topology.components(bodies, joints):
        own = [b for b in group if b in prims]
        kinematic = [b for b in own if prims[b].GetAttribute("physics:kinematicEnabled").Get() and b not in attached]
        added += [joint_to_world(body, poses[body], reading.units.length(1.0)) for body in kinematic]
        if kinematic or attached.intersection(group):
            continue
        carried = {j.body1 for j in joints}
        root = next(iter([b for b in own if b not in carried] or own))
        floats = not held.isdisjoint(group)
        if floats:
            reading.note(f"{root}: no joint connects the character with the world; its contacts hold it")
        else:
            reading.note(f"{root}: no joint connects the character with the world; this body is fixed at its pose")
        kind = "floating" if floats else "fixed"
        added.append(joint_to_world(root, poses[root], reading.units.length(1.0), kind))
    return added
