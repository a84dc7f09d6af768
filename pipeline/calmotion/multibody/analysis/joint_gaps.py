"""Where joints come apart in a simulation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.integrators.trajectory import Trajectory, copy_of_instant
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.system import System
from calmotion.multibody.statics.equilibrium import linearize


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
