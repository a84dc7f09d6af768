"""The sole of a body that stands on level ground, and how far a centre of pressure stays inside of it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array
from calmotion.model import Motion
from calmotion.model.character import Body, Character, Frame, contact_joints

STANDS = 5e-3  # points of a body that are higher above its lowest one, over its extent, do not stand on the ground


def points_of(body: Body, pose: Frame) -> Array:
    """Points of a body's geometry in a pose, world, shape [n, 3]: of what is drawn, else of all."""
    clouds = [surface.points for surface in body.surfaces if surface.visible] or [s.points for s in body.surfaces]
    if not clouds:
        return np.zeros((0, 3))
    turn = Rotation.from_quat(pose.rotation, scalar_first=True)
    return np.asarray(turn.apply(np.concatenate(clouds)) + pose.position)


def sole_of(points: Array, up: Array) -> tuple[Array, float]:
    """Those of a body's points that stand on the ground, shape [n, 3], and its height [m].

    Args:
        points: Shape [n, 3], not empty.
        up: Unit vector against gravity.
    """
    heights = points @ up
    ground, extent = float(heights.min()), float(np.ptp(points, axis=0).max())
    return points[heights <= ground + STANDS * extent], ground


def centres_of_pressure(forces: Array, moments: Array, places: Array, up: Array, ground: float) -> Array:
    """Where the ground's reactions act, shape [T, 3]; their normal parts are not zero.

    Args:
        forces, moments: Of the ground on the body, the moments about `places`, shape [T, 3] each.
        up: Unit vector against gravity.
        ground: Its height [m].
    """
    levers = (ground - places @ up)[:, None] * forces
    return np.asarray(places + (np.cross(up, moments) + levers) / (forces @ up)[:, None])


def margins(sole: Array, places: Array, up: Array) -> Array | None:
    """How far places are inside of the outline of a sole, seen from above, shape [T]; None where it has no area."""
    across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    across /= np.linalg.norm(across)
    plane = np.stack([across, np.cross(up, across)], axis=1)
    edges = outline(sole @ plane)
    return None if edges is None else np.asarray(-(places @ plane @ edges[:, :2].T + edges[:, 2]).max(axis=1))


def outline(points: Array) -> Array | None:
    """Edges of the convex hull of points of shape [n, 2]: rows (n, c) with n.x + c <= 0 inside, shape [e, 3]; None
    where they have no area."""
    if len(points) < 3:
        return None
    try:
        rows: Array = ConvexHull(points).equations
    except QhullError:
        return None
    # triangles of a sole share its edges
    return rows[np.sort(np.unique(np.round(rows, 9), axis=0, return_index=True)[1])]


def vertical(axes: Array, up: Array) -> Array:
    """The axis of a frame, of either sign, that is nearest to up: feet that give way land tilted."""
    along = axes.T @ up
    nearest = int(np.argmax(np.abs(along)))
    return np.asarray(np.sign(along[nearest]) * axes[:, nearest])


def weight_of(character: Character) -> float:
    """Of the whole robot, flexible bodies without an authored mass left out [N]."""
    masses = [body.mass.mass for body in character.bodies if body.mass is not None]
    return float(np.linalg.norm(character.gravity)) * float(sum(masses))


_NOTHING = 1e-6  # of the weight: a force that is rounding
_LIGHT = 1e-2  # of the weight: a foot that carries less has no centre of pressure that matters


@dataclass(frozen=True, eq=False)
class HeldFoot:
    """A contact while it holds.

    Attributes:
        joint: Index of its joint.
        start, end: When it comes and goes, or the shot begins and ends [s].
        force: Largest reaction, but for the impulse of the landing [N].
        normal: Least part of it that pushes the foot up, negative where the ground would have to pull [N]; with its
            time [s]. None without gravity.
        margin: How far the centre of pressure stays inside of the sole, negative where the foot would tip over [m];
            with its time, and the centre of pressure there, world [m]. None where the sole is not known.
        friction: Largest coefficient of friction that it needs, with its time [s]; None where the ground does not push.
        landing_speed: Of the frame that is held when it comes [m/s]; None for one that holds from the beginning.
        impulse: Of the landing [N s].
        slip: How far the frame moves while it is held [m]: motors that contradict each other between feet.
    """

    joint: int
    start: float
    end: float
    force: float
    normal: tuple[float, float] | None
    margin: tuple[float, float, Array] | None
    friction: tuple[float, float] | None
    landing_speed: float | None
    impulse: float
    slip: float


def held_feet(character: Character, motion: Motion) -> list[HeldFoot]:
    """Every contact of a simulated motion, each time it holds, in the order of the joints and of time."""
    if motion.joint_forces is None or motion.joint_moments is None:
        return []
    found = []
    for joint in contact_joints(character):
        contact = character.joints[joint].contact
        assert contact is not None
        times = motion.times
        middles = np.maximum(0.5 * (times[1:] + times[:-1]), 0.0)
        held = np.concatenate([[False], contact.held(middles), [False]])  # in the step to instant n, and none beyond
        starts, ends = np.flatnonzero(held[1:] & ~held[:-1]), np.flatnonzero(held[:-1] & ~held[1:])
        first = motion.judged.start
        for start, end in zip(starts, ends, strict=True):
            if end > first:
                found.append(_held(character, motion, joint, int(start), int(end), int(first)))
    return found


def _held(character: Character, motion: Motion, joint: int, start: int, end: int, first: int) -> HeldFoot:
    """One that holds in the steps from instant `start` to `end`; the shot begins at instant `first`."""
    assert motion.joint_forces is not None and motion.joint_moments is not None
    body, frame = character.joints[joint].body1, character.joints[joint].frame1
    turns = Rotation.from_quat(motion.rotations[:, body], scalar_first=True)
    places = motion.positions[:, body] + turns.apply(frame.position)
    forces, moments = motion.joint_forces[:, joint], motion.joint_moments[:, joint]
    # at a landing the frame stops; one that holds from the beginning does not land
    lands, h = start > 0, float(motion.times[1] - motion.times[0])
    # the reaction of the step of a landing is mostly the impulse over the step
    steady = slice(max(start + (2 if lands else 0), first), end + 1)
    if steady.start >= steady.stop:
        steady = slice(end, end + 1)
    speed = float(np.linalg.norm(places[start] - places[start - 1])) / h if lands else None
    jump = forces[start + 1] - forces[min(start + 2, end)] if lands else np.zeros(3)
    slip = np.linalg.norm(places[start : end + 1] - places[start], axis=1)
    foot = HeldFoot(
        joint=joint, start=float(motion.times[max(start, first)]), end=float(motion.times[end]),
        force=float(np.linalg.norm(forces[steady], axis=1).max()), normal=None, margin=None, friction=None,
        landing_speed=speed, impulse=h * float(np.linalg.norm(jump)),
        slip=0.0 if character.bodies[body].simulated_flexible else float(slip.max()),
    )  # fmt: skip
    gravity = float(np.linalg.norm(character.gravity))
    if gravity == 0.0:
        return foot
    up, times = -character.gravity / gravity, motion.times[steady]
    lift = forces[steady] @ up
    least, pushed = int(np.argmin(lift)), lift > _LIGHT * weight_of(character)
    foot = replace(foot, normal=(float(lift[least]), float(times[least])))
    if not np.any(pushed):
        return foot
    across = np.linalg.norm(forces[steady] - lift[:, None] * up, axis=1)
    ratio = np.where(pushed, across / np.where(pushed, lift, 1.0), 0.0)
    worst = int(np.argmax(ratio))
    foot = replace(foot, friction=(float(ratio[worst]), float(times[worst])))
    if character.joints[joint].kind != "fixed":
        return foot
    points = points_of(character.bodies[body], Frame(motion.positions[start, body], motion.rotations[start, body]))
    axes = (turns[start] * Rotation.from_quat(frame.rotation, scalar_first=True)).as_matrix()
    rows = np.flatnonzero(pushed) + steady.start
    return replace(foot, margin=_least_margin(points, motion, places, forces, moments, rows, up, vertical(axes, up)))


def _least_margin(
    points: Array, motion: Motion, places: Array, forces: Array, moments: Array, rows: NDArray[np.intp], up: Array,
    normal: Array,
) -> tuple[float, float, Array] | None:  # fmt: skip
    """`HeldFoot.margin` over some rows of a motion; the sole is what lies lowest along a normal of its own."""
    if not len(points):
        return None
    sole, _ = sole_of(points, normal)
    ground = float(np.mean(sole @ up))
    centres = centres_of_pressure(forces[rows], moments[rows], places[rows], up, ground)
    inside = margins(sole, centres, up)
    if inside is None:
        return None
    worst = int(np.argmin(inside))
    return float(inside[worst]), float(motion.times[rows[worst]]), centres[worst]


def unlike_ground(character: Character, foot: HeldFoot) -> list[str]:
    """What a foot asks of the ground that no ground does: `pulls`, `tips`, `slips`."""
    contact = character.joints[foot.joint].contact
    assert contact is not None
    found = []
    if foot.normal is not None and foot.normal[0] < -_NOTHING * weight_of(character):
        found.append("pulls")
    if foot.margin is not None and foot.margin[0] < 0.0:
        found.append("tips")
    if contact.friction >= 0.0 and foot.friction is not None and foot.friction[0] > contact.friction:
        found.append("slips")
    return found
