"""What the world does to the robot: reactions at its bases and feet, and whether what only stands would tip over."""

from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Character, Motion
from calmotion.model.character import WORLD
from calmotion.simulation.standing.held_feet import (
    STANDS,
    HeldFoot,
    centres_of_pressure,
    held_feet,
    margins,
    points_of,
    sole_of,
    unlike_ground,
)

_STILL = 1e-6  # a base that moves by more does not stand [m]


def reaction_rows(character: Character, motion: Motion) -> list[dict[str, Any]]:
    """For each joint to the world, the largest force and moment on the robot during the shot.

    A base that no joint of the shot holds, and that is the lowest part of the robot, may simply stand on the ground:
    `support_margin_m` is then how far the centre of pressure stays inside of the convex outline on which it stands,
    with wheels and the like that stay in their places; negative where it tips over. The ground is level. It is None
    where the base does not stand, and `center_of_pressure_m` is where it is least, in world axes.
    """
    if motion.joint_forces is None or motion.joint_moments is None:
        return []
    rows, found = motion.judged, []
    times = motion.times[rows]
    for j, joint in enumerate(character.joints):
        if joint.body0 != WORLD or joint.contact is not None or joint.kind == "floating":
            continue
        body = character.bodies[joint.body1]
        forces, moments = motion.joint_forces[rows, j], motion.joint_moments[rows, j]
        sizes, turning = np.linalg.norm(forces, axis=1), np.linalg.norm(moments, axis=1)
        row: dict[str, Any] = {
            "path": joint.path, "body": body.path,
            "max_force_n": float(sizes.max(initial=0.0)), "max_moment_n_m": float(turning.max(initial=0.0)),
            "time_s": float(times[int(np.argmax(turning))]) if len(times) else None,
            "support_margin_m": None, "support_time_s": None, "center_of_pressure_m": None,
        }  # fmt: skip
        if joint.path == body.path:  # a joint of the reader's own
            row |= _standing(character, motion, joint.body1, forces, moments)
        found.append(row)
    return found


def _standing(character: Character, motion: Motion, base: int, forces: Array, moments: Array) -> dict[str, Any]:
    """The last three entries of a row, of a base with the frame of its joint; forces and moments of shape [T, 3]."""
    weight = float(np.linalg.norm(character.gravity))
    still = np.ptp(motion.positions, axis=0).max(axis=1) < _STILL
    if weight == 0.0 or not still[base] or len(forces) == 0:
        return {}
    up = -character.gravity / weight
    clouds = [points_of(body, body.rest) for body in character.bodies]
    lowest, points = [float((cloud @ up).min()) for cloud in clouds if len(cloud)], clouds[base]
    if not len(points):
        return {}
    _, ground = sole_of(points, up)
    slack = STANDS * float(np.ptp(points, axis=0).max())
    if min(lowest) < ground - slack:
        return {}
    points = np.concatenate([cloud for cloud, stays in zip(clouds, still, strict=True) if stays])
    sole = points[points @ up <= ground + slack]
    lift = forces @ up
    if lift.min() <= 0.0:
        return {}  # it is pulled down, and nothing stands like this
    places = np.broadcast_to(motion.positions[0, base], forces.shape)
    pressure = centres_of_pressure(forces, moments, places, up, ground)
    inside = margins(sole, pressure, up)
    if inside is None:
        return {}
    worst = int(np.argmin(inside))
    return {
        "support_margin_m": float(inside[worst]),
        "support_time_s": float(motion.times[motion.judged][worst]),
        "center_of_pressure_m": pressure[worst].tolist(),
    }


def contact_rows(character: Character, motion: Motion) -> list[dict[str, Any]]:
    """What the ground does to each contact each time it holds, see `held_feet`; `unlike_ground` names what no ground
    does."""
    return [_contact_row(character, foot) for foot in held_feet(character, motion)]


def _contact_row(character: Character, foot: HeldFoot) -> dict[str, Any]:
    joint = character.joints[foot.joint]
    contact = joint.contact
    normal, margin, friction = foot.normal, foot.margin, foot.friction
    return {
        "path": joint.path, "body": character.bodies[joint.body1].path, "from_s": foot.start, "to_s": foot.end,
        "max_force_n": foot.force,
        "min_normal_force_n": normal[0] if normal else None, "min_normal_time_s": normal[1] if normal else None,
        "support_margin_m": margin[0] if margin else None, "support_time_s": margin[1] if margin else None,
        "center_of_pressure_m": margin[2].tolist() if margin else None,
        "friction_needed": friction[0] if friction else None, "friction_time_s": friction[1] if friction else None,
        "friction": contact.friction if contact is not None and contact.friction >= 0.0 else None,
        "landing_speed_m_s": foot.landing_speed, "landing_impulse_n_s": foot.impulse, "slip_m": foot.slip,
        "unlike_ground": unlike_ground(character, foot),
    }  # fmt: skip
