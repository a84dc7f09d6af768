"""What comes and goes: when and where feet are held, which motors are on, at the instants of a simulation; what does
not support that."""

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import Animation, Character
from calmotion.model.animation import Schedule
from calmotion.model.character import contact_joints, switched_motors
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.model.model import Model, start_angles
from calmotion.multibody.model.moving_markers import pack
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.inputs.roots import sample_roots
from calmotion.simulation.inputs.time_grid import TimeGrid


def sample_world(character: Character, animation: Animation, model: Model, grid: TimeGrid) -> Array:
    """Moving markers of the world at the grid's instants, shape [T, W, 18]: moving roots, contacts, and motors that are
    switched (`phases`).

    A contact's marker stands where the rigid robot has it at the first frame: what holds at the start is held there.
    """
    roots, feet = sample_roots(animation.moving, grid), len(contact_joints(character))
    switches = [motor.powered for motor in character.motors if motor.powered is not None]
    if not feet and not switches:
        return roots
    world = np.concatenate([roots, np.zeros((len(roots), feet + len(switches), roots.shape[2]))], axis=1)
    for row, powered in enumerate(switches, roots.shape[1] + feet):
        world[active_steps(powered, grid), row] = pack(np.zeros(3), np.zeros(3), np.zeros(3), np.eye(3))
    system, frame = model.system, grid.pre_steps
    joints = np.flatnonzero(system.contact)
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
        held = active_steps(contact, grid)
        world[held, row] = pack(place, np.zeros(3), np.zeros(3), axes)
    return world


def active_steps(schedule: Schedule, grid: TimeGrid) -> BoolArray:
    """Whether a contact holds, or a motor is on, in the step to each instant, shape [T]; at the first instant in the
    step from it."""
    starts = np.maximum(np.concatenate([grid.times[:1], grid.times[:-1]]) + 0.5 * grid.h, 0.0)
    return schedule.held(starts)


def refuse_unsupported_contacts(character: Character, options: RunSettings) -> None:
    """Refuse what a shot with contacts, or with motors that are switched, cannot be combined with.

    Raises:
        ShotError: A loop, or with contacts the sag of each pose as reference; a robot that nothing holds at the first
            frame. An `IntegrationError` where another integrator would do.
    """
    joints = [character.joints[k] for k in contact_joints(character)]
    switched = [character.motors[motor].path for motor in switched_motors(character)]
    if not joints and not switched:
        return
    what, remove = ("contacts", "CalmContactAPI") if joints else ("motors that are switched", "calm:motor:powered")
    if options.scheme != "bdf2":
        raise IntegrationError(
            f"only bdf2 simulates {what}",
            path=joints[0].path if joints else switched[0],
            attribute="--integrator",
            found=options.scheme,
            remedy="Leave it out.",
        )
    if character.retarget.cyclic:
        raise ShotError(
            f"a shot with {what} cannot loop",
            path=character.path,
            attribute="calm:retarget:cyclic",
            found=True,
            remedy=f"Set it to false and author some loops one after the other, or remove {remove}.",
        )
    if joints and character.retarget.reference != "rigid":
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
