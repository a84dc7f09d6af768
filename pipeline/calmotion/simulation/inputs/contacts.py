"""Contacts over time: when feet are held, and where, at the instants of a simulation; what does not support them."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import Animation, Character
from calmotion.model.animation import Contact
from calmotion.model.character import contact_joints
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.model.model import Model, start_angles
from calmotion.multibody.model.moving_markers import pack
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.inputs.roots import sample_roots
from calmotion.simulation.inputs.time_grid import TimeGrid


def sample_world(character: Character, animation: Animation, model: Model, grid: TimeGrid) -> Array:
    """Moving markers of the world at the grid's instants, shape [T, W, 18]: moving roots, then contacts (`phases`).

    A contact's marker stands where the rigid robot has it at the first frame: what holds at the start is held there.
    """
    roots = sample_roots(animation.moving, grid)
    if not contact_joints(character):
        return roots
    system, frame = model.system, grid.pre_steps
    joints = np.flatnonzero(system.contact)
    world = np.concatenate([roots, np.zeros((len(roots), len(joints), roots.shape[2]))], axis=1)
    angles, _ = sample_tracks(animation.tracks, grid)
    pose = rigid_state(model, start_angles(model, model.joint_angles(angles[frame])), world[frame])
    R = np.zeros((3, 3))
    order = [*model.tree.joint, *model.tree.closing]
    for row, joint in zip(system.moving[joints], joints, strict=True):
        body = system.side[joint, 1]
        matrix_of(pose.q[body], R)
        place, axes = pose.c[body] + R @ system.position[joint, 1], R @ system.rotation[joint, 1]
        contact = character.joints[order[joint]].contact
        assert contact is not None
        held = held_steps(contact, grid)
        world[held, row] = pack(place, np.zeros(3), np.zeros(3), axes)
    return world


def held_steps(contact: Contact, grid: TimeGrid) -> BoolArray:
    """Whether a contact holds in the step to each instant, shape [T]; at the first instant in the step from it."""
    starts = np.maximum(np.concatenate([grid.times[:1], grid.times[:-1]]) + 0.5 * grid.h, 0.0)
    return contact.held(starts)


def refuse_unsupported_contacts(character: Character, options: RunSettings) -> None:
    """Refuse what a shot with contacts cannot be combined with.

    Raises:
        ShotError: A loop, or the sag of each pose as reference; a robot that nothing holds at the first frame. An
            `IntegrationError` where another integrator would do.
    """
    joints = [character.joints[k] for k in contact_joints(character)]
    if not joints:
        return
    if options.scheme != "bdf2":
        raise IntegrationError(
            "only bdf2 simulates contacts",
            path=joints[0].path,
            attribute="--integrator",
            found=options.scheme,
            remedy="Leave it out.",
        )
    if character.retarget.cyclic:
        raise ShotError(
            "a shot with contacts cannot loop",
            path=character.path,
            attribute="calm:retarget:cyclic",
            found=True,
            remedy="Set it to false and author some loops one after the other, or remove CalmContactAPI.",
        )
    if character.retarget.reference != "rigid":
        raise ShotError(
            "with contacts the intended motion is that of the rigid robot on its feet",
            path=character.path,
            attribute="calm:retarget:reference",
            found=character.retarget.reference,
            remedy="Set it to rigid, or remove CalmContactAPI.",
        )
    floats = any(joint.kind == "floating" for joint in character.joints)
    if floats and not any(joint.contact is not None and joint.contact.holds_at(0.0) for joint in joints):
        raise ShotError(
            "nothing holds the robot at the first frame, where it must rest: no contact is active there",
            path=joints[0].path,
            attribute="calm:contact:active",
            found=False,
            remedy="Begin the shot while a foot stands, and make its contact active from the first frame on.",
        )
