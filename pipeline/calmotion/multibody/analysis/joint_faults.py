"""Where joints come apart, where a linkage may branch, and free joints that nothing holds where they stand."""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.trajectory import Trajectory, copy_of_instant
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, moves_freely, start_angles
from calmotion.multibody.model.system import System
from calmotion.multibody.model.topology import chain_members
from calmotion.multibody.statics.equilibrium import linearize
from calmotion.support.rotations import rotation_from_quaternion


class OpenJoint(NamedTuple):
    """A joint that has come apart.

    Attributes:
        instant: Of the simulation.
        joint: Its number; those that close chains come after those of the tree.
        gap: [m, rad], shape [6].
    """

    instant: int
    joint: int
    gap: Array


def first_open_joint(
    system: System, trajectory: Trajectory, angles: Array, allowed: float, workspace: Workspace, turned: float = np.inf
) -> OpenJoint | None:
    """The widest joint at the first instant at which one is open by more than is allowed; None where none ever is.

    Args:
        angles: Angle [rad] (or length [m]) of each joint, shape [T, J].
        allowed: Largest gap of positions [m].
        workspace: Scratch of this system.
        turned: Largest gap of rotations [rad]; where it is finite, all instants are looked at.
    """
    counted = trajectory.costs[:, 2] if len(trajectory.costs) else np.full(len(angles), np.inf)
    for instant in np.flatnonzero((counted > allowed) | np.isfinite(turned)):
        workspace.work.world[:] = trajectory.world[instant]
        linearize(system, copy_of_instant(trajectory.states, int(instant)), angles[instant], workspace)
        gaps = np.where(system.contact[:, None] != 0, 0.0, workspace.blocks.gap)  # contacts hold wherever they come
        far = np.maximum(np.linalg.norm(gaps[:, :3], axis=1) / allowed, np.linalg.norm(gaps[:, 3:], axis=1) / turned)
        joint = int(np.argmax(far))
        if far[joint] > 1.0:
            return OpenJoint(int(instant), joint, gaps[joint].copy())
    return None


NEAR = 0.1  # fraction of its median below which a margin is that of a dead centre


def dead_centres(margins: Array) -> list[int]:
    """Instants at which the closed chains pass close to a dead centre: sharp minima of their margin.

    Args:
        margins: Of a `trajectory.Trajectory`, shape [T]; the first instant has none.
    """
    inner = margins[1:]
    if len(inner) < 3 or not np.any(inner > 0.0):
        return []
    low = NEAR * float(np.median(inner))
    return [
        n + 1
        for n in range(1, len(inner) - 1)
        if inner[n] < low and inner[n] < inner[n - 1] and inner[n] <= inner[n + 1]
    ]


_SMALL = 1e-6  # stiffness over weight times length that counts as none


def unheld_joints(model: Model, joint_angles: Array, world: Array | None = None) -> list[int]:
    """Joints, by the component that they carry, that move freely and stand in neutral equilibrium in a rigid pose;
    those of closed chains, which hold each other, are left out.

    Args:
        joint_angles: Values of all joints, shape [J]; those of free joints do not matter.
        world: Moving roots, shape [W, 18].
    """
    system, free = model.system, moves_freely(model)[: len(model.system.parent)]
    if not np.any(free):
        return []
    state = rigid_state(model, start_angles(model, joint_angles), world)
    chained = {b for ends in system.side[len(system.parent) :] for b in chain_members(system.parent, ends)}
    R = rotation_from_quaternion(state.q)
    mass, moment = system.mass.copy(), np.einsum("bij,bj->bi", R, system.s) + system.mass[:, None] * state.c
    for b in range(len(mass) - 1, -1, -1):
        if system.parent[b] >= 0:
            mass[system.parent[b]] += mass[b]
            moment[system.parent[b]] += moment[b]
    found, g = [], system.gravity
    for b in map(int, np.flatnonzero(free)):
        axis = R[b] @ system.rotation[b, 1, :, 2]
        weight = mass[b] * float(np.linalg.norm(g))
        if b in chained or system.rows[b] == 0:  # what floats is held by its contacts
            continue
        place = state.c[b] + R[b] @ system.position[b, 1]
        r, scale = moment[b] - mass[b] * place, _SMALL * weight * system.unit[0, 0]
        if system.sliding[b]:
            neutral = abs(mass[b] * (g @ axis)) <= _SMALL * weight
        elif system.rows[b] == 5:
            slope, stiffness = g @ np.cross(axis, r), g @ r - (g @ axis) * (axis @ r)
            neutral = max(abs(slope), abs(stiffness)) <= scale
        else:
            neutral = True
        if neutral:
            found.append(b)
    return found
