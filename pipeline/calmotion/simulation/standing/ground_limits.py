"""What ground can do to each foot, as inequalities that are linear in the multipliers of its contact.

A row of coefficients times the six multipliers of a contact, over a scale, must not fall below its limit: ground
pushes, its force is within the cone of friction (a pyramid inside of it), and its centre of pressure within the sole:
for an edge of the outline with the outer normal n at the distance d from the frame,

    d f_n - n . (up x M + z f) >= 0,

where f and M act on the frame, z above the ground. What the rigid robot needs in the animation is allowed. A foot lands
no faster than the rigid robot's or that of the input.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array, BoolArray
from calmotion.model import Character, Frame
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.model.model import Model, rigid_model
from calmotion.multibody.model.phases import RESTARTED, held_contacts
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.simulator import Simulator
from calmotion.simulation.standing.held_feet import outline, points_of, sole_of, vertical, weight_of

SLOW = 5e-3  # speed of a foot that lands softly enough for all [m/s]
SIDES = 8  # of the pyramid inside of a cone of friction


@dataclass(frozen=True, eq=False)
class Landing:
    """A foot that comes.

    Attributes:
        joint, component: Its contact, and the body that it holds.
        instant: The last one before it holds.
        point: What is held, on the component [m], shape [3].
        speeds: The largest along each axis of the world that are allowed [m/s], shape [3].
    """

    joint: int
    component: int
    instant: int
    point: Array
    speeds: Array


@dataclass(frozen=True, eq=False)
class GroundLimits:
    """The inequalities of R rows at each instant.

    Attributes:
        joints: The contact of each row, shape [R].
        rows: Coefficients of its multipliers, over the row's scale, shape [T, R, 6]; zero where it does not count.
        lower: What they must not fall below, shape [T, R]; minus infinity where the row does not count.
        landings: The feet that come.
    """

    joints: Array
    rows: Array
    lower: Array
    landings: tuple[Landing, ...]

    def values(self, run: ForwardRun) -> Array:
        """What must not fall below `lower`, in a run, shape [T, R]."""
        return np.asarray(np.einsum("nri,nri->nr", self.rows, run.trajectory.states.lam[:, self.joints]))


def ground_limits(
    character: Character, model: Model, grid: TimeGrid, world: Array, angles: Array, rates: Array, before: ForwardRun
) -> GroundLimits | None:
    """The inequalities of a shot; None without contacts that count.

    Args:
        angles, rates: The animator's, shape [T, M].

    Raises:
        SimulationFailure: The rigid robot cannot follow its motors.
    """
    system, gravity = model.system, float(np.linalg.norm(character.gravity))
    joints = np.flatnonzero(system.contact)
    if not len(joints) or gravity == 0.0:
        return None
    rigid = Simulator(rigid_model(model), grid.h, world, False).run(angles, rates)
    axes = reactions(rigid_model(model).system, rigid.trajectory, rigid.joint_angles, rigid.joint_rates).axes
    held, up, weight = held_contacts(system, world), -character.gravity / gravity, weight_of(character)
    owners, rows, lower, landings = [], [], [], []
    for column, joint in enumerate(joints):
        for start, end in _intervals(held[:, column]):
            if start > 0 and not character.bodies[model.tree.body[system.side[joint, 1]]].simulated_flexible:
                landings.append(_landing(model, int(joint), start - 1, grid, (rigid, before)))
            counts = np.zeros(len(held), bool)
            counts[min(start + (RESTARTED - 1 if start else 0), end - 1) : end] = True
            counts &= grid.judged
            if not np.any(counts):
                continue
            made = _foot_rows(character, model, int(joint), rigid, axes[:, joint], (start, up, weight))
            made[~counts] = 0.0
            needed = np.einsum("nri,ni->nr", made, rigid.trajectory.states.lam[:, joint])
            least = np.minimum(0.0, needed[counts].min(axis=0))
            owners += [int(joint)] * made.shape[1]
            rows.append(made)
            lower.append(np.where(counts[:, None], least, -np.inf))
    if not rows:
        return None
    return GroundLimits(np.array(owners), np.concatenate(rows, 1), np.concatenate(lower, 1), tuple(landings))


def _intervals(held: BoolArray) -> list[tuple[int, int]]:
    """First instants and those after the last of the stretches in which a contact holds."""
    ends = np.diff(np.concatenate([[False], held, [False]]).astype(np.int8))
    return [(int(a), int(b)) for a, b in zip(np.flatnonzero(ends > 0), np.flatnonzero(ends < 0), strict=True)]


def landing_velocity(landing: Landing, run: ForwardRun, h: float) -> Array:
    """Velocity of a foot in the step before it is held [m/s], shape [3]."""
    places = _places(landing.component, landing.point, run, [landing.instant - 1, landing.instant])
    return np.asarray((places[1] - places[0]) / h)


def _places(component: int, point: Array, run: ForwardRun, instants: list[int]) -> Array:
    states = run.trajectory.states
    turns = Rotation.from_quat(states.q[instants, component], scalar_first=True)
    return np.asarray(states.c[instants, component] + turns.apply(point))


def _landing(model: Model, joint: int, instant: int, grid: TimeGrid, runs: tuple[ForwardRun, ForwardRun]) -> Landing:
    """A foot that comes after an instant, and may be as fast as the rigid robot's or that of the input."""
    system = model.system
    found = Landing(joint, int(system.side[joint, 1]), max(instant, 1), system.position[joint, 1].copy(), np.zeros(3))
    rigid, before = (landing_velocity(found, run, grid.h) for run in runs)
    least = max(SLOW, float(np.linalg.norm(before)) / np.sqrt(3.0))
    return replace(found, speeds=np.maximum(np.abs(rigid), least))


def _foot_rows(
    character: Character, model: Model, joint: int, run: ForwardRun, axes: Array, known: tuple[int, Array, float]
) -> Array:
    """Rows of a foot that is held from an instant on, shape [T, r, 6].

    Args:
        axes: Of the frame that holds it, world, shape [T, 3, 3].
        known: That instant, up, and the weight of the robot [N].
    """
    start, up, weight = known
    order = [*model.tree.joint, *model.tree.closing]
    contact, body = character.joints[order[joint]].contact, int(model.system.side[joint, 1])
    assert contact is not None
    across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    across /= np.linalg.norm(across)
    other, forces = np.cross(up, across), [up]
    for angle in 2.0 * np.pi * np.arange(SIDES) / SIDES if contact.friction >= 0.0 else ():
        side = np.cos(angle) * across + np.sin(angle) * other
        forces.append(contact.friction * np.cos(np.pi / SIDES) * up - side)
    rows = np.zeros((len(axes), len(forces), 6))
    rows[:, :, :3] = np.array(forces) / weight
    if character.joints[order[joint]].kind != "fixed":
        return rows
    states, frame, turn = run.trajectory.states, model.system.rotation[joint, 1], run.trajectory.states.q[:, body]
    carrier = character.bodies[model.tree.body[body]]
    points = points_of(carrier, Frame(states.c[start, body], states.q[start, body]))
    if not len(points):
        return rows
    own = Rotation.from_quat(turn[start], scalar_first=True).as_matrix() @ frame
    sole, _ = sole_of(points, vertical(own, up))
    plane = np.stack([across, other], axis=1)
    edges = outline(sole @ plane)
    if edges is None:
        return rows
    place = _places(body, model.system.position[joint, 1], run, [start])[0]
    height = float(np.mean(sole @ up)) - float(place @ up)
    normals, size = edges[:, :2] @ plane.T, float(np.ptp(sole @ plane, axis=0).min())
    distances = -(edges[:, 2] + edges[:, :2] @ (place @ plane))
    of_sole = np.zeros((len(axes), len(edges), 6))
    # n . (up x M) = (n x up) . M
    of_sole[:, :, :3] = distances[:, None] * up - height * normals
    of_sole[:, :, 3:] = -np.einsum("ei,nik->nek", np.cross(normals, up), axes)
    return np.concatenate([rows, of_sole / (weight * size)], axis=1)
